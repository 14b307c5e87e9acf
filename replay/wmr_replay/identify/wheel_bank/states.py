"""The state of one hypothesis about a robot with encoders, and its prior.

x, y, ψ; the slip velocities s_sum = (s_R + s_L)/2, s_lat = v_lat + x_icr ω + k v ω and s_diff = (s_R − s_L)/2
in m/s; and six parameters of the robot: ln of the wheels' scale κ, ln of the effective half track l_e, the
offset x_icr of the centre of rotation in m, its lateral slip k in s, the difference g of the wheels' scales,
and d in s by which the wheel speeds are late against the pose.

    u_sum = κ (r (φ̇_R + φ̇_L)/2 + g r (φ̇_R − φ̇_L)/2)(t + d)     v = u_sum − s_sum
    u_diff = κ (r (φ̇_R − φ̇_L)/2 + g r (φ̇_R + φ̇_L)/2)(t + d)    l_e ω = u_diff − s_diff
    v_lat = −(x_icr + k v) ω + s_lat

The places are those of the torque bank, so that both share their hypotheses.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.states import (
    IDEAL,
    N_MOVING,
    N_STATES,
    PSI,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
    X,
    Y,
)
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS, WheelPriors
from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

S_SUM, S_LAT, S_DIFF, LN_SCALE, LN_TRACK, ICR, LATERAL, DIFFERENCE, DELAY = range(3, 12)

__all__ = [
    "DELAY",
    "DIFFERENCE",
    "ICR",
    "IDEAL",
    "LATERAL",
    "LN_SCALE",
    "LN_TRACK",
    "N_MOVING",
    "N_STATES",
    "PSI",
    "SKIDDING",
    "SKIDDING_SLIPPING",
    "SLIPPING",
    "S_DIFF",
    "S_LAT",
    "S_SUM",
    "WheelPrior",
    "X",
    "Y",
    "make_wheel_prior",
]


class WheelPrior(NamedTuple):
    """Mean and standard deviation (6,) of the parameters, from ``LN_SCALE`` on."""

    mean: F64
    sd: F64


Known = Mapping[str, tuple[float, float]]
"""Sizes of effects of the wheel-speed base by name, each with its standard deviation."""
PARAMETER_OF = {
    "wheel_scale": LN_SCALE,
    "effective_track": LN_TRACK,
    "icr_offset": ICR,
    "lateral_slip": LATERAL,
    "wheel_scale_difference": DIFFERENCE,
    "pose_delay": DELAY,
}
"""The state that an effect of a model sets."""


def make_wheel_prior(
    robot: RobotParameters, known: Known = MappingProxyType({}), priors: WheelPriors = WHEEL_PRIORS
) -> WheelPrior:
    """The prior of a robot about its nominal dimensions, or about a model's ``known`` effects.

    An unknown half track has a wide one.
    """
    half_track_m = robot.half_track_m or priors.unknown_half_track_m
    ln_track_sd = priors.ln_track_sd if robot.half_track_m else priors.unknown_ln_track_sd
    ln_scale_sd = priors.ln_scale_sd if robot.wheel_radius_m else priors.unknown_ln_scale_sd
    mean = np.array([0.0, np.log(half_track_m), 0.0, 0.0, 0.0, 0.0])
    sd = np.array(
        [
            ln_scale_sd,
            ln_track_sd,
            priors.icr_sd_m,
            priors.lateral_sd_s,
            priors.difference_sd,
            priors.delay_sd_s,
        ]
    )
    for name, (size, size_sd) in known.items():
        place = PARAMETER_OF[name] - LN_SCALE
        sd[place] = max(size_sd, priors.least_known_sd)
        if name in ("wheel_scale", "effective_track"):
            mean[place] += math.log1p(size)
            sd[place] /= 1.0 + size
        else:
            mean[place] = -size if name == "pose_delay" else size
    return WheelPrior(mean, sd)

"""The paper's scheme where wheel speeds are known and torques are not: both constraints are measured.

With rolling rim speeds g_i = r φ̇_i by the robot's stated or calibrated dimensions, in robot conventions,

    s_R = g_R − (v_long + l·yaw_rate)    s_L = g_L − (v_long − l·yaw_rate)    s_lat = v_lat + x_icr·yaw_rate + k·v_long·yaw_rate

a wheel slips where |s| exceeds max(.05 m/s, .03 |v_long|), the robot skids where |s_lat| exceeds .03 m/s and
what its tyres may yield. A claim has to exceed three standard deviations of the estimate as well, and what an
error of the dimensions may amount to. A small estimate excludes a mode only where neither hides the mode.
Nothing is learnt and nothing is remembered: every row stands for itself.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.independence import INDEPENDENT, NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict, WheelEstimates, no_posterior
from wmr_replay.identify.motion import Motion
from wmr_replay.identify.thresholds.identifier import Rules
from wmr_schemas.arrays import F64, I8, U8, Bool
from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import Status

SLIP_MPS, SLIP_SHARE, SKID_MPS = 0.05, 0.03, 0.03
"""What counts as a slip and as a skid."""
HIDDEN_SD = 2.0
"""A mode that is as large as its threshold stays hidden where this many standard deviations exceed that."""
STATED_RADIUS_SD, STATED_TRACK_SD = 0.015, 0.35
"""Shares: radii are stated to 3 %; the track of a robot that turns by sliding is up to 2.2 times the stated."""
STANDSTILL_MPS = 0.05
"""Below it a slip ratio has no meaning."""
OPEN = ModeSet.ALL


class Dimensions(NamedTuple):
    """Of a robot, NaN where unknown: rim radii of the left and the right wheel, effective half track, x_icr, k;
    standard deviations, as shares, of radius and half track; and whether x_icr and k are known.
    """

    radii_m: tuple[float, float]
    half_track_m: float
    icr_m: float
    lateral_s: float
    radius_sd: float
    track_sd: float
    sideways_known: bool


def dimensions_of(robot: RobotParameters, known: Mapping[str, tuple[float, float]]) -> Dimensions:
    """The stated dimensions with a model's ``known`` effects, (size, standard deviation) by name."""

    def size(name: str) -> float:
        return known.get(name, (0.0, 0.0))[0]

    radius = np.nan if robot.wheel_radius_m is None else robot.wheel_radius_m * (1.0 + size("wheel_scale"))
    half_track = (
        np.nan if robot.half_track_m is None else robot.half_track_m * (1.0 + size("effective_track"))
    )
    apart = size("wheel_scale_difference")
    return Dimensions(
        (radius * (1.0 - apart), radius * (1.0 + apart)),
        half_track,
        size("icr_offset"),
        size("lateral_slip"),
        known["wheel_scale"][1] if "wheel_scale" in known else STATED_RADIUS_SD,
        known["effective_track"][1] if "effective_track" in known else STATED_TRACK_SD,
        "icr_offset" in known or "lateral_slip" in known,
    )


class Judged(NamedTuple):
    """Of a constraint at each row, (n,): whether it is violated for sure, and whether it holds for sure."""

    violated: Bool
    holds: Bool


def judged(size: F64, limit: F64, sd: F64, margin: F64, threshold_sd: float) -> Judged:
    """A constraint by the estimate of its ``size``, which errors of the dimensions move by ``margin`` at most."""
    violated = np.abs(size) > np.maximum(limit, threshold_sd * sd) + margin
    seen = (HIDDEN_SD * sd <= limit) & (margin <= limit)
    return Judged(violated, seen & ~violated & np.isfinite(size))


class WheelThresholds:
    """Stage: evidence in, verdicts out, for a robot whose wheel speeds are known and whose torques are not."""

    def __init__(
        self, robot: RobotParameters, rules: Rules, known: Mapping[str, tuple[float, float]]
    ) -> None:
        self._dimensions, self._rules = dimensions_of(robot, known), rules

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in any order: none depends on another."""
        motion, n = evidence.motion, len(evidence.t_ns)
        slips, sds, margins = self._slips(motion, evidence.smoothed_wheels)
        limit = np.maximum(SLIP_MPS, SLIP_SHARE * np.abs(motion.v_long_mps))
        wheels = [
            judged(slip, limit, sd, margin, self._rules.threshold_sd)
            for slip, sd, margin in zip(slips, sds, margins, strict=True)
        ]
        slipping = Judged(wheels[0].violated | wheels[1].violated, wheels[0].holds & wheels[1].holds)
        skidding, threshold = self._skidding(motion)
        independent = evidence.independence == INDEPENDENT
        modes = np.where(independent, modes_left(skidding, slipping), OPEN).astype(np.uint8)
        unknown, filling = np.full(n, np.nan), np.isnan(motion.v_long_mps)
        modes[filling] = OPEN
        outcome = np.where(
            evidence.independence == NOT_INDEPENDENT,
            Status.POSE_NOT_INDEPENDENT,
            outcomes(modes, np.isfinite(slips[0])),
        )
        return Verdict(
            c_d_mps2=unknown,
            c_k_threshold_mps=threshold,
            c_d_threshold_mps2=unknown,
            posterior=no_posterior(n),
            alpha=unknown,
            alpha_sd=unknown,
            mode=alone(modes),
            mode_set=modes,
            outcome=np.where(filling, Status.WARMING_UP, outcome).astype(np.int8),
            wheels=estimates(slips, np.hypot(sds, margins), self._rims(evidence)).without(~independent),
        )

    def _rims(self, evidence: Evidence) -> F64:
        """Rim speeds (2, n) of the left and the right wheel through the window of the motion."""
        return evidence.smoothed_wheels * np.array(self._dimensions.radii_m)[:, None]

    def _slips(self, motion: Motion, wheels: F64) -> tuple[F64, F64, F64]:
        """Slip velocities (2, n) of the left and the right wheel, their standard deviations, and what errors
        of the dimensions may amount to in them.
        """
        d, side = self._dimensions, np.array([[-1.0], [1.0]])
        rims = wheels * np.array(d.radii_m)[:, None]
        around = d.half_track_m * motion.yaw_rate_radps
        slips = rims - motion.v_long_mps - side * around
        sd = np.hypot(motion.v_long_mps_sd, d.half_track_m * motion.yaw_rate_radps_sd)
        margin = HIDDEN_SD * np.hypot(d.radius_sd * np.abs(rims), d.track_sd * np.abs(around))
        return slips, np.broadcast_to(sd, slips.shape), margin

    def _skidding(self, motion: Motion) -> tuple[Judged, F64]:
        """Whether the robot skids, and the threshold (n,) that decides."""
        d, rules = self._dimensions, self._rules
        own = (d.icr_m + d.lateral_s * motion.v_long_mps) * motion.yaw_rate_radps
        yields = 0.0 if d.sideways_known else rules.min_sideslip
        margin = np.maximum(yields * np.abs(motion.v_long_mps) - SKID_MPS, 0.0)
        limit = np.full(len(own), SKID_MPS)
        skids = judged(motion.v_lat_mps + own, limit, motion.v_lat_mps_sd, margin, rules.threshold_sd)
        return skids, np.maximum(limit, rules.threshold_sd * motion.v_lat_mps_sd) + margin


def modes_left(skidding: Judged, slipping: Judged) -> U8:
    """The modes (n,) that are not excluded, as a :class:`~wmr_schemas.modes.ModeSet`."""
    left = np.zeros(len(skidding.violated), np.uint8)
    for mode in (ModeSet.IDEAL, ModeSet.SKIDDING, ModeSet.SLIPPING, ModeSet.SKIDDING_SLIPPING):
        skids = mode in (ModeSet.SKIDDING, ModeSet.SKIDDING_SLIPPING)
        slips = mode in (ModeSet.SLIPPING, ModeSet.SKIDDING_SLIPPING)
        excluded = (skidding.holds if skids else skidding.violated) | (
            slipping.holds if slips else slipping.violated
        )
        left |= np.where(excluded, 0, int(mode)).astype(np.uint8)
    return left


def alone(modes: U8) -> I8:
    """The mode (n,) of a set of one mode, else −1."""
    found = np.full(len(modes), ContactMode.UNDECIDED, np.int8)
    for place in range(4):
        found[modes == 1 << place] = place
    return found


def outcomes(modes: U8, known: Bool) -> I8:
    """Why more than one mode is left, (n,); OK where one is. Rows whose wheel speeds are not ``known`` lack
    what tells slipping.
    """
    skids_open = (modes & int(ModeSet.IDEAL | ModeSet.SLIPPING) != 0) & (
        modes & int(ModeSet.SKIDDING | ModeSet.SKIDDING_SLIPPING) != 0
    )
    reason = np.where(skids_open, Status.NOT_TURNING, Status.NOT_EXCITED)
    reason = np.where(known, reason, Status.NO_TORQUE)
    return np.where(alone(modes) >= 0, Status.OK, reason).astype(np.int8)


def estimates(slips: F64, sds: F64, rims: F64) -> WheelEstimates:
    """Slip velocities and ratios with their standard deviations; of the robot nothing is learnt."""
    faster = np.maximum(np.abs(rims), np.abs(rims - slips))
    faster = np.where(faster < STANDSTILL_MPS, np.nan, faster)
    unknown = np.full(slips.shape[1], np.nan)
    sds = np.where(np.isnan(slips), np.nan, sds)
    left, right = ((slips[k], sds[k]) for k in range(2))
    ratios = [(slips[k] / faster[k], sds[k] / faster[k]) for k in range(2)]
    return WheelEstimates(*left, *right, *ratios[0], *ratios[1], *[unknown] * 6)

"""Slip velocities, slip ratios and the robot's learnt dimensions, from the bank's answers."""

import numpy as np

from wmr_replay.identify.interface import WheelEstimates
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.steps import PARAMETERS, SLIPS
from wmr_schemas.arrays import F64, Bool

STANDSTILL_MPS = 0.05
"""A slip ratio has no meaning below it: rounding of the encoders alone would be a large share."""
SCALE, TRACK, ICR = PARAMETERS, PARAMETERS + 1, PARAMETERS + 2
N_SLIPS, N_PARAMETERS = 3, 6
LEARNT_SD = tuple(
    0.5 * sd for sd in (WHEEL_PRIORS.ln_scale_sd, WHEEL_PRIORS.ln_track_sd, WHEEL_PRIORS.icr_sd_m)
)
"""A parameter is learnt once it is known twice as well as an ordinary robot's is beforehand."""


def wheel_estimates(answers: F64, speeds: F64) -> WheelEstimates:
    """``answers`` (23, n) of the bank by row; ``speeds`` (2, n) of left and right wheel, r·φ̇ in m/s. Slips
    are NaN where these are.
    """
    scale, half_track = np.exp(answers[SCALE]), np.exp(answers[TRACK])
    unknown = np.where(np.isfinite(speeds).all(axis=0), 0.0, np.nan)
    slips = [(answers[SLIPS + k] + unknown, sd_of(answers, SLIPS + k, N_SLIPS) + unknown) for k in range(2)]
    ratios = [slip_ratio(*slip, scale * speed) for slip, speed in zip(slips, speeds, strict=True)]
    sds = [sd_of(answers, row, N_PARAMETERS) for row in (SCALE, TRACK, ICR)]
    learnt = [
        where_learnt(scale, scale * sds[0], sds[0] < LEARNT_SD[0]),
        where_learnt(half_track, half_track * sds[1], sds[1] < LEARNT_SD[1]),
        where_learnt(answers[ICR], sds[2], sds[2] < LEARNT_SD[2]),
    ]
    return WheelEstimates(*slips[0], *slips[1], *ratios[0], *ratios[1], *learnt[0], *learnt[1], *learnt[2])


def where_learnt(value: F64, sd: F64, learnt: Bool) -> tuple[F64, F64]:
    """A parameter and its standard deviation, NaN where the motion has not shown it yet."""
    return np.where(learnt, value, np.nan), np.where(learnt, sd, np.nan)


def sd_of(answers: F64, row: int, apart: int) -> F64:
    """The standard deviation (n,) of the mean in a row, whose second moment is ``apart`` rows below."""
    variance: F64 = np.maximum(answers[row + apart] - answers[row] ** 2, 0.0)
    return np.sqrt(variance)


def slip_ratio(slip: F64, sd: F64, wheel_mps: F64) -> tuple[F64, F64]:
    """Slip over the larger of wheel and ground speed, and its standard deviation; NaN near standstill."""
    faster = np.maximum(np.abs(wheel_mps), np.abs(wheel_mps - slip))
    faster = np.where(faster < STANDSTILL_MPS, np.nan, faster)
    return slip / faster, sd / faster

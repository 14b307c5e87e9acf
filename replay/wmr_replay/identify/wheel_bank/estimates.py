"""Slip velocities, slip ratios and the robot's learnt dimensions, from the bank's answers."""

import numpy as np

from wmr_replay.identify.interface import WheelEstimates
from wmr_replay.identify.wheel_bank.steps import PARAMETERS, SLIPS
from wmr_schemas.arrays import F64

STANDSTILL_MPS = 0.05
"""A slip ratio has no meaning below it: rounding of the encoders alone would be a large share."""
SCALE, TRACK, ICR = PARAMETERS, PARAMETERS + 1, PARAMETERS + 2
N_SLIPS, N_PARAMETERS = 3, 6


def wheel_estimates(answers: F64, speeds: F64) -> WheelEstimates:
    """``answers`` (23, n) of the bank by row; ``speeds`` (2, n) of left and right wheel, r·φ̇ in m/s. Slips
    are NaN where these are.
    """
    scale, half_track = np.exp(answers[SCALE]), np.exp(answers[TRACK])
    unknown = np.where(np.isfinite(speeds).all(axis=0), 0.0, np.nan)
    slips = [(answers[SLIPS + k] + unknown, sd_of(answers, SLIPS + k, N_SLIPS) + unknown) for k in range(2)]
    ratios = [slip_ratio(*slip, scale * speed) for slip, speed in zip(slips, speeds, strict=True)]
    return WheelEstimates(
        *slips[0],
        *slips[1],
        *ratios[0],
        *ratios[1],
        scale,
        scale * sd_of(answers, SCALE, N_PARAMETERS),
        half_track,
        half_track * sd_of(answers, TRACK, N_PARAMETERS),
        answers[ICR],
        sd_of(answers, ICR, N_PARAMETERS),
    )


def sd_of(answers: F64, row: int, apart: int) -> F64:
    """The standard deviation (n,) of the mean in a row, whose second moment is ``apart`` rows below."""
    variance: F64 = np.maximum(answers[row + apart] - answers[row] ** 2, 0.0)
    return np.sqrt(variance)


def slip_ratio(slip: F64, sd: F64, wheel_mps: F64) -> tuple[F64, F64]:
    """Slip over the larger of wheel and ground speed, and its standard deviation; NaN near standstill."""
    faster = np.maximum(np.abs(wheel_mps), np.abs(wheel_mps - slip))
    faster = np.where(faster < STANDSTILL_MPS, np.nan, faster)
    return slip / faster, sd / faster

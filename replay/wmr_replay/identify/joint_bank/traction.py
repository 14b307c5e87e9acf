"""What torques say of slip: the wheels' acceleration less the traction is the slip's.

Over a step of dt, with κ the wheels' scale, Δu the change of their measured speed and e its errors:

    κ (1 + g) Δu − κ (e_new − e_old) − Δs − dt ((1 + g) α F + d + coupling) = 0
    Δs = −(1 − left) s + w

w is the new slip: nearly nothing in grip, so that the line tells α; in slipping it is wide, so that the line
tells the slip. The two unknowns of the step, w and e_new, enter with their variances and take their share
of the correction, before the slip moves on and e_new takes the place of e_old.
"""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS
from wmr_replay.identify.wheel_bank.states import LN_SCALE
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

OUTLIER_SD = PRIORS.outlier_sd
LOG_BURST, LOG_QUIET = math.log(JOINT_PRIORS.burst_share), math.log(1.0 - JOINT_PRIORS.burst_share)


class Axis(NamedTuple):
    """The places of one axis's states: slip, traction, resistance, disturbance, error of the wheels'
    speed.
    """

    slip: int
    gain: int
    drag: int
    disturbance: int
    error: int


class Step(NamedTuple):
    """One axis over one step: κ; Δu in m/s; the effort in N·m; the sign of the wheels; g; the coupling
    v_lat ω in m/s², 0 in yaw; what is left of a slip, the variance of a new one, and that of
    one that grows or dies out; the variances of the wheels' speed and of the line itself in (m/s)²; dt in s.
    """

    scale: float
    change: float
    effort: float
    resists: float
    spinning: float
    coupling: float
    left: float
    fresh: float
    burst: float
    error: float
    line: float
    dt: float


@lean
def log_normal(value: float, variance: float) -> float:
    """The log of a normal density of mean 0, but for a constant."""
    return -0.5 * (value * value / variance + math.log(variance))


@lean
def follow_traction(mean: F64, covariance: F64, at: Axis, by: Step, work: F64) -> float:
    """The slip of one axis after a step, by the line above; the log likelihood. ``work`` (2, s) is scratch.

    The slope by ln κ takes the change that the traction gives, and not the measured one: the errors of that
    would show as a smaller scale.
    """
    n = mean.shape[0]
    slope, column = work[0], work[1]
    change = by.scale * (1.0 + by.spinning) * by.change
    effort = (1.0 + by.spinning) * by.effort
    for i in range(n):
        slope[i] = 0.0
    slope[at.slip], slope[at.error] = 1.0 - by.left, by.scale
    slope[at.gain], slope[at.drag], slope[at.disturbance] = -by.dt * effort, by.dt * by.resists, -by.dt
    pull = effort * mean[at.gain] - by.resists * mean[at.drag] + mean[at.disturbance] + by.coupling
    slope[LN_SCALE] = by.dt * pull - (1.0 - by.left) * mean[at.slip]
    off = change + by.scale * mean[at.error] - slope[LN_SCALE]
    variance = by.scale * by.scale * by.error + by.line
    for i in range(n):
        column[i] = 0.0
        for j in (at.slip, LN_SCALE, at.error, at.gain, at.drag, at.disturbance):
            column[i] += covariance[i, j] * slope[j]
    for j in (at.slip, LN_SCALE, at.error, at.gain, at.drag, at.disturbance):
        variance += slope[j] * column[j]
    quiet, fresh = variance + by.fresh, by.fresh
    likely = log_normal(off, max(quiet, (off / OUTLIER_SD) ** 2))
    if by.burst > 0.0:
        calm, jerky = LOG_QUIET + log_normal(off, quiet), LOG_BURST + log_normal(off, variance + by.burst)
        likely = np.logaddexp(calm, jerky)
        fresh = by.burst if jerky > calm else fresh
    variance = max(variance + fresh, (off / OUTLIER_SD) ** 2)
    for i in range(n):
        share = column[i] / variance
        mean[i] -= share * off
        for j in range(i, n):
            covariance[i, j] -= share * column[j]
            covariance[j, i] = covariance[i, j]
    take_slip(mean, covariance, at.slip, (by.left, fresh), (column, off, variance))
    take_error(mean, covariance, at, by, fresh, (column, off, variance))
    return float(likely)


@lean
def take_slip(
    mean: F64, covariance: F64, slip: int, moves: tuple[float, float], found: tuple[F64, float, float]
) -> None:
    """The slip after the step: what is left of the old one, and the new one that the line has told."""
    left, fresh = moves
    column, off, variance = found
    mean[slip] = left * mean[slip] + fresh * off / variance
    for j in range(mean.shape[0]):
        if j != slip:
            covariance[slip, j] = left * covariance[slip, j] + fresh * column[j] / variance
            covariance[j, slip] = covariance[slip, j]
    old = left * (left * covariance[slip, slip] + 2.0 * fresh * column[slip] / variance)
    covariance[slip, slip] = old + fresh - fresh * fresh / variance


@lean
def take_error(
    mean: F64, covariance: F64, at: Axis, by: Step, fresh: float, found: tuple[F64, float, float]
) -> None:
    """The error of this bin's speeds in the place of the last bin's."""
    column, off, variance = found
    spread = by.scale * by.error / variance
    for j in range(mean.shape[0]):
        covariance[at.error, j] = covariance[j, at.error] = spread * column[j]
    with_slip = by.left * spread * column[at.slip] - spread * fresh
    covariance[at.error, at.slip] = covariance[at.slip, at.error] = with_slip
    mean[at.error] = spread * off
    covariance[at.error, at.error] = by.error - by.scale * by.error * spread

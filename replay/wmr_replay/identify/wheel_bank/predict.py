"""Prediction of a hypothesis by wheel speeds: kinematics, and slip velocities that die out."""

import math

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import (
    DELAY,
    DIFFERENCE,
    ICR,
    LATERAL,
    LN_SCALE,
    LN_TRACK,
    PSI,
    S_DIFF,
    S_LAT,
    S_SUM,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
    X,
    Y,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

CALM_TIME_S, ACTIVE_TIME_S = WHEEL_PRIORS.calm_time_s, WHEEL_PRIORS.active_time_s
SLIP_VARIANCE, SKID_VARIANCE = WHEEL_PRIORS.slip_sd_mps**2, WHEEL_PRIORS.skid_sd_mps**2
UNKNOWN_VARIANCE, PATH_VARIANCE = WHEEL_PRIORS.unknown_sd_mps**2, WHEEL_PRIORS.path_m**2
LONGEST_HOLE_S = PRIORS.longest_hole_s


@lean
def body_motion(mean: F64, wheels: F64) -> tuple[float, float, float]:
    """v, v_lat and ω of a hypothesis from ``wheels`` (4,): mean and half difference of the wheels' speeds in
    m/s, and their rates in m/s².
    """
    scale, difference, delay = math.exp(mean[LN_SCALE]), mean[DIFFERENCE], mean[DELAY]
    ahead, around = wheels[0] + delay * wheels[2], wheels[1] + delay * wheels[3]
    v = scale * (ahead + difference * around) - mean[S_SUM]
    omega = (scale * (around + difference * ahead) - mean[S_DIFF]) * math.exp(-mean[LN_TRACK])
    return v, mean[S_LAT] - (mean[ICR] + mean[LATERAL] * v) * omega, omega


@lean
def slopes(mean: F64, wheels: F64, v: float, omega: float, rows: F64) -> None:
    """Derivatives of v, v_lat and ω by the states, (3, s). Wheels that stand, or whose speeds are unknown
    and count as 0, tell nothing of the track.
    """
    scale, difference, delay = math.exp(mean[LN_SCALE]), mean[DIFFERENCE], mean[DELAY]
    per_track = math.exp(-mean[LN_TRACK])
    ahead, around = wheels[0] + delay * wheels[2], wheels[1] + delay * wheels[3]
    n_states = mean.shape[0]
    for i in range(3):
        for j in range(n_states):
            rows[i, j] = 0.0
    rows[0, S_SUM], rows[0, LN_SCALE] = -1.0, v + mean[S_SUM]
    rows[0, DIFFERENCE] = scale * around
    rows[0, DELAY] = scale * (wheels[2] + difference * wheels[3])
    turning = wheels[0] != 0.0 or wheels[1] != 0.0
    rows[2, S_DIFF], rows[2, LN_TRACK] = -per_track, -omega if turning else 0.0
    rows[2, LN_SCALE] = omega + mean[S_DIFF] * per_track
    rows[2, DIFFERENCE] = scale * ahead * per_track
    rows[2, DELAY] = scale * (wheels[3] + difference * wheels[2]) * per_track
    arm, lateral = mean[ICR] + mean[LATERAL] * v, mean[LATERAL] * omega
    for j in range(n_states):
        rows[1, j] = -arm * rows[2, j] - lateral * rows[0, j]
    rows[1, S_LAT] = 1.0
    rows[1, ICR], rows[1, LATERAL] = -omega, -v * omega


@lean
def predict_pose(mean: F64, covariance: F64, wheels: F64, dt: float, work: F64) -> None:
    """The pose after ``dt`` of the motion at its beginning, at the heading of the middle. ``work`` (9, s) is
    scratch.
    """
    v, v_lat, omega = body_motion(mean, wheels)
    by, step, moved = work[:3], work[3:6], work[6:9]
    n_states = mean.shape[0]
    slopes(mean, wheels, v, omega, by)
    heading = mean[PSI] + 0.5 * omega * dt
    cos, sin = math.cos(heading), math.sin(heading)
    along_x, along_y = v * cos - v_lat * sin, v * sin + v_lat * cos
    for j in range(n_states):
        turned = 0.5 * dt * by[2, j] + (1.0 if j == PSI else 0.0)
        step[X, j] = dt * (cos * by[0, j] - sin * by[1, j] - along_y * turned)
        step[Y, j] = dt * (sin * by[0, j] + cos * by[1, j] + along_x * turned)
        step[PSI, j] = dt * by[2, j]
    mean[X] += dt * along_x
    mean[Y] += dt * along_y
    mean[PSI] += dt * omega
    for i in range(3):
        for j in range(n_states):
            total = covariance[i, j]
            for k in range(PSI, n_states):
                total += step[i, k] * covariance[k, j]
            moved[i, j] = total
    for i in range(3):
        for j in range(i, 3):
            total = moved[i, j]
            for k in range(PSI, n_states):
                total += moved[i, k] * step[j, k]
            covariance[i, j] = covariance[j, i] = total
        for j in range(3, n_states):
            covariance[i, j] = covariance[j, i] = moved[i, j]


@lean
def fade(mean: F64, covariance: F64, state: int, variance: float, time_s: float, dt: float) -> None:
    """An Ornstein–Uhlenbeck state after ``dt``: the old value fades, its stationary ``variance`` stays."""
    left = math.exp(-dt / time_s)
    mean[state] *= left
    for j in range(mean.shape[0]):
        covariance[state, j] *= left
        covariance[j, state] *= left
    covariance[state, state] += variance * (1.0 - left * left)


@lean
def fade_slips(mean: F64, covariance: F64, mode: int, calm: float, known: bool, dt: float) -> None:
    """The slip velocities after ``dt`` in a mode, with the variance ``calm`` where the mode has none."""
    slips = mode in (SLIPPING, SKIDDING_SLIPPING)
    skids = mode in (SKIDDING, SKIDDING_SLIPPING)
    wide = SLIP_VARIANCE if known else UNKNOWN_VARIANCE
    fade(
        mean,
        covariance,
        S_SUM,
        wide if slips or not known else calm,
        ACTIVE_TIME_S if slips else CALM_TIME_S,
        dt,
    )
    fade(
        mean,
        covariance,
        S_DIFF,
        wide if slips or not known else calm,
        ACTIVE_TIME_S if slips else CALM_TIME_S,
        dt,
    )
    fade(
        mean,
        covariance,
        S_LAT,
        SKID_VARIANCE if skids or not known else calm,
        ACTIVE_TIME_S if skids else CALM_TIME_S,
        dt,
    )


@lean
def spread_pose(mean: F64, covariance: F64) -> None:
    """What the kinematics leave out of a wheel's path: along the heading, and in the heading."""
    cos, sin = math.cos(mean[PSI]), math.sin(mean[PSI])
    covariance[X, X] += PATH_VARIANCE * cos * cos
    covariance[Y, Y] += PATH_VARIANCE * sin * sin
    covariance[X, Y] += PATH_VARIANCE * cos * sin
    covariance[Y, X] = covariance[X, Y]
    covariance[PSI, PSI] += PATH_VARIANCE * math.exp(-2.0 * mean[LN_TRACK])

"""The stage: rows in, verdicts out."""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_replay.identify.algebraic.beliefs import Beliefs, believe
from wmr_replay.identify.algebraic.bins import (
    COUNT,
    Bins,
    add,
    foreseen,
    means,
    no_bins,
    opens_after,
    outlying,
    reopen,
)
from wmr_replay.identify.algebraic.filter import JUMP, N_SAID, WARM, Filter, new_filter, take_up
from wmr_replay.identify.algebraic.regression import LOG_DECAY, V_LONG, YAW_RATE
from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.verdict import (
    ALL_MODES,
    IDEAL,
    NO_TORQUE,
    NOT_EXCITED,
    NOT_TURNING,
    OK,
    POSE_NOT_INDEPENDENT,
    SKIDDING,
    SLIPPING,
    WARMING_UP,
    Evidence,
    Verdict,
    no_posterior,
)
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.robot import RobotParameters

POSE_JUMP, OUTLIER = 7, 8
NOT_EXCLUDED_P = 0.05
"""A mode stands in ``mode_set`` from this probability on."""


class Limits(NamedTuple):
    """What the bands of C_k and C_d and a named mode ask for."""

    threshold_sd: float
    min_c_k_mps: float
    min_c_d_mps2: float
    min_confidence: float


@njit(cache=True)
def judge(p: F64, min_confidence: float) -> tuple[int, int]:
    """The mode, −1 where none reaches the confidence asked for, and the set of those not excluded."""
    likeliest, left = 0, 0
    for mode in range(3):
        if p[mode] > p[likeliest]:
            likeliest = mode
        if p[mode] >= NOT_EXCLUDED_P:
            left |= 1 << mode
    return (likeliest if p[likeliest] >= min_confidence else -1), left


@njit(cache=True)
def reason(left: int, pushed: float, lateral: float, threshold_d: float, threshold_k: float) -> int:
    """Why more than one mode is left: the push αF, or the v_lat that a skid would bring, is below its
    threshold.
    """
    if left & IDEAL and left & SLIPPING:
        if np.isnan(pushed):
            return NO_TORQUE
        if abs(pushed) < threshold_d:
            return NOT_EXCITED
    if left & IDEAL and left & SKIDDING and abs(lateral) < threshold_k:
        return NOT_TURNING
    return OK


@njit(cache=True)
def band(threshold_sd: float, sd: float, least: float) -> float:
    """A threshold in standard deviations that does not fall below ``least``; NaN with the sd."""
    return sd if np.isnan(sd) else max(threshold_sd * sd, least)


@njit(cache=True)
def close(bins: Bins, state: Filter, next_ns: int, beliefs: Beliefs) -> None:
    """The open bin is complete; ``next_ns`` lies in the one to open."""
    if bins.sums[COUNT] > 0.0:
        take_up(state, means(bins), beliefs)
    reopen(bins, next_ns)


@njit(cache=True)
def follow(t_ns: I64, rows: F64, bins: Bins, state: Filter, beliefs: Beliefs) -> tuple[F64, Bool]:
    """``rows`` (n, 7) as in ``add``, through the bins and the filter, which are carried on in place.

    Returns what is said at each row, (n, 8): probabilities, jump, warm, as in :class:`Filter`, α, its
    variance and ℓ; and which rows were no outliers, (n,).
    """
    n = t_ns.shape[0]
    out, inlying = np.empty((n, N_SAID + 3)), np.empty(n, np.bool_)
    mean, gains, said = state.mean, state.gains, state.said
    for i in range(n):
        if opens_after(bins, t_ns[i]):
            close(bins, state, t_ns[i], beliefs)
        inlying[i] = not outlying(bins, t_ns[i], rows[i], mean[V_LONG], mean[YAW_RATE])
        if inlying[i]:
            add(bins, t_ns[i], rows[i])
        next_ns = foreseen(bins, t_ns[i])
        if opens_after(bins, next_ns):
            close(bins, state, next_ns, beliefs)
        for c in range(N_SAID):
            out[i, c] = said[c]
        out[i, N_SAID], out[i, N_SAID + 1], out[i, N_SAID + 2] = gains[0, 0], gains[1, 0], mean[LOG_DECAY]
    return out, inlying


@njit(cache=True)
def tabulate(said: F64, inlying: Bool, evidence: F64, limits: Limits) -> tuple[F64, I64]:
    """What stands in the tables, from :func:`follow` and the differentiator.

    ``evidence`` (7, n): v_long, ω, dv/dt, the sd of v_lat and of dv/dt, F through the same window, and
    independence. Returns C_d, the thresholds of C_k and C_d, the three probabilities, α and its sd, (8, n),
    and mode, mode set, outcome, (3, n).
    """
    n = said.shape[0]
    values, verdicts = np.full((8, n), np.nan), np.empty((3, n), np.int64)
    for i in range(n):
        alpha, force = said[i, N_SAID], evidence[5, i]
        threshold_k = band(limits.threshold_sd, evidence[3, i], limits.min_c_k_mps)
        threshold_d = band(limits.threshold_sd, evidence[4, i], limits.min_c_d_mps2)
        values[0, i], values[1, i], values[2, i] = evidence[2, i] - alpha * force, threshold_k, threshold_d
        mode, left, outcome = -1, ALL_MODES, WARMING_UP
        if said[i, WARM] > 0.0:
            values[6, i], values[7, i] = alpha, np.sqrt(said[i, N_SAID + 1])
            values[3, i] = values[4, i] = values[5, i] = 1.0 / 3.0
            outcome = POSE_NOT_INDEPENDENT
            if evidence[6, i] != NOT_INDEPENDENT:
                values[3, i], values[4, i], values[5, i] = said[i, 0], said[i, 1], said[i, 2]
                mode, left = judge(said[i], limits.min_confidence)
                lateral = evidence[0, i] * evidence[1, i] * np.exp(-said[i, N_SAID + 2])
                outcome = reason(left, alpha * force, lateral, threshold_d, threshold_k)
                if said[i, JUMP] > 0.0 or not inlying[i]:
                    outcome = POSE_JUMP if inlying[i] else OUTLIER
        verdicts[0, i], verdicts[1, i], verdicts[2, i] = mode, left, outcome
    return values, verdicts


class AlgebraicIdentifier:
    """Stage: poses, torques and the differentiator's estimates in, verdicts out."""

    def __init__(self, robot: RobotParameters, limits: Limits, beliefs: Beliefs | None = None) -> None:
        self.limits = limits
        self.beliefs = believe(robot) if beliefs is None else beliefs
        self._bins, self._filter = no_bins(), new_filter(self.beliefs)

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time. Both skidding and slipping at once is not looked for."""
        motion, inputs = evidence.motion, (evidence.pose, evidence.efforts, evidence.variances)
        rows = np.ascontiguousarray(np.concatenate(inputs).T)
        said, inlying = follow(evidence.t_ns, rows, self._bins, self._filter, self.beliefs)
        estimates = (
            motion.v_long_mps,
            motion.yaw_rate_radps,
            motion.a_long_mps2,
            motion.v_lat_mps_sd,
            motion.a_long_mps2_sd,
            evidence.force,
            evidence.independence,
        )
        values, verdicts = tabulate(said, inlying, np.stack(estimates), self.limits)
        posterior = no_posterior(len(evidence.t_ns))
        posterior[:3] = values[3:6]
        mode, mode_set, outcome = verdicts
        return Verdict(
            values[0],
            values[1],
            values[2],
            posterior,
            values[6],
            values[7],
            mode.astype(np.int8),
            mode_set.astype(np.uint8),
            outcome.astype(np.int8),
        )

"""The paper's scheme: thresholds on C_k and C_d, α by (14) and (15) as one weighted regression.

Yu, Barbot, Floquet (2009), §3.4 and §4, in robot conventions: C_k = −v_lat (11); C_d = dv_long/dt − α(u_left
+ u_right) (13); skidding where |C_k| exceeds its threshold, else slipping where |C_d| does, else ideal.
Departures from the paper: the thresholds follow from the noise (a multiple of the estimates' standard
deviations); where the manoeuvre cannot show a mode, that mode is not excluded and no guess is made; α comes
from a regression over time, so nothing is divided by a torque near 0.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.motion import Motion
from wmr_replay.identify.verdict import (
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
from wmr_schemas.arrays import F64, I8, I64
from wmr_schemas.robot import RobotParameters

UNKNOWN_SKID_TIME_S = 0.1
"""Lateral time constant that is presumed, where the stiffness is unknown, to ask whether a skid would show.
"""
ALPHA_KNOWN_WITHIN = 0.1


class Rules(NamedTuple):
    """Constants of the scheme. NaN: unknown."""

    threshold_sd: float
    min_c_k_mps: float
    min_c_d_mps2: float
    alpha: float
    skid_time_per_speed: float
    half_track_m: float
    average_speed_mps: float
    window_ns: int
    min_sideslip: float


def make_rules(
    robot: RobotParameters,
    *,
    window_ns: int,
    threshold_sd: float,
    min_c_k_mps: float,
    min_c_d_mps2: float,
    min_sideslip: float = 0.0,
) -> Rules:
    """Rules for a robot. Where mass and cornering stiffness are known a skid settles with ε m v/(2 G_x)."""
    known = robot.mass_kg is not None and robot.cornering_stiffness_over_epsilon is not None
    per_speed = (
        (robot.mass_kg or 0.0) / (2 * (robot.cornering_stiffness_over_epsilon or 1.0)) if known else np.nan
    )
    speed = robot.average_speed_mps
    return Rules(
        threshold_sd=threshold_sd,
        min_c_k_mps=min_c_k_mps,
        min_c_d_mps2=min_c_d_mps2,
        alpha=np.nan if robot.alpha is None else robot.alpha,
        skid_time_per_speed=per_speed,
        half_track_m=0.0 if robot.half_track_m is None else robot.half_track_m,
        average_speed_mps=speed if isinstance(speed, float) else np.nan,
        window_ns=window_ns,
        min_sideslip=min_sideslip,
    )


@njit(cache=True)
def skid_would_show(v_long: float, v_lat: float, yaw_rate: float, threshold: float, rules: Rules) -> bool:
    """Whether skidding would drive |v_lat| past the threshold: |v_long ω| · (lateral time constant) against
    it.
    """
    speed = rules.average_speed_mps
    if np.isnan(speed):
        speed = max(np.sqrt(v_long**2 + v_lat**2 + (rules.half_track_m * yaw_rate) ** 2), 0.3)
    settle_s = (
        UNKNOWN_SKID_TIME_S if np.isnan(rules.skid_time_per_speed) else rules.skid_time_per_speed * speed
    )
    return abs(v_long * yaw_rate) * settle_s >= threshold


@njit(cache=True)
def not_excluded(skids: bool, slips: bool, excited: bool, turning: bool) -> int:
    """The set of modes that the two constraints leave over."""
    if skids:
        return SKIDDING
    if slips:
        return SLIPPING
    return IDEAL | (0 if excited else SLIPPING) | (0 if turning else SKIDDING)


class AlphaState(NamedTuple):
    """Running regression of α: sums (2,) Σ w F² and Σ w F y; pending row (3,) F, y, w; stamps (3,) of the
    pending row, the last row taken up, the last slip.
    """

    sums: F64
    pending: F64
    stamps_ns: I64


def fresh_alpha() -> AlphaState:
    """Nothing seen yet."""
    long_ago = np.int64(-(2**61))
    return AlphaState(np.zeros(2), np.zeros(3), np.array([long_ago, long_ago, long_ago]))


@njit(cache=True)
def regress_alpha(
    state: AlphaState, t_ns: int, window_ns: int, force: float, response: float, variance: float, slips: bool
) -> None:
    """One step of α = Σ w F y / Σ w F², w = 1/var y, over rows a window apart, whose noise is independent.

    y = dv_long/dt − v_lat ω/3 = α F in ideal rolling and in skidding, (14) and (15). A row counts once a
    window has passed after it, and one before it, without a sign of slip: it then holds no slip itself.
    """
    stamps = state.stamps_ns
    if slips:
        stamps[2] = t_ns
        state.pending[2] = 0.0
    if state.pending[2] > 0.0 and t_ns - stamps[0] >= window_ns:
        pending_force, pending_response, weight = state.pending
        state.sums[0] += weight * pending_force**2
        state.sums[1] += weight * pending_force * pending_response
        state.pending[2] = 0.0
    if state.pending[2] == 0.0 and t_ns - max(stamps[1], stamps[2]) >= window_ns and variance > 0.0:
        state.pending[:] = force, response, 1.0 / variance
        stamps[0] = stamps[1] = t_ns


@njit(cache=True)
def judge_rows(
    t_ns: I64, motion: Motion, force: F64, known: F64, independence: F64, rules: Rules, alpha: AlphaState
) -> tuple[F64, I8]:
    """The scheme row by row: ``force`` = Σeffort through the same window as the ``motion``, (n,).

    Returns C_d, its threshold, that of C_k, α and its sd, (5, n); and mode, mode set and outcome, (3, n).
    ``alpha`` is carried on in place.
    """
    n = t_ns.shape[0]
    values, verdicts = np.full((5, n), np.nan), np.empty((3, n), np.int8)
    for i in range(n):
        v_long, v_lat = motion.v_long_mps[i], motion.v_lat_mps[i]
        yaw_rate, a_long = motion.yaw_rate_radps[i], motion.a_long_mps2[i]
        a_long_sd = motion.a_long_mps2_sd[i]
        if np.isnan(v_long):
            verdicts[:, i] = -1, IDEAL | SKIDDING | SLIPPING, WARMING_UP
            continue
        fitted = alpha.sums[1] / alpha.sums[0] if alpha.sums[0] > 0.0 else np.nan
        fitted_sd = 1.0 / np.sqrt(alpha.sums[0]) if alpha.sums[0] > 0.0 else np.nan
        used = rules.alpha
        if np.isnan(used) and fitted_sd <= ALPHA_KNOWN_WITHIN * fitted:
            used = fitted
        threshold_k = max(
            rules.threshold_sd * motion.v_lat_mps_sd[i], rules.min_c_k_mps, rules.min_sideslip * abs(v_long)
        )
        threshold_d = max(rules.threshold_sd * a_long_sd, rules.min_c_d_mps2)
        c_d = a_long - known[i] - used * force[i]
        skids, slips = abs(v_lat) > threshold_k, abs(c_d) > threshold_d
        excited = abs(used * force[i]) >= threshold_d
        turning = skid_would_show(v_long, v_lat, yaw_rate, threshold_k, rules)
        left = not_excluded(skids, slips, excited, turning)
        if not np.isnan(force[i]) and independence[i] != NOT_INDEPENDENT:
            variance = max(a_long_sd, rules.min_c_d_mps2 / rules.threshold_sd) ** 2
            response = a_long - known[i] - v_lat * yaw_rate / 3.0
            regress_alpha(alpha, t_ns[i], rules.window_ns, force[i], response, variance, slips and not skids)
        outcome = OK
        if independence[i] == NOT_INDEPENDENT:
            left, outcome = IDEAL | SKIDDING | SLIPPING, POSE_NOT_INDEPENDENT
        elif left & (left - 1):
            outcome = (
                NOT_TURNING if not left & SLIPPING else (NO_TORQUE if np.isnan(force[i]) else NOT_EXCITED)
            )
        mode = -1 if left & (left - 1) else (0 if left == IDEAL else (1 if left == SKIDDING else 2))
        values[:, i] = c_d, threshold_k, threshold_d, fitted, fitted_sd
        verdicts[:, i] = mode, left, outcome
    return values, verdicts


class PaperIdentifier:
    """Stage: motion and filtered torques in, verdicts out."""

    def __init__(self, rules: Rules) -> None:
        self.rules = rules
        self._alpha = fresh_alpha()

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time; see :func:`judge_rows`."""
        values, verdicts = judge_rows(
            evidence.t_ns,
            evidence.motion,
            evidence.force,
            evidence.known_acceleration,
            evidence.independence,
            self.rules,
            self._alpha,
        )
        c_d, threshold_k, threshold_d, alpha, alpha_sd = values
        mode, mode_set, outcome = verdicts
        return Verdict(
            c_d,
            threshold_k,
            threshold_d,
            no_posterior(len(evidence.t_ns)),
            alpha,
            alpha_sd,
            mode,
            mode_set.view(np.uint8),
            outcome,
        )

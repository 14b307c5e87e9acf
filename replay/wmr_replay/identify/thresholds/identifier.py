"""The paper's scheme: thresholds on C_k and C_d, α by (14) and (15) as one weighted regression.

Yu, Barbot, Floquet (2009), §3.4 and §4, in robot conventions: C_k = −v_lat (11); C_d = dv_long/dt − α(u_left
+ u_right) (13); skidding where |C_k| exceeds its threshold, else slipping where |C_d| does, else ideal.
Departures from the paper: the thresholds follow from the noise (a multiple of the estimates' standard
deviations); where the manoeuvre cannot show a mode, that mode is not excluded and no guess is made; α comes
from a regression over time, so nothing is divided by a torque near 0.
"""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict, no_posterior
from wmr_replay.identify.motion import Motion
from wmr_replay.identify.thresholds.alpha import AlphaState, fit_of, fresh_alpha, regress_alpha
from wmr_schemas.arrays import F64, I8, I64
from wmr_schemas.compiled.lean import lean
from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import Status

THIRD = 1 / 3
SEEN = ("v_long_mps", "v_lat_mps", "v_lat_mps_sd", "yaw_rate_radps", "a_long_mps2", "a_long_mps2_sd")
"""The columns of a motion that the scheme reads."""
SET_IDEAL, SET_SKIDDING, SET_SLIPPING = int(ModeSet.IDEAL), int(ModeSet.SKIDDING), int(ModeSet.SLIPPING)
NONE_EXCLUDED = int(ModeSet.ALL_SINGLE)
"""Mode sets as the integers that compiled code takes."""


class Rules(NamedTuple):
    """Constants of the scheme, from settings and robot; NaN where unknown."""

    threshold_sd: float
    min_c_k_mps: float
    min_c_d_mps2: float
    alpha: float
    skid_time_per_speed: float
    half_track_m: float
    average_speed_mps: float
    window_ns: int
    min_sideslip: float
    unknown_skid_time_s: float = 0.1
    """Lateral time constant where the stiffness is unknown, to decide whether a skid would show. The paper's
    robot has v/8 s with v in m/s: this is its value at .8 m/s.
    """
    alpha_known_within: float = 0.1
    """Without a nominal α, C_d uses the regression's once its relative sd is below this: an error of 10 % of
    the torque's share, which the usual threshold of 3 sd covers in moderate driving.
    """
    min_average_speed_mps: float = 0.3
    """Floor of the average speed in assumption 4 of the paper, where the robot stands almost still."""


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


@lean
def skid_would_show(v_long: float, v_lat: float, yaw_rate: float, threshold: float, rules: Rules) -> bool:
    """Whether skidding would drive |v_lat| past the threshold: |v_long ω| · (lateral time constant) against
    it.
    """
    speed = rules.average_speed_mps
    if math.isnan(speed):
        speed = math.sqrt(v_long**2 + v_lat**2 + (rules.half_track_m * yaw_rate) ** 2)
        speed = max(speed, rules.min_average_speed_mps)
    known = not math.isnan(rules.skid_time_per_speed)
    settle_s = rules.skid_time_per_speed * speed if known else rules.unknown_skid_time_s
    return abs(v_long * yaw_rate) * settle_s >= threshold


@lean
def not_excluded(skids: bool, slips: bool, excited: bool, turning: bool) -> int:
    """The set of modes that the two constraints leave over."""
    if skids:
        return SET_SKIDDING
    if slips:
        return SET_SLIPPING
    return SET_IDEAL | (0 if excited else SET_SLIPPING) | (0 if turning else SET_SKIDDING)


@lean
def mode_of(left: int) -> int:
    """The mode that is left alone, else −1."""
    if left & (left - 1):
        return ContactMode.UNDECIDED
    if left == SET_IDEAL:
        return ContactMode.IDEAL
    return ContactMode.SKIDDING if left == SET_SKIDDING else ContactMode.SLIPPING


@lean
def outcome_of(left: int, independent: bool, no_torque: bool) -> int:
    """Why more than one mode is left; OK where one is."""
    if not independent:
        return Status.POSE_NOT_INDEPENDENT
    if not left & (left - 1):
        return Status.OK
    if not left & SET_SLIPPING:
        return Status.NOT_TURNING
    return Status.NO_TORQUE if no_torque else Status.NOT_EXCITED


def threshold_rows(
    t_ns: I64, motion: Motion, force: F64, known: F64, independence: F64, rules: Rules, alpha: AlphaState
) -> tuple[F64, I8]:
    """The scheme row by row: ``force`` = Σeffort through the same window as the ``motion``, (n,).

    Returns C_d, its threshold, that of C_k, α and its sd, (5, n); and mode, mode set and outcome, (3, n).
    ``alpha`` is carried on in place.
    """
    n = len(t_ns)
    values, verdicts = np.empty((5, n)), np.empty((3, n), np.int8)
    seen = np.stack([getattr(motion, name) for name in SEEN] + [force, known, independence])
    fill_rows(t_ns, seen, rules, alpha, values, verdicts)
    return values, verdicts


@lean
def fill_rows(t_ns: I64, seen: F64, rules: Rules, alpha: AlphaState, values: F64, verdicts: I8) -> None:
    """Fill the answer of :func:`threshold_rows`.

    ``seen`` (9, n) are the columns ``SEEN`` of the motion, the force, the known acceleration and the
    independence.
    """
    fitted, fitted_sd = fit_of(alpha)
    due_ns = alpha.stamps_ns[0]
    for i in range(len(t_ns)):
        v_long, v_lat, v_lat_sd, yaw_rate = seen[0, i], seen[1, i], seen[2, i], seen[3, i]
        a_long, a_long_sd, force, known = seen[4, i], seen[5, i], seen[6, i], seen[7, i]
        if math.isnan(v_long):
            for k in range(len(values)):
                values[k, i] = math.nan
            verdicts[0, i], verdicts[1, i], verdicts[2, i] = (
                ContactMode.UNDECIDED,
                NONE_EXCLUDED,
                Status.WARMING_UP,
            )
            continue
        used = rules.alpha
        if math.isnan(used) and fitted_sd <= rules.alpha_known_within * fitted:
            used = fitted
        threshold_k = max(rules.threshold_sd * v_lat_sd, rules.min_c_k_mps, rules.min_sideslip * abs(v_long))
        threshold_d = max(rules.threshold_sd * a_long_sd, rules.min_c_d_mps2)
        push = used * force
        c_d = a_long - known - push
        skids, slips, independent = (
            abs(v_lat) > threshold_k,
            abs(c_d) > threshold_d,
            seen[8, i] != NOT_INDEPENDENT,
        )
        left, counts = NONE_EXCLUDED, False
        if independent:
            turning = skids or slips or skid_would_show(v_long, v_lat, yaw_rate, threshold_k, rules)
            left = not_excluded(skids, slips, abs(push) >= threshold_d, turning)
        if independent and not math.isnan(force):
            sd = max(a_long_sd, rules.min_c_d_mps2 / rules.threshold_sd)
            response = a_long - known - v_lat * yaw_rate * THIRD
            counts = (slips and not skids) or t_ns[i] >= due_ns
            if counts:
                due_ns = regress_alpha(
                    alpha, t_ns[i], rules.window_ns, (force, response, sd * sd), slips and not skids
                )
        values[0, i], values[1, i], values[2, i] = c_d, threshold_k, threshold_d
        values[3, i], values[4, i] = fitted, fitted_sd
        fitted, fitted_sd = fit_of(alpha) if counts else (fitted, fitted_sd)
        verdicts[0, i], verdicts[1, i] = mode_of(left), left
        verdicts[2, i] = outcome_of(left, independent, math.isnan(force))


class PaperIdentifier:
    """Stage: motion and filtered torques in, verdicts out."""

    def __init__(self, rules: Rules) -> None:
        self.rules = rules
        self._alpha = fresh_alpha()

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time; see :func:`threshold_rows`."""
        values, verdicts = threshold_rows(
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

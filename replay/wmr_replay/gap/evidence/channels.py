"""Whether an effect on the torques is seen ahead and in turning alike.

An actuator that acts late does so in the sum of the torques and in their difference. A swivel caster that
trails holds back a turn alone: its fork follows the motion over some .1 m, and to the turning robot that is a
lag. So the two channels are asked apart. With b the size that one of them asks for, in units of the fitted
one, and s its standard deviation, the fitted size lowers the deviance of that channel by about

    (2b − 1)/s²

An effect that is there, b ≈ 1 ± s, makes a channel less likely by more than g in at most the share
Φ(−√(g)) of cases, whatever s is: where b < (1 − g s²)/2, the standard deviations from 1 are (1/s + g s)/2 ≥
√g. One that is not there, b ≈ 0 ± s, makes it more likely by more than g in as few.
"""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.answer import LATE
from wmr_replay.gap.model.dynamics import Row
from wmr_schemas.arrays import F64


def seen_in_one_channel(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a lag or a delay of the model ``fit`` is refuted by one of the channels, or, of a base model
    that hardly knows how its torques turn the robot, is not shown ahead.
    """
    if name not in LATE:
        return False
    least, in_doubt = problem.settings.channels.least_gain, problem.settings.misfit.doubted_share
    ahead, turning = gains_by_channel(problem, fit, name)
    least_ahead = least if fit.extension.misfit.get("yaw_inertia", 0.0) >= in_doubt else -least
    return ahead < least_ahead or turning < -least


def gains_by_channel(problem: Problem, fit: Fit, name: str) -> tuple[float, float]:
    """What an effect on the torques lowers the deviance by ahead and in turning, each beside the other, the
    sizes of all other effects fitted again (to first order).
    """
    rows = fit.extension.rows(problem.binned)
    rest = fit.extension.without(name).rows(problem.binned)
    train, limit = problem.train, problem.settings.significance.clip_sd
    others = fit.psi[train][:, :, [owner != name for owner, _ in fit.keys]]

    def left(torques: F64) -> float:
        e = problem.innovations_of_rows(fit.extension, torques, fit.noise)[train]
        return squares_beside(others, np.clip(e, -limit, limit))

    both = left(rows)
    return left(with_torques(rows, rest, rows)) - both, left(with_torques(rows, rows, rest)) - both


def squares_beside(psi: F64, e: F64) -> float:
    """The sum of squares of e (n, 3) that no combination of the sensitivities (n, 3, q) takes away."""
    flat, left = psi.reshape(e.size, psi.shape[2]), e.ravel()
    if flat.shape[1]:
        left = left - flat @ np.linalg.lstsq(flat, left, rcond=1e-8)[0]
    return float(left @ left)


def with_torques(rows: F64, ahead: F64, turning: F64) -> F64:
    """The input rows (n, 16) with the sum of the efforts of ``ahead`` and the difference of ``turning``."""
    both = ahead[:, Row.RIGHT] + ahead[:, Row.LEFT]
    apart = turning[:, Row.RIGHT] - turning[:, Row.LEFT]
    mixed = rows.copy()
    mixed[:, Row.LEFT], mixed[:, Row.RIGHT] = (both - apart) / 2, (both + apart) / 2
    return np.ascontiguousarray(mixed)

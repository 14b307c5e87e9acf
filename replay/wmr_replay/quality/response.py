"""What the robot does in answer to its torques: a regression over the whole log so far."""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.cells import CELL_S, Means
from wmr_replay.quality.plausibility_limits import LIMITS
from wmr_schemas.arrays import F64, Bool

N_TERMS = 5
"""Sum and difference of the efforts, speed and yaw rate (friction), constant (slope, bias)."""
RIDGE = 1e-9
"""Share of its own square that is added to each term, so that two that are proportional have a solution."""
TINY = 1e-12
"""Rounding: less of a variance, which is 1 in all, is none."""


class Answer(NamedTuple):
    """How one acceleration answers to one combination of the efforts, after each cell (m,).

    ``slope`` per N·m; ``share`` of the acceleration's variance that this combination explains beyond all
    other terms, the pose's noise left out; ``t``: the slope over its standard deviation, each second one
    independent observation.
    """

    slope: F64
    share: F64
    t: F64


class Response(NamedTuple):
    """Answers of dv_long/dt and d(yaw rate)/dt to sum and difference (right − left) of the efforts.

    ``n`` (m,) seconds were used.
    """

    n: F64
    ahead_by_sum: Answer
    ahead_by_difference: Answer
    turn_by_sum: Answer
    turn_by_difference: Answer


def is_certain(answer: Answer, n: F64, least_share: float) -> Bool:
    """Whether (m,) an answer is beyond chance, so much of what moves the robot, and seen for long enough."""
    beyond_chance = (np.abs(answer.t) >= LIMITS.least_t) & (answer.share >= least_share)
    return np.asarray(beyond_chance & (n >= LIMITS.least_torque_s))


class TorqueResponse:
    """Stage: means over cells → response."""

    def __init__(self) -> None:
        self._total = np.zeros((len(_ROWS) + 3, 1))

    def push(self, means: Means) -> Response:
        """The next cells (m,)."""
        totals = np.cumsum(np.concatenate([self._total, _products(means)], axis=1), axis=1)
        self._total = totals[:, -1:]
        return _response(totals[:, 1:])


_ROWS, _COLUMNS = np.triu_indices(N_TERMS + 2)
"""Pairs of terms and, behind them, the two accelerations."""


def _products(means: Means) -> F64:
    """Per cell: products of the pairs, the variances of both accelerations, 1; all 0 where one is unknown."""
    efforts = means.left_nm + means.right_nm, means.right_nm - means.left_nm
    terms = *efforts, means.v_mps, means.yaw_rate_radps, np.ones(len(means.t_s))
    signals = np.stack([*terms, means.a_mps2, means.yaw_acc_radps2])
    products = signals[_ROWS] * signals[_COLUMNS]
    compared = np.concatenate([products, [means.a_var, means.yaw_acc_var, np.ones(len(means.t_s))]])
    compared[:, ~np.isfinite(compared).all(axis=0)] = 0.0
    return compared


def _response(totals: F64) -> Response:
    """Partial regressions (m,) from running sums of products."""
    n = totals[-1] * CELL_S
    size = N_TERMS + 2
    full = np.zeros((len(n), size, size))
    full[:, _ROWS, _COLUMNS] = full[:, _COLUMNS, _ROWS] = totals[: len(_ROWS)].T
    # Correlations in place of products: the same answer whatever the units.
    scale = np.sqrt(np.diagonal(full, axis1=1, axis2=2))
    scale = np.where(scale > 0, scale, 1.0)
    full /= scale[:, :, None] * scale[:, None, :]
    return Response(n, *_answers(full, scale, totals[-3:-1], n))


def _answers(full: F64, scale: F64, variances: F64, n: F64) -> list[Answer]:
    """Of both accelerations, whose noise has the ``variances`` (2, m), to sum and difference of the efforts,
    from products (m, terms, terms) that are scaled.
    """
    rests = [_rest(full, term) for term in (0, 1)]
    return [
        _answer(rests[term], (scale[:, term], scale[:, N_TERMS + target]), target, variances[target], n)
        for target in (0, 1)
        for term in (0, 1)
    ]


def _rest(full: F64, term: int) -> F64:
    """Products (m, 3, 3) of a term and both accelerations, less what the other terms explain of each."""
    others, rest = [k for k in range(N_TERMS) if k != term], [term, N_TERMS, N_TERMS + 1]
    inner, outer, own = (
        full[:, np.array(rows)[:, None], columns]
        for rows, columns in ((others, others), (others, rest), (rest, rest))
    )
    answer = np.linalg.solve(inner + RIDGE * np.eye(len(others)), outer)
    return np.asarray(own - outer.transpose(0, 2, 1) @ answer)


def _answer(rest: F64, scales: tuple[F64, F64], target: int, variance: F64, n: F64) -> Answer:
    """One term's partial slope, share and t, from what the others leave; ``scales`` of term and target."""
    own, both, every = rest[:, 0, 0], rest[:, 0, 1 + target], rest[:, 1 + target, 1 + target]
    clear = (own > 10 * RIDGE) & (every > 0)
    slope = np.where(clear, both / np.where(clear, own, 1.0), np.nan)
    explained = np.where(clear, both * slope, 0.0)
    noise = variance / scales[1] ** 2
    share = explained / np.maximum(np.maximum(every - noise, explained), TINY)
    t = np.sign(slope) * np.sqrt(
        explained / np.maximum(every - explained, TINY) * np.maximum(n - N_TERMS, 0.0)
    )
    return Answer(slope * scales[1] / scales[0], share, np.nan_to_num(t))

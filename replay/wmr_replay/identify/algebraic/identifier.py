"""The stage: rows in, verdicts out."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.identify.algebraic.beliefs import Beliefs, believe
from wmr_replay.identify.algebraic.bins import (
    COUNT,
    NONE_NS,
    Bins,
    Measured,
    begin_at,
    fill,
    forget,
    means,
    no_bins,
    opens_after,
    reopen,
)
from wmr_replay.identify.algebraic.filter import JUMP, N_SAID, WARM, Filter, jumped, new_filter, take_up
from wmr_replay.identify.algebraic.regression import V_LONG, YAW_RATE
from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_replay.identify.posterior import Said, decide
from wmr_replay.identify.terms import Terms
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, Rules
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.compiled import compiled
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import Status

N_MODES = 3
ALPHA, ALPHA_VARIANCE, N_COLUMNS = N_SAID, N_SAID + 1, N_SAID + 2


@dataclass(frozen=True)
class AlgebraicSettings:
    """What a named mode asks for."""

    min_confidence: float = 0.5


@compiled
def close(bins: Bins, state: Filter, next_ns: int, beliefs: Beliefs, terms: Terms) -> None:
    """The open bin is complete; ``next_ns`` lies in the one to open."""
    if bins.sums[COUNT] > 0.0:
        take_up(state, means(bins), beliefs, terms)
    reopen(bins, next_ns)


@compiled
def note(state: Filter, place: int, out: F64) -> None:
    """What is said now into a column of ``out`` (7, …)."""
    for c in range(N_SAID):
        out[c, place] = state.said[c]
    out[ALPHA, place], out[ALPHA_VARIANCE, place] = state.gains[0, 0], state.gains[1, 0]


@compiled
def follow(
    rows: Measured, bins: Bins, state: Filter, beliefs: Beliefs, terms: Terms
) -> tuple[F64, I64, Bool]:
    """Rows through the bins and the filter, which are carried on in place.

    Returns what is said after each bin, and what was said before the first, (7, m): probabilities, jump,
    warm, as in :class:`Filter`, α and its variance; which of these each row goes by, (n,); and which rows
    were outliers, (n,).
    """
    n = rows.t_ns.shape[0]
    out, at, outliers = np.empty((N_COLUMNS, 2 * n + 1)), np.empty(n, np.int64), np.empty(n, np.bool_)
    mean, m, i = state.mean, 0, 0
    note(state, m, out)
    if n and bins.stamps_ns[0] == NONE_NS:
        begin_at(bins, rows, 0)
    while i < n:
        if opens_after(bins, rows.t_ns[i]):
            close(bins, state, rows.t_ns[i], beliefs, terms)
            m += 1
            note(state, m, out)
        if rows.restarts[i]:
            forget(bins, rows, i)
            jumped(state, beliefs)
        first = i
        i, next_ns = fill(bins, rows, first, mean[V_LONG], mean[YAW_RATE], outliers)
        at[first:i] = m
        if opens_after(bins, next_ns):
            close(bins, state, next_ns, beliefs, terms)
            m += 1
            note(state, m, out)
            at[i - 1] = m
    return out[:, : m + 1], at, outliers


class AlgebraicIdentifier:
    """Stage: evidence in, verdicts out.

    C_k, C_d and their thresholds come from the paper's scheme on the same rows, as do the reasons why
    something cannot be seen, and all for 1 s at the start and after a gap; mode, posterior and α come from
    the hypotheses. Of the robot's parameters only α, α_yaw and the half track are read. Skidding and slipping
    at once is no mode of its own.
    """

    def __init__(
        self,
        robot: RobotParameters,
        rules: Rules,
        settings: AlgebraicSettings = AlgebraicSettings(),
        *,
        terms: Terms = Terms(),  # noqa: B008 – immutable
    ) -> None:
        self.settings, self.beliefs = settings, believe(robot)
        self._paper, self._terms = PaperIdentifier(rules), terms
        self._bins, self._filter = no_bins(), new_filter(self.beliefs)

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time."""
        rows = Measured(evidence.t_ns, evidence.pose, evidence.efforts, evidence.variances, evidence.restarts)
        said, at, outliers = follow(rows, self._bins, self._filter, self.beliefs, self._terms)
        warm = said[WARM] > 0.0
        posterior = np.concatenate([said[:N_MODES], np.zeros((1, len(warm)))])
        posterior[:, ~warm] = np.nan
        jumped = warm & (said[JUMP] > 0.0)
        answers = Said(posterior, said[ALPHA], np.sqrt(said[ALPHA_VARIANCE]), jumped, at)
        verdict = decide(self._paper.push(evidence), evidence, answers, self.settings.min_confidence, N_MODES)
        if outliers.any():
            seen = outliers & warm[at] & (evidence.independence != NOT_INDEPENDENT)
            verdict.outcome[seen] = Status.OUTLIER
        return verdict

"""The stage: rows in, verdicts out."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from wmr_replay.identify.algebraic.beliefs import Beliefs, believe
from wmr_replay.identify.algebraic.bins import (
    COUNT,
    Bins,
    Measured,
    add,
    drive,
    foreseen,
    forget,
    means,
    no_bins,
    opens_after,
    outlying,
    reopen,
)
from wmr_replay.identify.algebraic.filter import JUMP, N_SAID, WARM, Filter, jumped, new_filter, take_up
from wmr_replay.identify.algebraic.regression import V_LONG, YAW_RATE
from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.paper import PaperIdentifier, Rules
from wmr_replay.identify.posterior import decide
from wmr_replay.identify.terms import Terms
from wmr_replay.identify.verdict import Evidence, Verdict
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.robot import RobotParameters

POSE_JUMP, OUTLIER = 7, 8
"""Outcomes, as positions in ``wmr_schemas.tables.Status``."""
N_MODES = 3
ALPHA, ALPHA_VARIANCE, N_COLUMNS = N_SAID, N_SAID + 1, N_SAID + 2


@dataclass(frozen=True)
class AlgebraicSettings:
    """What a named mode asks for."""

    min_confidence: float = 0.5


@njit(cache=True)
def close(bins: Bins, state: Filter, next_ns: int, beliefs: Beliefs, terms: Terms) -> None:
    """The open bin is complete; ``next_ns`` lies in the one to open."""
    if bins.sums[COUNT] > 0.0:
        take_up(state, means(bins), beliefs, terms)
    reopen(bins, next_ns)


@njit(cache=True)
def follow(rows: Measured, bins: Bins, state: Filter, beliefs: Beliefs, terms: Terms) -> tuple[F64, Bool]:
    """Rows through the bins and the filter, which are carried on in place.

    Returns what is said at each row, (7, n): probabilities, jump, warm, as in :class:`Filter`, α and its
    variance; and which rows were outliers, (n,).
    """
    n = rows.t_ns.shape[0]
    out, outliers = np.empty((N_COLUMNS, n)), np.empty(n, np.bool_)
    mean, gains, said = state.mean, state.gains, state.said
    for i in range(n):
        t_ns = rows.t_ns[i]
        if opens_after(bins, t_ns):
            close(bins, state, t_ns, beliefs, terms)
        drive(bins, rows, i)
        if rows.restarts[i]:
            forget(bins, rows, i)
            jumped(state, beliefs)
        outliers[i] = outlying(bins, rows, i, mean[V_LONG], mean[YAW_RATE])
        if not outliers[i]:
            add(bins, rows, i)
        next_ns = foreseen(bins, t_ns)
        if opens_after(bins, next_ns):
            close(bins, state, next_ns, beliefs, terms)
        for c in range(N_SAID):
            out[c, i] = said[c]
        out[ALPHA, i], out[ALPHA_VARIANCE, i] = gains[0, 0], gains[1, 0]
    return out, outliers


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
        said, outliers = follow(rows, self._bins, self._filter, self.beliefs, self._terms)
        posterior = np.concatenate([said[:N_MODES], np.zeros((1, len(outliers)))])
        posterior[:, said[WARM] == 0.0] = np.nan
        fitted = said[ALPHA], np.sqrt(said[ALPHA_VARIANCE])
        verdict = decide(
            self._paper.push(evidence), evidence, posterior, fitted, self.settings.min_confidence, N_MODES
        )
        seen = (said[WARM] > 0.0) & (evidence.independence != NOT_INDEPENDENT)
        outcome = np.where(seen & (said[JUMP] > 0.0), POSE_JUMP, verdict.outcome)
        return verdict._replace(outcome=np.where(seen & outliers, OUTLIER, outcome).astype(np.int8))

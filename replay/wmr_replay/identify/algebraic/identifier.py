"""The algebraic identifier as a stage: rows in, verdicts out."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.identify.algebraic.bins import (
    COUNT,
    NONE_NS,
    Bins,
    Measured,
    begin_at,
    discard_open_bin,
    empty_bins,
    fill_bin,
    means,
    opens_after,
    reopen,
)
from wmr_replay.identify.algebraic.filter import (
    JUMP,
    N_OUTPUTS,
    WARM,
    Filter,
    new_filter,
    release_after_jump,
    update,
)
from wmr_replay.identify.algebraic.priors import Priors, make_priors
from wmr_replay.identify.algebraic.regression import V_LONG, YAW_RATE
from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_replay.identify.posterior import BinEstimates, decide
from wmr_replay.identify.terms import Terms
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, Rules
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.compiled import compiled
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import Status

N_MODES = 3
ALPHA, ALPHA_VARIANCE, N_COLUMNS = N_OUTPUTS, N_OUTPUTS + 1, N_OUTPUTS + 2


@dataclass(frozen=True)
class AlgebraicSettings:
    """``min_confidence`` is the least posterior with which a mode is named, 0 to 1."""

    min_confidence: float = 0.5


@compiled
def close_bin(bins: Bins, state: Filter, next_ns: int, priors: Priors, terms: Terms) -> None:
    """The open bin is complete; ``next_ns`` lies in the one to open."""
    if bins.sums[COUNT] > 0.0:
        update(state, means(bins), priors, terms)
    reopen(bins, next_ns)


@compiled
def store_output(state: Filter, place: int, out: F64) -> None:
    """The posterior, flags, α and its variance into column ``place`` of ``out`` (7, …)."""
    for c in range(N_OUTPUTS):
        out[c, place] = state.output[c]
    out[ALPHA, place], out[ALPHA_VARIANCE, place] = state.gains[0, 0], state.gains[1, 0]


@compiled
def filter_rows(
    rows: Measured, bins: Bins, state: Filter, priors: Priors, terms: Terms
) -> tuple[F64, I64, Bool]:
    """Rows through the bins and the filter, which are carried on in place.

    Returns the outputs (7, m) before the first bin and after each bin: probabilities, jump and warm as in
    :class:`Filter`, α and its variance; the output that each row takes, (n,); and the mask of outliers, (n,).
    """
    n = rows.t_ns.shape[0]
    out, at, outliers = np.empty((N_COLUMNS, 2 * n + 1)), np.empty(n, np.int64), np.empty(n, np.bool_)
    mean, m, i = state.mean, 0, 0
    store_output(state, m, out)
    if n and bins.stamps_ns[0] == NONE_NS:
        begin_at(bins, rows, 0)
    while i < n:
        if opens_after(bins, rows.t_ns[i]):
            close_bin(bins, state, rows.t_ns[i], priors, terms)
            m += 1
            store_output(state, m, out)
        if rows.restarts[i]:
            discard_open_bin(bins, rows, i)
            release_after_jump(state, priors)
        first = i
        i, next_ns = fill_bin(bins, rows, first, mean[V_LONG], mean[YAW_RATE], outliers)
        at[first:i] = m
        if opens_after(bins, next_ns):
            close_bin(bins, state, next_ns, priors, terms)
            m += 1
            store_output(state, m, out)
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
        self.settings, self.priors = settings, make_priors(robot)
        self._paper, self._terms = PaperIdentifier(rules), terms
        self._bins, self._filter = empty_bins(), new_filter(self.priors)
        self._driven = False
        """Whether any torque has been known: nothing is known of α before."""

    def push(self, evidence: Evidence) -> Verdict:
        """Verdicts for rows in strictly increasing time."""
        rows = Measured(evidence.t_ns, evidence.pose, evidence.efforts, evidence.variances, evidence.restarts)
        outputs, at, outliers = filter_rows(rows, self._bins, self._filter, self.priors, self._terms)
        warm = outputs[WARM] > 0.0
        posterior = np.concatenate([outputs[:N_MODES], np.zeros((1, len(warm)))])
        posterior[:, ~warm] = np.nan
        jumped = warm & (outputs[JUMP] > 0.0)
        estimates = BinEstimates(posterior, outputs[ALPHA], np.sqrt(outputs[ALPHA_VARIANCE]), jumped, at)
        thresholds = self._paper.push(evidence)
        known = np.isfinite(evidence.efforts).all(axis=0)
        driven = np.logical_or.accumulate(known) | self._driven
        self._driven = bool(driven[-1]) if len(driven) else self._driven
        verdict = decide(thresholds, evidence, estimates, self.settings.min_confidence, N_MODES)
        if not driven.all():
            alpha, alpha_sd = (np.where(driven, of, np.nan) for of in (verdict.alpha, verdict.alpha_sd))
            verdict = verdict._replace(alpha=alpha, alpha_sd=alpha_sd)
        if outliers.any():
            seen = outliers & warm[at] & (evidence.independence != NOT_INDEPENDENT)
            verdict.outcome[seen] = Status.OUTLIER
        return verdict

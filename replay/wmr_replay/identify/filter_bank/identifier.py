"""The bank as an identifier: rows go into bins, and rows report the last bin."""

import numpy as np

from wmr_replay.identify.filter_bank.bank import Bank, BankSettings, torque_model
from wmr_replay.identify.filter_bank.bins import FORCE, TURN, Bins, into_bins, open_bin
from wmr_replay.identify.filter_bank.hindsight import LookingBack
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_replay.identify.posterior import BinEstimates, decide
from wmr_replay.identify.terms import Terms
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, Rules
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.robot import RobotParameters


class BankIdentifier:
    """Stage: evidence in, verdicts out.

    C_k, C_d and their thresholds come from the paper's scheme on the same rows, as do the reasons why
    something cannot be seen; mode, posterior and α come from the bank.
    """

    def __init__(
        self,
        robot: RobotParameters,
        rules: Rules,
        step_s: float,
        settings: BankSettings,
        *,
        both: bool = False,
        terms: Terms = Terms(),  # noqa: B008 – immutable
    ) -> None:
        self.settings, self._paper = settings, PaperIdentifier(rules)
        self._n_modes = 4 if both else 3
        self._bank = Bank(torque_model(robot, settings, terms), step_s, settings, self._n_modes)
        self._bin, self._said = open_bin(), np.full(7, np.nan)
        self._coasts = np.zeros(1, np.bool_)
        self.new_bins = Bins.none()
        """The bins that the last ``push`` completed."""

    def change_rate(self, step_s: float) -> None:
        """The pose comes every ``step_s`` from the next row on."""
        self._bank.change_rate(step_s)

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time; NaN until the bank has started."""
        paper = self._paper.push(evidence)
        bins, done = into_bins(
            evidence.t_ns,
            evidence.pose,
            evidence.efforts,
            evidence.variances,
            evidence.restarts,
            self._bank.rows_per_bin,
            self._bin,
        )
        self.new_bins = bins
        found = self._bank.push(bins, paper.alpha, paper.alpha_sd, done)
        said = np.concatenate([self._said[:, None], found], axis=1)
        self._said = said[:, -1]
        alpha = np.exp(said[4])
        jumped = said[6] >= PRIORS.jump_probable
        coasts = np.concatenate([self._coasts, no_demand(efforts_of(bins), alpha[1:])])
        self._coasts = coasts[-1:]
        with np.errstate(invalid="ignore"):  # of a model that cannot be, ln α runs away, its variance below 0
            alpha_sd = alpha * np.sqrt(said[5])
        answers = BinEstimates(said[:4], alpha, alpha_sd, jumped, done, coasts)
        return decide(paper, evidence, answers, self.settings.min_confidence, self._n_modes)

    def looking_back(self, lag_s: float) -> LookingBack | None:
        """A second pass over the same bins with the parameters learned; None before the bank starts."""
        return self._bank.looking_back(lag_s)


def efforts_of(bins: Bins) -> F64:
    """The harder driven wheel's effort in each bin (m,), twice."""
    return np.asarray(np.abs(bins.values[FORCE]) + np.abs(bins.values[TURN]))


def no_demand(efforts: F64, alpha: F64) -> Bool:
    """Whether no wheel is asked for anything (m,), or nobody knows for what; see :func:`efforts_of`."""
    return np.asarray(~(0.5 * alpha * efforts >= PRIORS.least_demand_mps2))

"""What a bank's hypotheses are about: how they start, what a step does to them, what they have learned."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, TURN, Bins
from wmr_replay.identify.filter_bank.hypotheses import ENDED, LEFT, PRESENT_S, HypothesisSet
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.start import start_hypotheses
from wmr_replay.identify.filter_bank.states import LN_ALPHA, LN_BETA, LN_C, N_STATES, Prior, with_alpha
from wmr_replay.identify.filter_bank.steps import Drift, Rhythm, run_bins
from wmr_replay.identify.terms import Terms
from wmr_schemas.arrays import F64

N_LAST = 9
LEAST_SD = 0.05
"""Of ln α and ln c in the second pass: a load of 5 % comes and goes within a log."""


class Said(NamedTuple):
    """A bank's answers (k, m) after each of m bins, the posterior by mode first; and ``smoothed`` (7, i): for
    each interval that leaves the ring its end in s, the posterior, and mean and variance of ln α.
    """

    answers: F64
    smoothed: F64


class BankModel(Protocol):
    """What the bank asks of the model of its hypotheses."""

    @property
    def n_answers(self) -> int:
        """Rows of the answers."""

    @property
    def n_states(self) -> int:
        """States of a hypothesis."""

    @property
    def least_bins(self) -> int:
        """Bins of the first fit."""

    @property
    def needs_alpha(self) -> bool:
        """Whether α has to be known before the bank can start."""

    def with_alpha(self, alpha: float) -> "BankModel":
        """The model, once a regression has found α."""

    def start(self, hypotheses: HypothesisSet, bins: Bins, n_modes: int, last: F64) -> None:
        """Fill the set at the last of the bins, and ``last`` (9,), which the steps carry on."""

    def run(self, hypotheses: HypothesisSet, values: F64, seconds: F64, last: F64, rhythm: Rhythm) -> Said:
        """Bins (9 rows at least, m) at times (m,) through the hypotheses."""

    def learned(self, hypotheses: HypothesisSet) -> "BankModel":
        """The model with what the hypotheses know at the end of the first pass."""


def first_habits() -> F64:
    """How often and after how long a robot switches, before its log: see :class:`.priors.BankPriors`."""
    return np.array(
        [
            *np.multiply(PRIORS.rolls_seen, [1.0, PRIORS.rolled_s]),
            *np.multiply(PRIORS.ends_seen, [1.0, PRIORS.lost_s, PRIORS.across]),
            0.0,
        ]
    )


@dataclass(frozen=True, eq=False)
class TorqueModel:
    """Wheel torques accelerate the robot; the contact mode decides by how much."""

    prior: Prior
    terms: Terms
    drift: Drift
    least_bins: int
    n_answers: int = 7
    n_states: int = N_STATES
    habits: F64 = field(default_factory=first_habits)

    @property
    def needs_alpha(self) -> bool:
        """Whether α is unknown."""
        return bool(np.isnan(self.prior.ln_alpha))

    def with_alpha(self, alpha: float) -> "TorqueModel":
        """See :func:`~.states.with_alpha`."""
        return replace(self, prior=with_alpha(self.prior, alpha))

    def start(self, hypotheses: HypothesisSet, bins: Bins, n_modes: int, last: F64) -> None:
        """See :func:`~.start.start_hypotheses`."""
        start_hypotheses(hypotheses, bins, self.prior, n_modes, self.drift.disturbance)
        hypotheses.habits[: hypotheses.size[0]] = self.habits
        last[1:3] = bins.values[FORCE, -1], bins.values[TURN, -1]

    def run(self, hypotheses: HypothesisSet, values: F64, seconds: F64, last: F64, rhythm: Rhythm) -> Said:
        """See :func:`~.steps.run_bins`."""
        said = run_bins(hypotheses, values, seconds, last, self.prior, self.terms, self.drift, rhythm)
        return Said(np.concatenate(said[:3]), said.smoothed)

    def learned(self, hypotheses: HypothesisSet) -> "TorqueModel":
        """See :func:`learned_prior`."""
        return replace(self, prior=learned_prior(hypotheses, self.prior), habits=learned_habits(hypotheses))


def learned_prior(hypotheses: HypothesisSet, prior: Prior) -> Prior:
    """The prior with what the first pass knows at its end of ln α, ln β, ln c and ρ.

    An interval of the parameters is at least as wide as ``LEAST_SD``: the first pass has seen the same log.
    """
    mean, sd = moments(hypotheses)
    sd = np.maximum(sd, LEAST_SD)
    return prior._replace(
        ln_alpha=float(mean[LN_ALPHA]),
        ln_alpha_sd=min(float(sd[LN_ALPHA]), prior.ln_alpha_sd),
        ln_beta=prior.ln_beta if np.isnan(prior.ln_beta) else float(mean[LN_BETA]),
        ln_c=float(mean[LN_C]),
        ln_c_sd=min(float(sd[LN_C]), prior.ln_c_sd),
    )


def learned_habits(hypotheses: HypothesisSet) -> F64:
    """The mean habits of all hypotheses, each as if it had been seen at most ``learned_switches`` times."""
    n = int(hypotheses.size[0])
    weight = np.exp(hypotheses.log_weight[:n])
    habits = weight @ hypotheses.habits[:n] / weight.sum()
    for first, past in ((LEFT, ENDED), (ENDED, PRESENT_S)):
        habits[first:past] *= min(1.0, PRIORS.learned_switches / habits[first])
    habits[PRESENT_S] = 0.0
    return np.asarray(habits)


def moments(hypotheses: HypothesisSet) -> tuple[F64, F64]:
    """Mean and standard deviation (s,) of the states over all hypotheses."""
    n = int(hypotheses.size[0])
    weight = np.exp(hypotheses.log_weight[:n])
    weight /= weight.sum()
    mean = weight @ hypotheses.mean[:n]
    off = hypotheses.mean[:n] - mean
    variance = weight @ (np.diagonal(hypotheses.covariance[:n], axis1=1, axis2=2) + off**2)
    return mean, np.sqrt(variance)

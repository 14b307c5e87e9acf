"""The bank once more over a whole log: what the log up to t + lag says about the mode at t.

Every hypothesis carries the probabilities of the modes that led to it, interval by interval, over the lag.
Where two hypotheses are merged, their pasts are averaged by weight. An interval's posterior is the average
over the hypotheses that live a lag later: fixed-lag smoothing of a multi-hypothesis filter.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.bins import Bins
from wmr_replay.identify.filter_bank.hypotheses import make_hypotheses
from wmr_replay.identify.filter_bank.long_steps import LongSteps
from wmr_replay.identify.filter_bank.model import N_LAST, BankModel
from wmr_replay.identify.filter_bank.states import LN_ALPHA
from wmr_replay.identify.filter_bank.steps import Rhythm
from wmr_schemas.arrays import F64, I64, NS_PER_S


class Intervals(NamedTuple):
    """m consecutive intervals: their ends in ns (m,), the posterior by mode (4, m), mean and variance of ln α
    (2, m).
    """

    end_ns: I64
    posterior: F64
    ln_alpha: F64


@dataclass(frozen=True, eq=False)
class Pass:
    """What the second pass takes from the first: model, number of modes, and rhythm."""

    model: BankModel
    n_modes: int
    rhythm: Rhythm
    interval_s: float
    """Whole bins that make up a split interval."""


class LookingBack:
    """Stage: the bins of the first pass in, intervals out, each a lag after its end."""

    def __init__(self, second: Pass, lag_s: float) -> None:
        room = second.rhythm.most * (second.n_modes + 2) + 4
        self._second = second
        self._room = max(1, round(lag_s / second.interval_s))
        self._hypotheses = make_hypotheses(room, self._room, second.model.n_states)
        self._last = np.zeros(N_LAST)
        self._waiting: Bins | None = None
        self._origin_ns, self._long_steps = 0, LongSteps()

    def push(self, bins: Bins) -> Intervals:
        """The intervals whose lag is over."""
        found = [self._intervals(np.empty((7, 0)))]
        while len(bins.stamps):
            if not self._hypotheses.size[0]:
                bins = bins if self._waiting is None else self._waiting.then(bins)
                if len(bins.stamps) < self._second.model.least_bins:
                    self._waiting = bins
                    break
                bins = self._begin(bins)
            seconds, self._long_steps = self._long_steps.shorten((bins.stamps - self._origin_ns) / NS_PER_S)
            found.append(self._filtered(bins.part(0, len(seconds)), seconds))
            bins = bins.part(len(seconds), None)
        return Intervals(*(np.concatenate(parts, axis=-1) for parts in zip(*found, strict=True)))

    def _filtered(self, bins: Bins, seconds: F64) -> Intervals:
        """Bins through the bank; behind a step that is too long, or numbers that it cannot follow, it forgets
        all, as the first pass does.
        """
        run, rhythm = self._second.model.run, self._second.rhythm
        try:
            said = run(self._hypotheses, bins.values, seconds, self._last, rhythm)
        except (ZeroDivisionError, ValueError):
            return self._forget()
        if not len(seconds) or not np.isfinite(said.answers[:4]).all():
            return self._forget()
        return self._intervals(said.smoothed)

    def _forget(self) -> Intervals:
        """As before the first bin."""
        self._hypotheses.size[0] = self._hypotheses.n_past[0] = 0
        self._last[:] = 0.0
        self._long_steps = self._long_steps.from_origin()
        return self._intervals(np.empty((7, 0)))

    def finish(self) -> Intervals:
        """The intervals of the last lag, as the end of the log shows them."""
        size, n = int(self._hypotheses.size[0]), int(self._hypotheses.n_past[0])
        places = np.arange(max(0, n - self._room), n) % self._room
        weight = np.exp(self._hypotheses.log_weight[:size])
        posterior = np.einsum("h,hkm->mk", weight, self._hypotheses.past[:size, places])
        mean = self._hypotheses.mean[:size, LN_ALPHA]
        first = float(weight @ mean)
        second = float(weight @ (self._hypotheses.covariance[:size, LN_ALPHA, LN_ALPHA] + mean**2))
        alpha = np.broadcast_to([[first], [max(second - first**2, 0.0)]], (2, len(places)))
        return self._intervals(np.concatenate([[self._hypotheses.past_s[places]], posterior, alpha]))

    def _begin(self, waiting: Bins) -> Bins:
        """Start the hypotheses on the first bins; the bins that are left."""
        n = self._second.model.least_bins
        first, self._waiting = waiting.part(0, n), None
        self._origin_ns = int(first.stamps[-1])
        self._long_steps = self._long_steps.from_origin()
        self._second.model.start(self._hypotheses, first, self._second.n_modes, self._last)
        return waiting.part(n, None)

    def _intervals(self, smoothed: F64) -> Intervals:
        end_ns = self._origin_ns + np.rint(smoothed[0] * NS_PER_S).astype(np.int64)
        return Intervals(end_ns, smoothed[1:5], smoothed[5:7])

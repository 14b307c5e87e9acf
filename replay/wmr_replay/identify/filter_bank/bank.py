"""The bank over bins: every bin advances all hypotheses."""

import math
from dataclasses import dataclass

import numpy as np

from wmr_replay.identify.filter_bank.bins import Bins
from wmr_replay.identify.filter_bank.hindsight import LookingBack, Pass
from wmr_replay.identify.filter_bank.hypotheses import make_hypotheses, restore, snapshot
from wmr_replay.identify.filter_bank.long_steps import LongSteps
from wmr_replay.identify.filter_bank.model import N_LAST, BankModel, TorqueModel
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import make_prior
from wmr_replay.identify.filter_bank.steps import Drift, Rhythm
from wmr_replay.identify.terms import Terms
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.robot import RobotParameters

MOST_BLOCK = 1 << 20
"""Bins of one pass. There are fewer only near a bin at which the bank diverges, to find it quickly."""
ALPHA_KNOWN_WITHIN = PRIORS.alpha_known_within


@dataclass(frozen=True)
class BankSettings:
    """Size and time steps of the filter bank, rates of change, and the least confidence; with reasons."""

    most_hypotheses: int = 40
    """Hypotheses that are kept. A compromise with speed."""
    bin_s: float = 0.02
    """Length of a bin. Numerics: motion changes little in it."""
    split_s: float = 0.1
    """Time between two branchings. Numerics: a switch is dated to about this interval."""
    hindsight_split_s: float = 0.06
    """The same in the second pass, which has no delay of its own to hide a coarser grid."""
    switch_rate_per_s: float = 0.15
    """Switches of the mode a second. The rate of the benchmark, not evidence about robots."""
    start_bins: int = 30
    """Bins of the first fit, .6 s. Judgement: long enough for a velocity, short against a phase."""
    velocity_diffusions: tuple[float, ...] = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
    """Levels of disturbance, (m/s)²/s for v_long and v_lat, (rad/s)²/s for ω; part of the hypothesis."""
    disturbances_mps2: tuple[float, ...] = (0.001, 0.003, 0.006, 0.012, 0.03, 0.1, 0.3)
    """Coloured disturbances by the same levels, standard deviations of dv_long/dt (l dω/dt alike)."""
    alpha_diffusion_share: float = 0.01
    """Diffusion of ln α in 1/s over that of the velocities. Judgement."""
    rho_diffusion_per_s: float = 1e-3
    """Diffusion of ρ. Judgement: .03 within a second."""
    cap_diffusion_per_s: float = 1e-2
    """Diffusion of the logarithm of a cap. Judgement: a tenth within a second."""
    min_confidence: float = 0.5
    """Least posterior of a named mode."""


def torque_model(robot: RobotParameters, settings: BankSettings, terms: Terms) -> TorqueModel:
    """The model of a robot that is driven by wheel torques."""
    s = settings
    drift = Drift(
        np.array(s.velocity_diffusions),
        np.array(s.disturbances_mps2),
        s.alpha_diffusion_share,
        s.rho_diffusion_per_s,
        s.cap_diffusion_per_s,
    )
    return TorqueModel(make_prior(robot), terms, drift, s.start_bins)


class Bank:
    """Stage: bins in, after each of them the posterior over the modes and what else the model tells."""

    def __init__(self, model: BankModel, step_s: float, settings: BankSettings, n_modes: int) -> None:
        self.settings, self._n_modes = settings, n_modes
        self._first_model = self._model = model
        self._hypotheses = make_hypotheses(
            settings.most_hypotheses * (n_modes + 2) + 4, n_states=model.n_states
        )
        self._step_s, self._last = step_s, np.zeros(N_LAST)
        self._waiting: Bins | None = None
        self._origin_ns, self._long_steps = 0, LongSteps()
        self._block = MOST_BLOCK
        self.change_rate(step_s)

    def change_rate(self, step_s: float) -> None:
        """The pose comes every ``step_s`` from the next row on."""
        self.rows_per_bin = max(1, round(self.settings.bin_s / step_s))

    def push(self, bins: Bins, alpha: F64, alpha_sd: F64, done: I64) -> F64:
        """What the bank says after each bin, (k, m), the posterior first; NaN before its start. With torques
        the mean and variance of ln α follow, and whether the pose has just jumped.

        A robot without a nominal α starts where a regression, ``alpha`` (n,) with ``alpha_sd`` at rows with
        which ``done`` (n,) bins were complete, knows it.
        """
        said, n = [np.full((self._model.n_answers, 0), np.nan)], 0
        while n < len(bins.stamps):
            rows = done >= n
            found = self._advance(bins.part(n, None), alpha[rows], alpha_sd[rows], done[rows] - n)
            said.append(found)
            n += found.shape[1]
        return np.concatenate(said, axis=1)

    def _advance(self, bins: Bins, alpha: F64, alpha_sd: F64, done: I64) -> F64:
        """What the bank says after each of the first of these bins."""
        if self._hypotheses.size[0]:
            return self._step(bins)
        held = 0 if self._waiting is None else len(self._waiting.stamps)
        waiting = bins if self._waiting is None else self._waiting.then(bins)
        begin = self._first_start(held, len(waiting.stamps), alpha, alpha_sd, done)
        if begin is None:
            self._waiting = waiting.part(max(0, len(waiting.stamps) - self._model.least_bins), None)
            return np.full((self._model.n_answers, len(bins.stamps)), np.nan)
        first = waiting.part(max(0, begin - self._model.least_bins), begin)
        self._waiting, self._origin_ns = None, int(first.stamps[-1])
        self._long_steps = self._long_steps.from_origin()
        self._model.start(self._hypotheses, first, self._n_modes, self._last)
        return np.full((self._model.n_answers, begin - held), np.nan)

    def _first_start(self, held: int, total: int, alpha: F64, alpha_sd: F64, done: I64) -> int | None:
        """How many of the waiting bins precede the bank's first step: enough of them, and α known."""
        least = self._model.least_bins
        if not self._model.needs_alpha:
            return least if total >= least else None
        known = alpha_sd <= ALPHA_KNOWN_WITHIN * alpha
        ready = known & (held + done >= least)
        if not ready.any():
            return None
        row = int(np.argmax(ready))
        self._model = self._model.with_alpha(float(alpha[row]))
        return held + int(done[row])

    def _step(self, bins: Bins) -> F64:
        """What the bank says after each of the first of these bins, perhaps of none.

        Where a bin lies too far from the one before, or cannot be followed, the bank starts again behind it.
        """
        bins = bins.part(0, self._block)
        seconds, long_steps = self._long_steps.shorten((bins.stamps - self._origin_ns) / NS_PER_S)
        n = len(seconds)
        if not n:
            self._start_again()
            return np.full((self._model.n_answers, 0), np.nan)
        before = snapshot(self._hypotheses), self._last.copy()
        said = self._filtered(bins.part(0, n), seconds)
        if said is not None:
            self._long_steps, self._block = long_steps, min(2 * self._block, MOST_BLOCK)
            return said
        restore(before[0], self._hypotheses)
        self._last[:] = before[1]
        if n > 1:
            self._block = n // 2
            return np.full((self._model.n_answers, 0), np.nan)
        self._start_again()
        return np.full((self._model.n_answers, 1), np.nan)

    def _start_again(self) -> None:
        """As before the first bin."""
        self._hypotheses.size[0] = 0
        self._last[:] = 0.0
        self._model, self._waiting = self._first_model, None
        self._long_steps = self._long_steps.from_origin()

    def _filtered(self, bins: Bins, seconds: F64) -> F64 | None:
        """The bank's answers after each bin, or None where some are no numbers: it has diverged."""
        rhythm = self._rhythm(self.settings.split_s)
        try:
            said = self._model.run(self._hypotheses, bins.values, seconds, self._last, rhythm)
        except (ZeroDivisionError, ValueError):
            return None
        return said.answers if np.isfinite(said.answers[:4]).all() else None

    def _rhythm(self, split_s: float) -> Rhythm:
        """The bank's time steps with branchings ``split_s`` apart."""
        s, newer = self.settings, 0.5 * (1 + 1 / self.rows_per_bin)
        return Rhythm(self._n_modes, s.most_hypotheses, split_s, s.switch_rate_per_s, newer)

    def looking_back(self, lag_s: float) -> LookingBack | None:
        """A second pass over the same bins with the parameters learned; None before the bank starts."""
        if not self._hypotheses.size[0]:
            return None
        rhythm, bin_s = self._rhythm(self.settings.hindsight_split_s), self.rows_per_bin * self._step_s
        interval_s = bin_s * max(1, math.ceil(rhythm.split_s / bin_s - 1e-6))
        second = Pass(self._model.learned(self._hypotheses), self._n_modes, rhythm, interval_s)
        return LookingBack(second, lag_s)

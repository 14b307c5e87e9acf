"""Which kernel differentiates: the given one, the rule's, or one that a stretch with motion has shown better.

Causal: a design holds from the row on at which it is chosen, and rows before that row chose it.
"""

from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.align import SampleBatch, concatenate
from wmr_replay.differentiate import KernelSpec, noise_coefficient
from wmr_replay.differentiate.joint import tune_jointly
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import F64, I64, NS_PER_S

MIN_WINDOW_S, MAX_WINDOW_S, MIN_WINDOW_STEPS = 0.1, 2.0, 10
MIN_TUNING_ROWS, LEAST_COVERED = 50, 0.75
MOVES_IN_SIGMA = 3.0
"""A signal whose standard deviation over a stretch is this many times its noise has moved."""
CLEARLY_BETTER = 0.97
"""A tuned design takes over when its expected error is at most this share of the rule's."""
MOST_STRETCHES = 3
"""With motion; when none of them shows anything better, the rule's design stays."""
NEVER_NS = 2**62


@dataclass(frozen=True)
class Design:
    """A kernel, its window, whether it was ``given``, is the ``rule``'s or ``tuned``, and why."""

    spec: KernelSpec
    window_s: float
    origin: str
    reason: str
    error_ratio: float | None = None
    """Of a tuned design: expected error over the rule's."""
    since_s: float = 0.0
    """It holds from this row on, in s from the log's first pose."""


def rule_window_s(settings: Settings, spec: KernelSpec, step_s: float, position_sd_m: float) -> float:
    """T from sd(d²x/dt²) = s √(c·step/T⁵) = target; at least 10 steps and .1 s, at most 2 s, in
    whole steps. What ``max_delay_s`` allows comes first.
    """
    ratio = (position_sd_m / settings.target_a_long_sd_mps2) ** 2
    window_s = float((noise_coefficient(2, spec) * step_s * ratio) ** 0.2)
    n_steps = round(max(min(window_s, MAX_WINDOW_S), MIN_WINDOW_S, MIN_WINDOW_STEPS * step_s) / step_s)
    if settings.max_delay_s is not None and spec.delay_s(n_steps * step_s) > settings.max_delay_s:
        n_steps = int(2 * settings.max_delay_s / (1 - spec.theta) / step_s + 1e-6)
    return n_steps * step_s


def first_design(settings: Settings, step_s: float, position_sd_m: float) -> Design:
    """The design that holds at the log's start: the given one, or the rule's."""
    spec = KernelSpec(settings.degree, settings.kappa, settings.mu, settings.theta)
    if settings.window_s is not None:
        return Design(spec, settings.window_s, "given", "the window was given")
    window_s = rule_window_s(settings, spec, step_s, position_sd_m)
    if not settings.tunes:
        return Design(spec, window_s, "rule", "by the rule, not to be tuned")
    return Design(
        spec, window_s, "rule", f"by the rule, no {settings.tuning_stretch_s:g} s with motion to tune on"
    )


def moves(pose: F64, sigma: F64) -> bool:
    """Whether anything beyond noise happens in a stretch (3, n) with noise ``sigma`` (3,)."""
    return bool(np.any(np.std(pose, axis=1) > MOVES_IN_SIGMA * sigma))


class Trial:
    """Watches stretches of the log, one after the other, until one with motion shows a better design or three
    have shown none.

    ``design`` is the one that holds.
    """

    def __init__(
        self,
        settings: Settings,
        design: Design,
        step_s: float,
        sigma: F64,
        start_ns: int,
        first_ns: int | None = None,
    ) -> None:
        """The log starts at ``start_ns``, the first stretch at ``first_ns`` (None: with the log)."""
        self.design, self.start_ns = design, start_ns
        self._step_s, self._sigma = step_s, sigma
        delay_s = design.spec.delay_s(design.window_s)
        self._max_delay_s = delay_s if settings.max_delay_s is None else settings.max_delay_s
        self._length_ns = round(max(settings.tuning_stretch_s, MIN_TUNING_ROWS * step_s) * NS_PER_S)
        begins_ns = start_ns if first_ns is None else first_ns
        self._end_ns = begins_ns + self._length_ns if settings.tunes else NEVER_NS
        self._held: list[SampleBatch] = []
        self._n_left = MOST_STRETCHES

    @property
    def is_over(self) -> bool:
        """Whether the design stays as it is."""
        return self._end_ns == NEVER_NS

    def rows_left(self, t_ns: I64) -> int:
        """How many rows of a batch still belong to the present stretch."""
        return int(np.searchsorted(t_ns, self._end_ns))

    def watch(self, rows: SampleBatch) -> None:
        """Rows of the present stretch, repaired and without outliers."""
        if not self.is_over:
            self._held.append(rows)

    def conclude(self, t_ns: int) -> list[SampleBatch]:
        """At the first row behind a stretch: choose the design from there on, and give the rows with which to
        fill its window; no rows where the present design goes on.
        """
        held, self._held = self._held, []
        rows = concatenate(held)
        self._end_ns = t_ns + self._length_ns
        if len(rows) < max(MIN_TUNING_ROWS, LEAST_COVERED * self._length_ns / NS_PER_S / self._step_s):
            return []
        if not moves(rows.pose, self._sigma):
            return []
        self.design = self._tuned(rows, (t_ns - self.start_ns) / NS_PER_S)
        self._n_left -= 1
        is_tuned = self.design.origin == "tuned"
        if is_tuned or not self._n_left:
            self._end_ns = NEVER_NS
        return held if is_tuned else []

    def _tuned(self, rows: SampleBatch, since_s: float) -> Design:
        """The better of the present design and the one that is tuned on ``rows``."""
        t_s = (rows.t_ns - rows.t_ns[0]) / NS_PER_S
        uniform_s = np.arange(0, t_s[-1], self._step_s)
        signals = np.stack([np.interp(uniform_s, t_s, signal) for signal in rows.pose])
        old = (self.design.spec, self.design.window_s)
        found = tune_jointly(signals, self._sigma, self._max_delay_s, step_s=self._step_s, old=old)
        where = f"on {since_s - self._length_ns / NS_PER_S:.3g} to {since_s:.3g} s of the log"
        if found is None or found.ratio > CLEARLY_BETTER:
            return replace(self.design, reason=f"by the rule, nothing clearly better was found {where}")
        return Design(found.spec, found.window_s, "tuned", f"tuned {where}", found.ratio, since_s)

"""Intervals under noise of the pose that is correlated in time: its colour, and what follows from it.

What filters take for white noise is as wide as the likely colours make it; else identifiers get the intervals
of white noise as long as it looks white. Those of the tables always hold the noise as it was found and the
bias of the kernel's window.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.differentiate import KernelSpec
from wmr_replay.differentiate.colour import (
    EVIDENCE,
    LEAST_GAIN,
    Colour,
    Explained,
    KernelNoise,
    Scales,
    colour_of,
    explanations,
    kernel_noise,
    shapes_of,
    worst_factor,
)
from wmr_replay.differentiate.likely_noise import likely_noise
from wmr_replay.identify import Motion
from wmr_replay.identify.coloured_motion import Deviations
from wmr_replay.identify.motion import Derived
from wmr_schemas.arrays import F64, I64, NS_PER_S

FIRST_S, GROWTH, LONGEST_S = 2.0, 1.4, 60.0
"""The colour is found after 2 s, whenever the log has grown by two fifths, and every minute."""


USUAL = (0.25, 0.5)
"""Jumps of the acceleration of position and yaw, in (m/s²)²/s and (rad/s²)²/s, of a small robot: .5 m/s² and
.7 rad/s² once a second. The tables' intervals hold them until a colour is found, and a t-th of them after a
look at t seconds."""
UNKNOWN = Colour(
    white=1.0,
    wobble=0.0,
    time_s=1.0,
    velocity_jumps=0.0,
    acceleration_jumps=0.0,
    tracked=1.0,
    evidence=0.0,
)
"""White noise alone."""
KernelNoises = tuple[KernelNoise, KernelNoise]
"""Of position and of yaw."""


@dataclass(frozen=True, eq=False)
class Found:
    """The colours of position and yaw, from some row on; None while too little of the log is known."""

    colours: tuple[Colour, Colour] | None = None
    factors: tuple[float, float] = (1.0, 1.0)
    """On the tracked variances of position and yaw: those of white noise that hides as much motion."""
    by_kernel: dict[tuple[KernelSpec, int], KernelNoises] = field(default_factory=dict)
    log_s: float = 0.0
    """How much of the log they were found from."""
    shown: dict[tuple[KernelSpec, int], KernelNoises] = field(default_factory=dict)

    @property
    def evident(self) -> bool:
        """Whether the noise of position or yaw is no white noise."""
        return self.colours is not None and max(colour.evidence for colour in self.colours) >= EVIDENCE

    def of_kernel(self, spec: KernelSpec, n_taps: int, step_s: float) -> KernelNoises | None:
        """What position and yaw make of a kernel's estimates; None while nothing is known of them."""
        if self.colours is None:
            return None
        key = spec, n_taps
        if key not in self.by_kernel:
            position, yaw = (kernel_noise(colour, spec, n_taps, step_s) for colour in self.colours)
            self.by_kernel[key] = position, yaw
        return self.by_kernel[key]

    def shown_of_kernel(self, spec: KernelSpec, n_taps: int, step_s: float) -> KernelNoises:
        """The same for the tables, which hold the bias of the usual motion as long as the log is short."""
        key = spec, n_taps
        if key not in self.shown:
            fresh = 1 / max(self.log_s, 1.0)
            position, yaw = (
                kernel_noise(replace(colour, acceleration_jumps=jumps), spec, n_taps, step_s)
                for colour, usual in zip(self.colours or (UNKNOWN, UNKNOWN), USUAL, strict=True)
                for jumps in [colour.acceleration_jumps + fresh * usual]
            )
            self.shown[key] = position, yaw
        return self.shown[key]

    def counts(self, noises: tuple[KernelNoise, KernelNoise]) -> bool:
        """Whether the colour is evident, and widens a derivative's interval by more than a trifle."""
        return self.evident and max(worst_factor(noise) for noise in noises) >= LEAST_GAIN


class PoseColour:
    """Stage: repaired poses → which of :attr:`found` holds for each row."""

    def __init__(self, start_ns: int, step_s: float) -> None:
        self._start_ns, self._step_s = start_ns, step_s
        self._scales = Scales(step_s)
        self._shapes = shapes_of([scale.b for scale in self._scales.scales], step_s)
        self._next_s, self._pieces = FIRST_S, 0
        self.found = [Found()]
        self._since_ns = [start_ns]

    def push(self, rows: SampleBatch) -> I64:
        """Ordinals (n,) of what holds for each row; it depends on earlier rows alone."""
        t_s = (rows.t_ns - self._start_ns) / NS_PER_S
        pieces = self._pieces + np.cumsum(rows.restarts)
        columns = np.stack([t_s, *rows.pose, pieces.astype(float)])
        which, done = np.empty(len(t_s), np.int64), 0
        while done < len(t_s):
            n = int(np.searchsorted(t_s[done:], self._next_s))
            self._scales.push(columns[:, done : done + n])
            which[done : done + n] = len(self.found) - 1
            done += n
            if done < len(t_s):
                self._find(float(t_s[done]))
                self._since_ns.append(int(rows.t_ns[done]))
        self._pieces = int(pieces[-1]) if len(pieces) else self._pieces
        return which

    def _find(self, now_s: float) -> None:
        """Look again; what is found holds from now on."""
        self._next_s = max(now_s + 1e-6, min(GROWTH * self._next_s, self._next_s + LONGEST_S))
        position, yaw = explained = self._explained()
        colours = None if position is None or yaw is None else (colour_of(position), colour_of(yaw))
        log_s = 0.0 if colours is None else now_s
        self.found.append(Found(colours, self._factors(explained), log_s=log_s))

    def _explained(self) -> tuple[Explained | None, Explained | None]:
        """What explains the differences of position and of yaw so far, at every scale."""
        n, squares = self._scales.levels()
        position, yaw = (
            explanations(one, seen, self._shapes) for one, seen in zip((2 * n, n), squares, strict=True)
        )
        return position, yaw

    def _factors(self, explained: tuple[Explained | None, Explained | None]) -> tuple[float, float]:
        """On the tracked variances of position and yaw, as what explains them makes them likely."""
        position, yaw = (likely_noise(one, self._step_s).factor for one in explained)
        return position, yaw

    def in_hindsight(self) -> tuple[I64, F64]:
        """From which stamps on (k,) which ratios (k, 2) raise the factors of position and yaw that the log so
        far gave to those of all rows pushed. None is lowered: what seemed likely was no mere chance of noise.
        """
        given = np.array([found.factors for found in self.found])
        return np.array(self._since_ns), np.maximum(np.array(self._factors(self._explained())) / given, 1.0)

    def widen(self, motion: Motion, rows: Derived, which: I64, kernel: tuple[KernelSpec, int]) -> Motion:
        """The motion with intervals as wide as a colour asks for, on rows where one is evident."""
        widened = Deviations(motion, rows)
        for k, part in runs(which):
            noises = self.found[k].of_kernel(*kernel, self._step_s)
            if noises is not None and self.found[k].counts(noises):
                widened.widen(part, as_array(noises))
        return widened.motion

    def shown(self, motion: Motion, rows: Derived, which: I64, kernel: tuple[KernelSpec, int]) -> Motion:
        """The motion with the intervals of the tables: the noise as it was found, evident or not, and the
        window's bias.
        """
        widened = Deviations(motion, rows)
        for k, part in runs(which):
            widened.widen(part, as_array(self.found[k].shown_of_kernel(*kernel, self._step_s)))
        return widened.motion

    def as_white(self, rows: Derived, which: I64) -> F64:
        """Variances (2, n) of white noise that tells a filter as much about motion as the likely one."""
        white = np.stack([rows.position, rows.heading])
        for k, part in runs(which):
            white[:, part] *= np.array(self.found[k].factors)[:, None]
        return white


def runs(which: I64) -> Iterator[tuple[int, slice]]:
    """What holds for rows (n,), and for which of them: of what was found, the later holds for later rows."""
    edges = np.flatnonzero(np.diff(which)) + 1
    for first, end in pairwise([0, *edges.tolist(), len(which)] if len(which) else []):
        yield int(which[first]), slice(first, end)


def as_array(noises: KernelNoises) -> F64:
    """Factors and biases of position and yaw, (2, 7)."""
    return np.array([[*noise.factors, *noise.biases] for noise in noises])

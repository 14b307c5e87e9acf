"""Repeats of one part of the pose (position, or yaw): which of them a live tracker cannot have sent.

A value that is repeated to the bit is either held by the sender or measured again. A robot that moved at
speed u moves on by at least D(τ) = u τ − a τ²/2 within τ (by u²/2a once it can have stopped), a being the
hardest braking. A live tracker with resolution q repeats itself only while D is below q or so.
"""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool

REMEMBERED = 8
"""Runs of repeats that are remembered: few enough to notice a change within a second or so."""
MOST_CAUGHT = 6
"""Of these, so many that ended by catching up say that the tracker repeats itself."""
LONGER = 2.0
"""A presumed repeat lasts at most this many times the longest remembered run; a longer one is a rest."""
CATCHES_UP = 5.0
"""A run that ends by a step of so many resolutions ends by catching up: noise of twice the resolution, which
repeats itself by chance, makes such a step in one of five cases."""
ROUGH = 100.0
"""Changes of step of so many resolutions: so much noise repeats itself by chance in .3 % of the rows."""
ROUGH_STEPS = 4
"""Steps over which roughness is taken: of white noise, one of four shows it in nineteen of twenty cases."""
ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Relative size of a difference that rounding of the arithmetic alone explains."""
TAIL = 2 * ROUGH_STEPS
"""Rows that tell all that is remembered of rows without a repeat."""
STEPS_OF_RESOLUTION = 2.0
"""Two steps of the resolution: a value that moves by more cannot be rounded to the same number."""


class PartRules(NamedTuple):
    """``braking``: the hardest one, in m/s² or rad/s²; the friction of dry ground gives 10 m/s²."""

    braking: float


class Repeats(NamedTuple):
    """By row (n,): whether the part is that of the row before; whether a live tracker cannot have sent it,
    by its motion before or by its habit; whether the part is rough, its steps changing by noise far above
    its resolution; this ``grid`` so far; and the size of the last ``step``.
    """

    repeated: Bool
    impossible: Bool
    habitual: Bool
    rough: Bool
    grid: F64
    step: F64


class Part:
    """Stage: values (k, n) of one part of the pose → :class:`Repeats`, by rows up to each."""

    def __init__(self, rules: PartRules) -> None:
        self._braking = rules.braking
        self._last: F64 | None = None
        self._last_ns, self._since_ns, self._grid, self._speed = 0, 0, np.inf, 0.0
        self._step = 0.0
        self._steps = np.zeros((0, 0))
        self._was_repeat = False
        self._rough = np.zeros(ROUGH_STEPS)
        self._caught = np.zeros(REMEMBERED, np.int64)
        self._lasted_ns = np.zeros(REMEMBERED, np.int64)

    def moves(self, values: F64) -> bool:
        """Whether every row differs from the one before, by no less than the resolution so far."""
        if self._last is None or self._was_repeat or values.shape[1] <= TAIL:
            return False
        least = np.abs(np.diff(values, axis=1, prepend=self._last)).min(axis=1)
        return bool(least.max() > 0.0 and least.min() >= self._grid)

    def skip(self, t_ns: I64, values: F64) -> None:
        """Take in rows that :meth:`moves` is true of: none of them is a repeat."""
        before = len(t_ns) - TAIL - 1
        self._last, self._last_ns = values[:, before : before + 1], int(t_ns[before])
        self._since_ns = self._last_ns
        self.push(t_ns[-TAIL:], values[:, -TAIL:])

    def push(self, t_ns: I64, values: F64) -> Repeats:
        """Rows of strictly increasing stamps, one at least."""
        begins = self._last is None
        last = values[:, :1] if self._last is None else self._last
        if begins:
            self._last_ns = self._since_ns = int(t_ns[0])
            self._steps = np.zeros((len(values), 1))
        before = np.concatenate([last, values[:, :-1]], axis=1)
        before_ns = np.concatenate([np.array([self._last_ns], np.int64), t_ns[:-1]])
        changed = np.asarray((values != before).any(axis=0))
        since_ns = held_ns(t_ns, changed, self._since_ns)
        stood_ns = np.concatenate([np.array([self._since_ns], np.int64), since_ns[:-1]])
        steps = values - before
        grid = self._resolution(steps, np.abs(values), changed)
        size = np.sqrt(np.square(steps).sum(axis=0))
        speed = self._speed_before(size, grid, (t_ns - stood_ns) / NS_PER_S, changed)
        repeated = ~changed
        if begins:
            repeated[0] = False
        moved = least_displacement(speed, (t_ns - since_ns) / NS_PER_S, self._braking)
        ends = changed & np.concatenate([[self._was_repeat], repeated[:-1]])
        within_s = (t_ns - before_ns) / NS_PER_S
        caught = size > CATCHES_UP * grid + 0.5 * self._braking * within_s**2
        habitual = self._habitual(ends, caught, before_ns - stood_ns, t_ns - since_ns)
        rough = self._roughness(steps, changed, grid, within_s)
        step = held(size, changed, self._step)
        self._step = float(step[-1])
        self._last, self._last_ns, self._since_ns = values[:, -1:], int(t_ns[-1]), int(since_ns[-1])
        self._was_repeat = bool(repeated[-1])
        impossible = repeated & (moved > STEPS_OF_RESOLUTION * grid)
        return Repeats(repeated, impossible, repeated & habitual, rough, grid, step)

    def _resolution(self, steps: F64, size: F64, changed: Bool) -> F64:
        """Smallest step of any value so far, (n,), infinite before the first."""
        sizes = np.abs(steps)
        real = changed & (sizes > ROUNDING * size)
        smallest = np.where(real, sizes, np.inf).min(axis=0)
        grid = np.minimum.accumulate(np.concatenate([[self._grid], smallest]))[1:]
        self._grid = float(grid[-1])
        return np.asarray(grid)

    def _speed_before(self, size: F64, grid: F64, lasted_s: F64, changed: Bool) -> F64:
        """Least speed (n,) at the last change: its step, less the resolution, over the time since the change
        before, less what braking takes in half of it.
        """
        lasted_s = np.where(lasted_s > 0, lasted_s, np.inf)
        least = np.zeros(len(size))
        known = np.isfinite(grid)
        least[known] = (size[known] - grid[known]) / lasted_s[known] - 0.5 * self._braking * lasted_s[known]
        speed = held(np.maximum(least, 0.0), changed, self._speed)
        self._speed = float(speed[-1])
        return speed

    def _habitual(self, ends: Bool, caught: Bool, lasted_ns: I64, stands_ns: I64) -> Bool:
        """Whether most of the last runs ended by catching up, and this one is not much longer than they."""
        all_caught = np.concatenate([self._caught, caught[ends].astype(np.int64)])
        all_lasted = np.concatenate([self._lasted_ns, lasted_ns[ends]])
        n_caught = np.lib.stride_tricks.sliding_window_view(all_caught, REMEMBERED).sum(axis=1)
        longest = np.lib.stride_tricks.sliding_window_view(all_lasted, REMEMBERED).max(axis=1)
        at = np.cumsum(ends)
        self._caught, self._lasted_ns = all_caught[-REMEMBERED:], all_lasted[-REMEMBERED:]
        return np.asarray((n_caught[at] >= MOST_CAUGHT) & (stands_ns <= LONGER * longest[at]))

    def _roughness(self, steps: F64, changed: Bool, grid: F64, within_s: F64) -> Bool:
        """Whether any of the last four changes of step exceeds what rounding and braking explain, (n,)."""
        before = np.concatenate([self._steps, steps[:, :-1]], axis=1)
        bend = np.sqrt(np.square(steps - before).sum(axis=0))
        bend -= np.maximum(self._braking * within_s**2, ROUGH * grid)
        both = changed & (before != 0.0).any(axis=0)
        self._steps = steps[:, -1:]
        bends = np.concatenate([self._rough, bend[both]])
        largest = np.lib.stride_tricks.sliding_window_view(bends, ROUGH_STEPS).max(axis=1)
        self._rough = bends[-ROUGH_STEPS:]
        return np.asarray(largest[np.cumsum(both)] > 0.0)


def least_displacement(speed: F64, seconds: F64, braking: float) -> F64:
    """D (n,) = u τ − a τ²/2 until the robot can have stopped, at τ = u/a."""
    driven = np.minimum(seconds, speed / braking)
    return np.asarray(speed * driven - 0.5 * braking * driven**2)


def held(values: F64, new: Bool, first: float) -> F64:
    """The last of the ``new`` values at each row, ``first`` before any."""
    return np.asarray(np.concatenate([[first], values])[last_new(new)])


def held_ns(t_ns: I64, new: Bool, first_ns: int) -> I64:
    """The stamp of the last ``new`` row at each row, ``first_ns`` before any."""
    return np.asarray(np.concatenate([np.array([first_ns], np.int64), t_ns])[last_new(new)])


def last_new(new: Bool) -> I64:
    """One more than the index of the last ``new`` row at each row, 0 before any."""
    return np.maximum.accumulate(np.where(new, np.arange(1, len(new) + 1), 0))

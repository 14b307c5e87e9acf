"""Wheel speeds as differences of positions, message after message in the order of the file.

speed_k = (p_k − p_{k−1})/(t_k − t_{k−1}), stamped t_k: it is the mean over that interval and describes its
middle, half a step before its stamp. :func:`midway_of` gives the stamps of the middles. A row at its stamp
depends on nothing later, which a replay needs.
"""

import numpy as np

from wmr_replay.ingest.channels.wheel_bindings import InputBinding, PositionBinding, wheels_of
from wmr_replay.ingest.decoding.bindings import Binding
from wmr_schemas.absurd import without_absurd
from wmr_schemas.arrays import F64, I64, NS_PER_S

LONGEST_STEP_NS = NS_PER_S
"""The mean over a longer interval tells nothing of the speed; an input is held for as long."""
WITHIN_ONE_TURN = (-0.51, 1.01)
"""Positions that a driver keeps within a turn, from −π to π or from 0 to 2π, in turns."""
_EARLIEST = np.iinfo(np.int64).min


class PositionSteps:
    """Stage: ``push(t_ns, values)`` gives the values with speeds in rad/s in place of positions."""

    def __init__(self, binding: PositionBinding, n_before: int) -> None:
        self._binding, self._n_before = binding, n_before
        self._last_ns = _EARLIEST
        self._last = np.full((binding.n_raw, 1), np.nan)
        self._speeds = np.full((2, 1), np.nan)

    def push(self, t_ns: I64, values: F64) -> F64:
        """Stamps (n,) and values (n_before + wheels, n) to values (n_before + 2, n).

        A message that repeats a stamp repeats the speed; one that is stamped earlier than another before it
        has none.
        """
        before, positions = values[: self._n_before], without_absurd(values[self._n_before :])
        latest = np.maximum.accumulate(np.concatenate([[self._last_ns], t_ns]))
        moves = t_ns > latest[:-1]
        speeds = self._of(t_ns[moves], positions[:, moves])
        known = np.concatenate([self._speeds, speeds], axis=1)
        found = np.where(t_ns == latest[1:], known[:, np.cumsum(moves)], np.nan)
        self._speeds = known[:, -1:]
        return np.concatenate([before, found])

    def _of(self, t_ns: I64, positions: F64) -> F64:
        """Speeds (2, n) at stamps that increase."""
        if not len(t_ns):
            return np.empty((2, 0))
        whole = np.concatenate([self._last, positions], axis=1)
        first_ns = self._last_ns if self._last_ns > _EARLIEST else int(t_ns[0])
        steps_ns = np.diff(t_ns, prepend=first_ns)
        self._last_ns, self._last = int(t_ns[-1]), positions[:, -1:]
        known = (steps_ns > 0) & (steps_ns <= LONGEST_STEP_NS)
        steps_s = np.where(known, steps_ns, np.nan) / NS_PER_S
        with np.errstate(invalid="ignore", over="ignore"):
            steps = unwrapped(whole, self._binding.wraps_at, self._binding.turn)
            n_left, gains = self._binding.counts[0], self._binding.gains
            sides = zip(gains, (steps[:n_left], steps[n_left:]), strict=True)
            return np.stack([gain * side.mean(axis=0) / steps_s for gain, side in sides])


def unwrapped(positions: F64, wraps_at: float | None, turn: float | None) -> F64:
    """Differences (k, n − 1) of positions (k, n), the shorter way round where a position begins again.

    ``wraps_at``: a counter's range. ``turn``: one turn; positions that both lie within one turn and are more
    than half of one apart have begun again.
    """
    steps = np.diff(positions, axis=1)
    period = wraps_at or turn
    if period is None:
        return steps
    shorter = steps - period * np.rint(steps / period)
    if wraps_at is not None:
        return shorter
    inside = (positions >= WITHIN_ONE_TURN[0] * period) & (positions <= WITHIN_ONE_TURN[1] * period)
    return np.where(inside[:, 1:] & inside[:, :-1], shorter, steps)


def steps_of(binding: Binding) -> PositionSteps | None:
    """The stage that a binding's values need, or None."""
    wheels = wheels_of(binding)
    if not isinstance(wheels, PositionBinding):
        return None
    return PositionSteps(wheels, 2 if isinstance(binding, InputBinding) else 0)


def midway_of(t_ns: I64) -> I64:
    """Stamps (n,) of the middle of each interval that ends at a stamp; the first, and those behind a hole,
    stay.
    """
    steps_ns = np.diff(t_ns, prepend=t_ns[:1])
    return np.asarray(t_ns - np.where(steps_ns <= LONGEST_STEP_NS, steps_ns, 0) // 2)

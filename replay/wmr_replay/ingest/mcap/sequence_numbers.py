"""The sequence numbers that a writer gives to a channel's messages: do they count every message?"""

import numpy as np

from wmr_schemas.arrays import I64

_LEAST_MESSAGES, _NUMBERED_SHARE = 10, 0.9
_RANGE = 1 << 32


class SequenceNumbers:
    """Numbers of one channel in one file, in file order, block by block.

    Many writers leave them zero, or number the messages of each publisher: they count only where at least
    nine steps in ten are 1. A number that is wrong by itself, in the middle, changes nothing.
    """

    def __init__(self) -> None:
        self.n = self.n_next = 0
        self._first = self._last = 0

    def push(self, numbers: I64) -> None:
        """Take in the numbers (n,) of one block."""
        if not len(numbers):
            return
        steps = np.diff(numbers, prepend=self._last) if self.n else np.diff(numbers)
        self.n_next += int(np.count_nonzero(steps == 1))
        self._first = self._first if self.n else int(numbers[0])
        self._last = int(numbers[-1])
        self.n += len(numbers)

    @property
    def n_skipped(self) -> int:
        """Numbers without a message, below 0: messages without a number; 0 where they do not count."""
        if self.n < _LEAST_MESSAGES or self.n_next < _NUMBERED_SHARE * (self.n - 1):
            return 0
        ahead = (self._last - self._first - (self.n - 1)) % _RANGE
        return ahead - _RANGE if ahead >= _RANGE // 2 else ahead

    def describe(self) -> str:
        """What the numbers show, as a text; empty when they show nothing."""
        n = self.n_skipped
        if n > 0:
            return f"its sequence numbers skip {n}: as many messages are missing"
        return f"it has {-n} messages more than its sequence numbers count" if n else ""

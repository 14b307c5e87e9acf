"""Long steps between bins: the bank's work grows with their length, which a log may choose as it likes.

A step is filtered in pieces of ``longest_step_s``. A step of 60 s or more tells nothing about the motion in
it, so it counts as 60 s. What steps take beyond .25 s is limited to three hours in all; behind that the bank
starts again at every such step, which costs nothing and claims nothing.
"""

from dataclasses import dataclass, replace

import numpy as np

from wmr_schemas.arrays import F64

FREE_S = 0.25
"""A step up to this length is always taken. Speed: five pieces."""
LONGEST_S = 60.0
"""A longer step counts as this. Judgement: any velocity is forgotten by then."""
SPARE_S = 10_800.0
"""What steps may take beyond ``FREE_S`` in all. Speed: some seconds; four hours of a pose a second."""


@dataclass(frozen=True)
class LongSteps:
    """What is carried on: the last bin's time, what was cut out of the time so far, and what was spent."""

    last_s: float = 0.0
    removed_s: float = 0.0
    spent_s: float = 0.0

    def from_origin(self) -> "LongSteps":
        """The same behind a new start of the bank, from which time counts."""
        return LongSteps(spent_s=self.spent_s)

    def shorten(self, seconds: F64) -> tuple[F64, "LongSteps"]:
        """The bank's times (k,) of the bins at ``seconds`` (n,) up to one that is too far, and the state.

        Where no step is long, they are ``seconds`` to the bit.
        """
        steps = np.diff(seconds, prepend=self.last_s)
        if not len(steps) or steps.max() <= FREE_S:
            last_s = float(seconds[-1]) if len(steps) else self.last_s
            return seconds - self.removed_s, replace(self, last_s=last_s)
        taken = np.minimum(steps, LONGEST_S)
        spent = np.cumsum(np.concatenate([[self.spent_s], np.maximum(taken - FREE_S, 0.0)]))[1:]
        too_far = (spent > SPARE_S) & (steps > FREE_S)
        k = int(np.argmax(too_far)) if too_far.any() else len(steps)
        if k == 0:
            return seconds[:0], self
        removed = np.cumsum(np.concatenate([[self.removed_s], steps - taken]))[1:]
        state = LongSteps(float(seconds[k - 1]), float(removed[k - 1]), float(spent[k - 1]))
        return (seconds - removed)[:k], state

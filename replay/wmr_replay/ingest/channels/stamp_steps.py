"""The steps between the stamps of a channel: duplicates, backward steps, gaps, jitter."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.compiled.lean import lean

GAP_STEPS = 5
"""A step of more than so many usual ones is a gap."""
_N, _DUPLICATE, _BACKWARD, _GAP, _REGULAR = range(5)
_LAST, _LONGEST, _FURTHEST_BACK, _OFFSET_MIN, _OFFSET_MAX, _HIGHEST = range(6)
_UNKNOWN = np.iinfo(np.int64).min


@dataclass
class StampSteps:
    """Counters of one channel, carried on from block to block.

    Duplicates and backward steps are those of the file's order. Gaps and jitter are those of the order in
    time, as far as sorting each block restores it: from one stamp that is later than all before to the next.
    ``usual_ns`` is the median step of the first block that has any; jitter is the root mean square departure
    from it of the steps that are no gaps.
    """

    counts: I64 = field(default_factory=lambda: np.zeros(5, np.int64))
    extremes: I64 = field(
        default_factory=lambda: np.array([_UNKNOWN, 0, 0, np.iinfo(np.int64).max, _UNKNOWN, _UNKNOWN])
    )
    squares: F64 = field(default_factory=lambda: np.zeros(1))
    usual_ns: int = 0

    def push(self, t_ns: I64, log_ns: I64) -> None:
        """Stamps of one block, and the log times of the same messages."""
        n_backward = self.n_backward
        _follow(t_ns, log_ns, self.counts, self.extremes)
        ordered = t_ns if self.n_backward == n_backward else np.sort(t_ns)
        if not self.usual_ns and len(t_ns) > 1:
            steps = np.diff(ordered)
            self.usual_ns = int(np.median(steps[steps > 0])) if (steps > 0).any() else 0
        _advance(ordered, self.usual_ns, self.counts, self.extremes, self.squares)

    @property
    def n_duplicate(self) -> int:
        """Stamps that repeat the one before."""
        return int(self.counts[_DUPLICATE])

    @property
    def n_backward(self) -> int:
        """Stamps earlier than the one before."""
        return int(self.counts[_BACKWARD])

    @property
    def n_gaps(self) -> int:
        """StampSteps of more than GAP_STEPS usual ones."""
        return int(self.counts[_GAP])

    @property
    def furthest_back_s(self) -> float:
        """The largest backward step."""
        return float(self.extremes[_FURTHEST_BACK]) / NS_PER_S

    @property
    def longest_s(self) -> float:
        """The longest step."""
        return float(self.extremes[_LONGEST]) / NS_PER_S

    @property
    def jitter_s(self) -> float:
        """Root mean square departure of regular steps from the usual one."""
        n = int(self.counts[_REGULAR])
        return float(np.sqrt(self.squares[0] / n)) / NS_PER_S if n else 0.0

    def as_dict(self) -> dict[str, float]:
        """All of it, for the record."""
        return {
            "n_duplicate": self.n_duplicate,
            "n_backward": self.n_backward,
            "furthest_back_s": self.furthest_back_s,
            "n_gaps": self.n_gaps,
            "longest_step_s": self.longest_s,
            "jitter_s": self.jitter_s,
        }

    def describe(self) -> str:
        """What is out of the ordinary, for people; nothing when all is well."""
        found = []
        if self.n_duplicate:
            found.append(f"{self.n_duplicate} stamps repeat the one before")
        if self.n_backward:
            found.append(f"{self.n_backward} run backwards, by {self.furthest_back_s:.3g} s at most")
        if self.n_gaps:
            found.append(
                f"{self.n_gaps} gaps of more than {GAP_STEPS} steps, the longest {self.longest_s:.3g} s"
            )
        if self.usual_ns and self.jitter_s > 0.1 * self.usual_ns / NS_PER_S:
            found.append(
                f"steps of {self.usual_ns / 1e6:.3g} ms vary by {self.jitter_s * 1e3:.3g} ms (rms jitter)"
            )
        return "; ".join(found)


@lean
def _follow(t_ns: I64, log_ns: I64, counts: I64, extremes: I64) -> None:
    """Step by step in the file's order."""
    last = extremes[_LAST]
    for row in range(len(t_ns)):
        offset = t_ns[row] - log_ns[row]
        extremes[_OFFSET_MIN] = min(extremes[_OFFSET_MIN], offset)
        extremes[_OFFSET_MAX] = max(extremes[_OFFSET_MAX], offset)
        if last != _UNKNOWN and t_ns[row] == last:
            counts[_DUPLICATE] += 1
        elif last != _UNKNOWN and t_ns[row] < last:
            counts[_BACKWARD] += 1
            extremes[_FURTHEST_BACK] = max(extremes[_FURTHEST_BACK], last - t_ns[row])
        last = t_ns[row]
    counts[_N] += len(t_ns)
    extremes[_LAST] = last


@lean
def _advance(ordered: I64, usual_ns: int, counts: I64, extremes: I64, squares: Any) -> None:
    """Step by step in time, over what is later than everything before."""
    highest = extremes[_HIGHEST]
    for row in range(len(ordered)):
        if ordered[row] <= highest:
            continue
        step = ordered[row] - highest
        if highest == _UNKNOWN:
            pass
        elif usual_ns and step > GAP_STEPS * usual_ns:
            extremes[_LONGEST] = max(extremes[_LONGEST], step)
            counts[_GAP] += 1
        else:
            extremes[_LONGEST] = max(extremes[_LONGEST], step)
            counts[_REGULAR] += 1
            squares[0] += float(step - usual_ns) ** 2
        highest = ordered[row]
    extremes[_HIGHEST] = highest

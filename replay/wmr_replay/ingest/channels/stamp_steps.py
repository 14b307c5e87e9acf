"""Statistics of the steps between the stamps of a channel: duplicates, backward steps, gaps, jitter."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool

GAP_STEPS = 5
"""A step of more than so many usual ones is a gap."""
_TOLERANCE, _EVEN_SHARE = 0.25, 0.95
"""A channel is even when so many of its steps are the usual one, give or take a quarter of it."""


@dataclass
class StampSteps:
    """Counters of one channel, carried on from block to block.

    Duplicates and backward steps are those of the file's order. Gaps and jitter are those of the order in
    time, as far as sorting each block restores it: from one stamp that is later than all before to the next.
    ``usual_ns`` is the median step of the first block that has any; jitter is the root mean square departure
    from it of the steps that are no gaps.
    """

    n_duplicate: int = 0
    """Stamps that repeat the one before."""
    n_backward: int = 0
    """Stamps earlier than the one before."""
    n_gaps: int = 0
    """Steps of more than GAP_STEPS usual ones."""
    n_regular: int = 0
    """Steps forward that are no gaps."""
    n_even: int = 0
    """Steps that are the usual one, give or take a quarter."""
    n_double: int = 0
    """Steps of 2 to GAP_STEPS usual ones, give or take a quarter: messages are missing."""
    n_skipped: int = 0
    """Messages missing in them."""
    usual_ns: int = 0
    furthest_back_ns: int = 0
    longest_ns: int = 0
    squares_ns2: float = 0.0
    """Sum of the squared departures of regular steps from the usual one."""
    last_ns: int | None = None
    highest_ns: int | None = None

    def push(self, t_ns: I64) -> None:
        """Take in the stamps (n,) of one block."""
        if not len(t_ns):
            return
        steps = _steps(t_ns, self.last_ns)
        smallest = int(steps.min(initial=1))
        self.last_ns = int(t_ns[-1])
        if smallest <= 0:
            self.n_duplicate += int(np.count_nonzero(steps == 0))
            self.n_backward += int(np.count_nonzero(steps < 0))
            self.furthest_back_ns = max(self.furthest_back_ns, -smallest)
        ordered = np.sort(t_ns) if smallest < 0 else t_ns
        if not self.usual_ns and len(t_ns) > 1:
            forward = np.diff(ordered)
            forward = forward[forward > 0]
            self.usual_ns = int(np.median(forward)) if len(forward) else 0
        self._push_forward(self._forward(ordered, steps, smallest > 0))

    def _forward(self, ordered: I64, steps: I64, is_regular: bool) -> I64:
        """The steps from one stamp that is later than all before to the next; ``steps`` if all are such."""
        highest = self.highest_ns
        self.highest_ns = int(ordered[-1]) if highest is None else max(highest, int(ordered[-1]))
        if is_regular and (highest is None or ordered[0] > highest):
            return steps
        later = ordered if highest is None else ordered[ordered > highest]
        forward = _steps(later, highest)
        return forward[forward > 0]

    def _push_forward(self, steps: I64) -> None:
        """Count gaps, and the departures of the others from the usual step."""
        is_gap: Bool = steps > (GAP_STEPS * self.usual_ns if self.usual_ns else np.iinfo(np.int64).max)
        n_gaps = int(np.count_nonzero(is_gap))
        regular = steps[~is_gap] if n_gaps else steps
        self.n_gaps, self.n_regular = self.n_gaps + n_gaps, self.n_regular + len(regular)
        self.longest_ns = max(self.longest_ns, int(steps.max(initial=0)))
        self._push_even(regular)
        departures: F64 = (regular - self.usual_ns).astype(np.float64)
        self.squares_ns2 += float(departures @ departures)

    def _push_even(self, steps: I64) -> None:
        """Count the steps that are usual ones, and those that are multiples of it."""
        if not self.usual_ns:
            return
        usual, tolerance = self.usual_ns, int(_TOLERANCE * self.usual_ns)
        self.n_even += int(np.count_nonzero(np.abs(steps - usual) <= tolerance))
        longer = steps[steps >= 2 * usual - tolerance]
        if not len(longer):
            return
        multiples = (longer + usual // 2) // usual
        multiples = multiples[np.abs(longer - multiples * usual) <= tolerance]
        self.n_double += len(multiples)
        self.n_skipped += int(np.sum(multiples - 1))

    @property
    def is_even(self) -> bool:
        """Whether nearly all steps are the usual one, so that a longer one means a missing message."""
        return self.n_even >= _EVEN_SHARE * (self.n_regular + self.n_gaps) and self.n_even > 0

    def restart(self) -> None:
        """The next block does not follow on the last one: no step leads to it."""
        self.last_ns = self.highest_ns = None

    @property
    def furthest_back_s(self) -> float:
        """The largest backward step in s; 0 without one."""
        return self.furthest_back_ns / NS_PER_S

    @property
    def longest_s(self) -> float:
        """The longest step forward in s; 0 without one."""
        return self.longest_ns / NS_PER_S

    @property
    def jitter_s(self) -> float:
        """Root mean square departure of regular steps from the usual one."""
        return float(np.sqrt(self.squares_ns2 / self.n_regular)) / NS_PER_S if self.n_regular else 0.0

    def as_dict(self) -> dict[str, float]:
        """The counters by name, lengths in seconds."""
        return {
            "n_duplicate": self.n_duplicate,
            "n_backward": self.n_backward,
            "furthest_back_s": self.furthest_back_s,
            "n_gaps": self.n_gaps,
            "longest_step_s": self.longest_s,
            "jitter_s": self.jitter_s,
        }

    def describe(self) -> str:
        """What is out of the ordinary, as one line of text; empty when all is well."""
        found = []
        if self.n_duplicate:
            found.append(f"{self.n_duplicate} stamps repeat the one before")
        if self.n_backward:
            found.append(f"{self.n_backward} run backwards, by {self.furthest_back_s:.3g} s at most")
        if self.n_gaps:
            found.append(
                f"{self.n_gaps} gaps of more than {GAP_STEPS} steps, the longest {self.longest_s:.3g} s"
            )
        if self.n_skipped and self.is_even:
            found.append(
                f"{self.n_skipped} messages are missing by the usual step of {self.usual_ns / 1e6:.3g} ms"
            )
        if self.usual_ns and self.jitter_s > 0.1 * self.usual_ns / NS_PER_S:
            found.append(
                f"steps of {self.usual_ns / 1e6:.3g} ms vary by {self.jitter_s * 1e3:.3g} ms (rms jitter)"
            )
        return "; ".join(found)


def _steps(t_ns: I64, before_ns: int | None) -> I64:
    """Differences of stamps, the first from ``before_ns`` if that is known."""
    return np.diff(t_ns) if before_ns is None else np.diff(t_ns, prepend=before_ns)

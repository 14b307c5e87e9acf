"""Batches gathered into longer ones: what later stages do for every batch, they do less often."""

from collections.abc import Iterable, Iterator

from wmr_replay.ingest.reading import PARTS, joined
from wmr_schemas.batches import RawBatch

MOST_ROWS = 1 << 16
"""Rows of all signals in a batch. At one rate of pose and torques that is 32768 of each, as many as one pass
of the later stages takes.
"""


def gathered(batches: Iterable[RawBatch]) -> Iterator[RawBatch]:
    """The same rows in the same order, neighbouring batches joined up to ``MOST_ROWS`` rows."""
    held, n_held = list[RawBatch](), 0
    for batch in batches:
        n = n_rows(batch)
        if held and n_held + n > MOST_ROWS:
            yield whole(held)
            held, n_held = [], 0
        held.append(batch)
        n_held += n
    if held:
        yield whole(held)


def whole(batches: list[RawBatch]) -> RawBatch:
    """One batch of several; the batch itself where it is the only one."""
    return batches[0] if len(batches) == 1 else joined(batches)


def n_rows(batch: RawBatch) -> int:
    """Rows of all signals."""
    return sum(len(getattr(batch, name)) for name in PARTS)

"""A few stretches of neighbouring spans that stand for a log which is too large to be read at once."""

from collections.abc import Sequence

import numpy as np

from wmr_replay.ingest.mcap.chunk_index import ChunkIndex
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.prefetch import extent
from wmr_schemas.arrays import I64

WHOLE_BYTES = 64 << 20
"""Logs of so many bytes of records are read as a whole: that takes some tenths of a second."""
SAMPLED_BYTES = 32 << 20
LEAST_BYTES = 16 << 10
"""A span takes as long as so many bytes, however small it is."""
LARGEST_BYTES = 1 << 40
"""A damaged head may claim more."""
_PLACES = (0.0, 1.0, 0.5, 0.25, 0.75)
"""Where a stretch lies in the log, in the order of importance: start, end, middle, quarters."""
_PACKED_RATIO = 8
"""Chunks whose size is known packed alone count for so many times of it."""


def stretches(spans: Sequence[Span]) -> list[list[Span]]:
    """Runs of neighbouring spans in order, SAMPLED_BYTES together; all spans as one run if they are small.

    The first span is always among them, and the last where it fits into the limit.
    """
    sizes = np.maximum(_sizes(spans), LEAST_BYTES)
    total = int(sizes.sum())
    if total <= WHOLE_BYTES:
        return [list(spans)] if spans else []
    ends, share = np.cumsum(sizes), SAMPLED_BYTES // len(_PLACES)
    chosen, n_bytes = np.zeros(len(spans), np.bool_), 0
    for place in _PLACES:
        start = int(np.searchsorted(ends, place * (total - share), side="right"))
        stop = int(np.searchsorted(ends, place * (total - share) + share, side="left")) + 1
        run = slice(min(start, len(spans) - 1), stop)
        size = int(sizes[run][~chosen[run]].sum())
        if n_bytes and n_bytes + size > 2 * SAMPLED_BYTES:
            continue
        chosen[run] = True
        n_bytes += size
    breaks = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    return [list(spans[start:stop]) for start, stop in breaks.tolist()]


def _sizes(spans: Sequence[Span]) -> I64:
    """Bytes of records in each of n spans."""
    if isinstance(spans, ChunkIndex):
        unknown = spans.data_offset == spans.offset
        n_bytes = np.where(unknown, (spans.stored * _PACKED_RATIO).astype(np.uint64), spans.uncompressed)
        return np.minimum(n_bytes, np.uint64(LARGEST_BYTES)).astype(np.int64)
    sizes = (extent(span)[0] * (1 if span.head is not None else _PACKED_RATIO) for span in spans)
    return np.fromiter((min(size, LARGEST_BYTES) for size in sizes), np.int64, len(spans))

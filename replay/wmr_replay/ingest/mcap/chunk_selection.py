"""Selection of the spans to read: those that may hold a wanted channel within the wanted time.

The file's index is used only where its counts add up to the file's statistics; otherwise everything is read.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

from wmr_replay.ingest.mcap.chunk_index import ChunkIndex
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.message_counts import ChannelCount, MessageCounts
from wmr_replay.ingest.mcap.survey import Survey
from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS
from wmr_schemas.arrays import I64

_LAST_NS = np.iinfo(np.int64).max
"""A damaged file may name later times."""

_LATEST_NS = (1 << 63) - 1
"""The file's times have 64 bits without a sign, ours with one."""


def index_adds_up(found: Survey) -> bool:
    """Whether the message indexes count exactly the messages that the statistics count."""
    if found.statistics is None or found.truncated or found.n_chunks_damaged or found.notes:
        return False
    ids, n, _ = counts_of(found.spans)
    summed = np.bincount(ids, n, N_CHANNEL_IDS)
    return {int(k): int(summed[k]) for k in np.flatnonzero(summed)} == +Counter(found.statistics)


def counts_of(spans: Sequence[Span]) -> tuple[I64, I64, I64]:
    """Channel id, number of messages and ordinal of the span for each channel of each span."""
    if isinstance(spans, ChunkIndex):
        return spans.ids, spans.n, spans.ordinal
    ids = np.fromiter(chain.from_iterable(span.counts for span in spans), np.int64)
    n = np.fromiter(chain.from_iterable(span.counts.values() for span in spans), np.int64)
    sizes = np.fromiter((len(span.counts) for span in spans), np.int64, len(spans))
    return ids, n, np.repeat(np.arange(len(spans)), sizes)


def log_span_ns(found: Survey) -> tuple[int, int]:
    """The earliest and the latest log time in ns by the chunks' heads; zeros in an empty log."""
    if isinstance(found.spans, ChunkIndex):
        timed = found.spans.take(np.flatnonzero(found.spans.start_ns | found.spans.end_ns))
        return (int(timed.start_ns.min()), int(timed.end_ns.max())) if len(timed) else (0, 0)
    times = [span.times_ns for span in found.spans if span.times_ns and span.times_ns != (0, 0)]
    first_ns = min((start for start, _ in times), default=0)
    return first_ns, max((end for _, end in times), default=first_ns)


def kinds_of(spans: Sequence[Span]) -> Sequence[Span]:
    """Spans among which every kind of head is met: of an index in columns one with a head, one without."""
    if not isinstance(spans, ChunkIndex):
        return spans
    return [spans[int(k)] for k in np.unique(spans.data_offset == spans.offset, return_index=True)[1]]


def are_timed(spans: Sequence[Span]) -> bool:
    """Whether the times of all spans are known."""
    return isinstance(spans, ChunkIndex) or all(span.times_ns for span in spans)


def wanted_spans(
    found: Survey, channel_ids: set[int] | None, limits: tuple[int, int] | None
) -> Sequence[Span]:
    """The spans to read for some channel ids (None: all) between two log times in ns (None: no limits)."""
    if not index_adds_up(found):
        return found.spans
    if isinstance(found.spans, ChunkIndex):
        return _wanted_chunks(found.spans, channel_ids, limits)
    return [span for span in found.spans if _may_hold(span, channel_ids, limits)]


def _wanted_chunks(
    spans: ChunkIndex, channel_ids: set[int] | None, limits: tuple[int, int] | None
) -> ChunkIndex:
    """The chunks that may hold some channel ids between two log times."""
    wanted = np.ones(len(spans), np.bool_)
    if channel_ids is not None:
        wanted[:] = False
        wanted[spans.ordinal[np.isin(spans.ids, list(channel_ids))]] = True
    if limits is not None:
        start_ns, end_ns = times_of(spans).T
        wanted &= (start_ns <= limits[1]) & (end_ns >= limits[0])
    return spans if wanted.all() else spans.take(np.flatnonzero(wanted))


def times_of(spans: Sequence[Span]) -> I64:
    """First and last log time (n, 2) of spans that have them; later times than 64 bits with a sign can hold
    become the last of these.
    """
    if isinstance(spans, ChunkIndex):
        times_ns = np.stack([spans.start_ns, spans.end_ns], axis=1)
        return np.minimum(times_ns, np.uint64(_LAST_NS)).astype(np.int64)
    bounds = ((min(t_ns, _LAST_NS) for t_ns in span.times_ns or ()) for span in spans)
    return np.fromiter(chain.from_iterable(bounds), np.int64).reshape(-1, 2)


def indexed_counts(
    found: Survey, limits: tuple[int, int] | None, read: Mapping[int, ChannelCount]
) -> dict[int, ChannelCount]:
    """Messages by channel id according to the index, of spans between the limits.

    First and last times are those of the chunks that hold the channel, or of its messages where all
    of them were ``read``.
    """
    spans = wanted_spans(found, None, limits)
    if not isinstance(spans, ChunkIndex):
        spans = [span for span in spans if span.times_ns is not None]
    (ids, n, ordinal), times_ns = counts_of(spans), times_of(spans)
    met = MessageCounts()
    np.add.at(met.n, ids, n)
    np.minimum.at(met.first_ns, ids, times_ns[ordinal, 0])
    np.maximum.at(met.last_ns, ids, times_ns[ordinal, 1])
    counts = met.by_channel
    return {
        k: read[k] if k in read and read[k].n == count.n else count for k, count in counts.items() if count.n
    }


def estimated_counts(
    found: Survey, n_rows_read: int, read: Mapping[int, ChannelCount]
) -> dict[int, ChannelCount]:
    """Messages by channel id of a table of which ``n_rows_read`` rows were read, as many for each row."""
    share = sum(span.n_rows for span in found.spans) / max(n_rows_read, 1)
    return {
        k: ChannelCount(round(count.n * share), count.first_ns, count.last_ns) for k, count in read.items()
    }


def _may_hold(span: Span, channel_ids: set[int] | None, limits: tuple[int, int] | None) -> bool:
    """Whether a span may hold one of these channels between these log times."""
    if channel_ids is not None and not channel_ids & span.counts.keys():
        return False
    if limits is None or span.times_ns is None:
        return True
    return span.times_ns[0] <= limits[1] and span.times_ns[1] >= limits[0]

"""Selection of the spans to read: those that may hold a wanted channel within the wanted time.

The file's index is used only where its counts add up to the file's statistics; otherwise everything is read.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

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
    ids, n, _ = _columns(found.spans)
    summed = np.bincount(ids, n, N_CHANNEL_IDS)
    return {int(k): int(summed[k]) for k in np.flatnonzero(summed)} == +Counter(found.statistics)


def _columns(spans: Sequence[Span]) -> tuple[I64, I64, I64]:
    """Channel id, number of messages and ordinal of the span for each channel of each span."""
    ids = np.fromiter(chain.from_iterable(span.counts for span in spans), np.int64)
    n = np.fromiter(chain.from_iterable(span.counts.values() for span in spans), np.int64)
    sizes = np.fromiter((len(span.counts) for span in spans), np.int64, len(spans))
    return ids, n, np.repeat(np.arange(len(spans)), sizes)


def log_span_ns(found: Survey) -> tuple[int, int]:
    """The earliest and the latest log time in ns by the chunks' heads; zeros in an empty log."""
    times = [span.times_ns for span in found.spans if span.times_ns and span.times_ns != (0, 0)]
    first_ns = min((start for start, _ in times), default=0)
    return first_ns, max((end for _, end in times), default=first_ns)


def wanted_spans(found: Survey, channel_ids: set[int] | None, limits: tuple[int, int] | None) -> list[Span]:
    """The spans to read for some channel ids (None: all) between two log times in ns (None: no limits)."""
    if not index_adds_up(found):
        return found.spans
    return [span for span in found.spans if _may_hold(span, channel_ids, limits)]


def indexed_counts(
    found: Survey, limits: tuple[int, int] | None, read: Mapping[int, ChannelCount]
) -> dict[int, ChannelCount]:
    """Messages by channel id according to the index, of spans between the limits.

    First and last times are those of the chunks that hold the channel, or of its messages where all
    of them were ``read``.
    """
    spans = [span for span in wanted_spans(found, None, limits) if span.times_ns is not None]
    ids, n, ordinal = _columns(spans)
    bounds = ((min(t_ns, _LAST_NS) for t_ns in span.times_ns or ()) for span in spans)
    times_ns = np.fromiter(chain.from_iterable(bounds), np.int64).reshape(-1, 2)
    met = MessageCounts()
    np.add.at(met.n, ids, n)
    np.minimum.at(met.first_ns, ids, times_ns[ordinal, 0])
    np.maximum.at(met.last_ns, ids, times_ns[ordinal, 1])
    counts = met.by_channel
    return {
        k: read[k] if k in read and read[k].n == count.n else count for k, count in counts.items() if count.n
    }


def _may_hold(span: Span, channel_ids: set[int] | None, limits: tuple[int, int] | None) -> bool:
    """Whether a span may hold one of these channels between these log times."""
    if channel_ids is not None and not channel_ids & span.counts.keys():
        return False
    if limits is None or span.times_ns is None:
        return True
    return span.times_ns[0] <= limits[1] and span.times_ns[1] >= limits[0]

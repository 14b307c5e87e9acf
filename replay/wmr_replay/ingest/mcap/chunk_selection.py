"""Selection of the spans to read: those that may hold a wanted channel within the wanted time.

The file's index is used only where its counts add up to the file's statistics; otherwise everything is read.
"""

from collections import Counter

from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.survey import Survey

_LATEST_NS = (1 << 63) - 1
"""The file's times have 64 bits without a sign, ours with one."""


def index_adds_up(found: Survey) -> bool:
    """Whether the message indexes count exactly the messages that the statistics count."""
    if found.statistics is None or found.truncated or found.n_chunks_damaged or found.notes:
        return False
    counts = Counter[int]()
    for span in found.spans:
        counts.update(span.counts)
    return +counts == +Counter(found.statistics)


def first_log_ns(found: Survey) -> int:
    """The earliest log time in ns by the chunks' heads; 0 in an empty log."""
    starts = [span.times_ns[0] for span in found.spans if span.times_ns and span.times_ns != (0, 0)]
    return min(*starts, _LATEST_NS) if starts else 0


def wanted_spans(found: Survey, channel_ids: set[int] | None, limits: tuple[int, int] | None) -> list[Span]:
    """The spans to read for some channel ids (None: all) between two log times in ns (None: no limits)."""
    if not index_adds_up(found):
        return found.spans
    return [span for span in found.spans if _may_hold(span, channel_ids, limits)]


def _may_hold(span: Span, channel_ids: set[int] | None, limits: tuple[int, int] | None) -> bool:
    """Whether a span may hold one of these channels between these log times."""
    if channel_ids is not None and not channel_ids & span.counts.keys():
        return False
    if limits is None or span.times_ns is None:
        return True
    return span.times_ns[0] <= limits[1] and span.times_ns[1] >= limits[0]

"""Reading ahead: the next blocks are made ready by other threads while the present one is used."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from threading import local
from typing import TypeVar

from wmr_replay.ingest.mcap.chunks import OpenFile, Span
from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_replay.ingest.storage.source import LogPath

N_THREADS = 2
_N_AHEAD = 2
_GROUP_BYTES, _GROUP_MESSAGES = 8 << 20, 1 << 15
"""Spans are handed over together and become one batch: what Python does, it does once for all of them. More
messages than that take memory behind ingest, and save no time.
"""
_LARGE_BYTES = 32 << 20
"""A larger span is read by itself, so that one alone is in memory."""
_SMALL_MESSAGE_BYTES = 128

T = TypeVar("T")


def work_ahead(
    paths: Sequence[LogPath | Container],
    spans: Sequence[Span],
    work: Callable[[OpenFile, list[Span], Workspace], T],
) -> Iterator[T]:
    """``work(file, group, workspace)`` for all spans, by groups in order; at most two groups wait."""
    own = _PerThread(paths)

    def task(group: list[Span]) -> T:
        return work(own.file(group[0].file_index), group, own.workspace)

    with ThreadPoolExecutor(N_THREADS, "read-ahead") as workers:
        waiting: deque[Future[T]] = deque()
        try:
            for group in groups(spans):
                large = extent(group[0])[0] > _LARGE_BYTES
                while waiting and (large or len(waiting) > _N_AHEAD):
                    yield waiting.popleft().result()
                waiting.append(workers.submit(task, group))
                if large:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
            workers.shutdown()
            own.close()


def groups(spans: Sequence[Span]) -> Iterator[list[Span]]:
    """Neighbouring spans of a file, as many as keep within both bounds together, or a larger one alone."""
    group: list[Span] = []
    n_bytes, n_messages = 0, 0
    for span in spans:
        size, count = extent(span)
        full = n_bytes + size > _GROUP_BYTES or n_messages + count > _GROUP_MESSAGES
        if group and (full or span.file_index != group[0].file_index):
            yield group
            group, n_bytes, n_messages = [], 0, 0
        group.append(span)
        n_bytes, n_messages = n_bytes + size, n_messages + count
    if group:
        yield group


def extent(span: Span) -> tuple[int, int]:
    """Bytes of records and number of messages in a span; without an index, as many as messages of 128
    bytes.
    """
    size = span.head.uncompressed_bytes if span.head else span.data_bytes
    return size, sum(span.counts.values()) or size // _SMALL_MESSAGE_BYTES


class _PerThread:
    """What each thread has for itself: one open file of the log at a time, and a workspace."""

    def __init__(self, paths: Sequence[LogPath | Container]) -> None:
        self._paths, self._own, self._opened = paths, local(), list[OpenFile]()

    @property
    def workspace(self) -> Workspace:
        """The workspace of the calling thread."""
        if not hasattr(self._own, "workspace"):
            self._own.workspace = Workspace()
        workspace: Workspace = self._own.workspace
        return workspace

    def file(self, file_index: int) -> OpenFile:
        """That file of the log, opened by the calling thread for itself."""
        if getattr(self._own, "file_index", None) != file_index:
            if hasattr(self._own, "file"):
                self._own.file.close()
            self._own.file_index, self._own.file = file_index, self._paths[file_index].open("rb")
            self._opened.append(self._own.file)
        file: OpenFile = self._own.file
        return file

    def close(self) -> None:
        """Close the files of every thread."""
        for file in self._opened:
            file.close()

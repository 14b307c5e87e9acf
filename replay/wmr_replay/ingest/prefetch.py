"""Reading ahead: the next blocks are made ready by other threads while the present one is used."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from threading import local
from typing import BinaryIO, TypeVar

from wmr_replay.ingest.chunks import Span
from wmr_replay.ingest.source import LogPath

N_THREADS = 2
_N_AHEAD = 4

T = TypeVar("T")


def work_ahead(
    paths: Sequence[LogPath], spans: Sequence[Span], work: Callable[[BinaryIO, Span], T]
) -> Iterator[T]:
    """``work(file, span)`` of all spans, in their order; at most four results wait in memory."""
    own = _OwnFiles(paths)
    with ThreadPoolExecutor(N_THREADS, "read-ahead") as workers:
        waiting: deque[Future[T]] = deque()
        try:
            for span in spans:
                waiting.append(workers.submit(lambda span: work(own.file(span.part), span), span))
                if len(waiting) > _N_AHEAD:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
            workers.shutdown()
            own.close()


class _OwnFiles:
    """The log's files, opened by each thread for itself, one at a time."""

    def __init__(self, paths: Sequence[LogPath]) -> None:
        self._paths, self._own, self._opened = paths, local(), list[BinaryIO]()

    def file(self, part: int) -> BinaryIO:
        """The calling thread's."""
        if getattr(self._own, "part", None) != part:
            if hasattr(self._own, "file"):
                self._own.file.close()
            self._own.part, self._own.file = part, self._paths[part].open("rb")
            self._opened.append(self._own.file)
        file: BinaryIO = self._own.file
        return file

    def close(self) -> None:
        """Close every thread's."""
        for file in self._opened:
            file.close()

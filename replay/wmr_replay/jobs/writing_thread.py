"""A thread that writes, or counts, while the next rows are computed.

Parquet, Rerun and polars leave Python's lock to other threads, and so do the kernels. On two cores the
shorter of writing and computing is done within the time of the longer.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from typing import TypeVar

T = TypeVar("T")


class WritingThread:
    """Makes the calls that it is handed one by one, in their order, in a thread of its own.

    An error of a call is raised by the next :meth:`call`, or by :meth:`finish`. One call is under way at
    most: more would hold more rows in memory, and save no time where each takes less than computing its rows.
    """

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "write")
        self._thread.submit(int).result()  # begun before a call is: an interrupted start would begin another
        self._under_way: Future[None] | None = None
        self._ended = False

    def call(self, function: Callable[[T], None], rows: T) -> None:
        """Begin ``function(rows)`` once the call before has ended."""
        self._wait()
        self._under_way = self._thread.submit(function, rows)

    def finish(self) -> None:
        """Wait for the last call, and end the thread."""
        self._wait()
        self._ended = True
        self._thread.shutdown()

    def stop(self) -> None:
        """End the thread once the call under way has ended, whatever comes of it.

        Interruptions do not cut this short: a file that a call writes to cannot be removed before. One may
        have come before the call under way was known, and a join that is interrupted takes the thread for
        ended. So a last call, of nothing, is waited for.
        """
        while not self._ended:
            with suppress(KeyboardInterrupt):
                wait([self._thread.submit(int)])
                self._ended = True
        self._thread.shutdown(wait=False)

    def _wait(self) -> None:
        """Wait for the call under way; raises its error."""
        if self._under_way is not None:
            self._under_way.result()
        self._under_way = None

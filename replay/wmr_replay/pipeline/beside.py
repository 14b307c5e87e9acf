"""Work in a thread beside the caller's: the identifier, whose kernel leaves Python's lock to others."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")
LEAST_ROWS = 2048
"""Fewer rows take less time than is worth a thread: some .1 ms."""


class Beside:
    """Runs one call at a time in a thread of its own. The thread begins with the first long call."""

    def __init__(self) -> None:
        self._thread: ThreadPoolExecutor | None = None

    def begin(self, function: Callable[[T], R], rows: T, n: int) -> Callable[[], R]:
        """Begin ``function(rows)`` of n rows; what is returned waits for its answer, or raises its error."""
        if n < LEAST_ROWS:
            answer = function(rows)
            return lambda: answer
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, "beside")
        return self._thread.submit(function, rows).result

"""Processes of this machine, started afresh (spawn). One that dies takes its own task with it and no other.

The standard pool gives up altogether when a worker is killed, as the system does when memory runs out; here
the task's outcome is a :class:`Died`, and a new worker takes the place of the old one.
"""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

T = TypeVar("T")

_CONTEXT = multiprocessing.get_context("spawn")
_STOP_S = 5.0


@dataclass(frozen=True)
class Died:
    """What is left of a task whose worker died: the process' exit code, negative for a signal."""

    exit_code: int | None

    def __str__(self) -> str:
        if self.exit_code == -signal.SIGKILL:
            return "its worker was killed (SIGKILL): perhaps memory ran out; fewer --jobs need less"
        if self.exit_code is not None and self.exit_code < 0:
            return f"its worker was ended by signal {-self.exit_code}"
        return f"its worker ended with exit code {self.exit_code}"


class Pool(Generic[T]):
    """``map(function, tasks)`` yields (index, result or Died) as results come. A context manager: leaving it
    ends all workers, whatever they are doing.
    """

    def __init__(self, n_workers: int) -> None:
        self._n = n_workers
        self._workers: list[_Worker] = []

    def __enter__(self) -> "Pool[T]":
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers:
            worker.kill()
        self._workers.clear()

    def map(
        self, function: Callable[..., T], tasks: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, T | Died]]:
        """Call ``function(*task)`` for every task."""
        waiting = deque(enumerate(tasks))
        busy: dict[int, _Worker] = {}
        while waiting or busy:
            while waiting and len(busy) < self._n:
                index, task = waiting.popleft()
                busy[index] = self._idle(busy)
                busy[index].give(function, task)
            done = wait([worker.ready for worker in busy.values()])
            for index in [k for k, worker in busy.items() if worker.ready in done]:
                yield index, self._taken(busy.pop(index))

    def _idle(self, busy: dict[int, "_Worker"]) -> "_Worker":
        taken = {id(worker) for worker in busy.values()}
        free = [worker for worker in self._workers if id(worker) not in taken]
        if not free:
            free = [_Worker()]
            self._workers += free
        return free[0]

    def _taken(self, worker: "_Worker") -> T | Died:
        """A worker's result; a worker that died is removed from the pool."""
        try:
            result: T = worker.ready.recv()
        except (EOFError, OSError):
            self._workers.remove(worker)
            return Died(worker.buried())
        return result


class _Worker:
    """A process and the end of its pipe that becomes ready with a result, or when it dies."""

    def __init__(self) -> None:
        self.ready, theirs = _CONTEXT.Pipe()
        self._process = _CONTEXT.Process(target=_serve, args=(theirs,), daemon=True)
        with _deaf_to_interrupts():
            self._process.start()
        theirs.close()

    def give(self, function: Callable[..., Any], task: tuple[Any, ...]) -> None:
        """Send a task; that a worker is dead already shows when its pipe is read."""
        with suppress(OSError):
            self.ready.send((function, task))

    def kill(self) -> None:
        """End the process now."""
        self._process.kill()
        self.buried()

    def buried(self) -> int | None:
        """The exit code of a process that is about to end."""
        self._process.join(_STOP_S)
        self.ready.close()
        return self._process.exitcode


class _deaf_to_interrupts:  # noqa: N801 – read as a phrase
    """A child inherits ignored signals: Ctrl-C then reaches the parent alone, which ends its children."""

    def __enter__(self) -> None:
        self._main = threading.current_thread() is threading.main_thread()
        self._before = signal.signal(signal.SIGINT, signal.SIG_IGN) if self._main else None

    def __exit__(self, *_: object) -> None:
        if self._main:
            signal.signal(signal.SIGINT, self._before)


def _serve(pipe: "Connection[Any, Any]") -> None:
    """The loop of a worker process: tasks until the pipe ends. It does not outlive its parent."""
    os.environ["POLARS_MAX_THREADS"] = "1"  # sums must not depend on how many cores there are
    threading.Thread(target=_die_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            function, task = pipe.recv()
            pipe.send(function(*task))


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
    os._exit(1)

"""Sort rows of several signals by their stamps, within a stated window.

Channels of one log are interleaved by the time of recording, which differs from the time of measurement by
transport delays. A row is handed on once some row of the log is stamped ``window_ns`` later; a row that comes
later still is left out and counted. Both rules look at file order alone, so the batches in which a file is
read change nothing.
"""

import numpy as np

from wmr_schemas.arrays import I64, Bool
from wmr_schemas.batches import RawBatch, Rows

EARLIEST = np.iinfo(np.int64).min


class Reorder:
    """Stage: raw batches in file order → batches sorted and complete up to a common stamp."""

    def __init__(self, window_ns: int) -> None:
        self.window_ns = window_ns
        self._newest_ns = EARLIEST
        self._held: tuple[Rows, ...] | None = None
        self.n_late = [0, 0, 0, 0]
        """Rows left out because they came later than the window allows: pose, torque, mode, wheel speeds."""

    def push(self, batch: RawBatch) -> RawBatch:
        """Take a batch in; give back every row that can have no predecessor any more."""
        arrivals = (batch.pose, batch.torque, batch.mode, batch.wheels)
        keep = self._in_time(arrivals)
        for k, mask in enumerate(keep):
            self.n_late[k] += int(np.count_nonzero(~mask))
        arrived = tuple(take(rows, mask) for rows, mask in zip(arrivals, keep, strict=True))
        held = arrived if self._held is None else tuple(map(join, self._held, arrived))
        limit = self._newest_ns - self.window_ns if self._newest_ns > EARLIEST else EARLIEST
        parts = [divide(rows, limit) for rows in held]
        self._held = tuple(later for _, later in parts)
        return sorted_batch([ready for ready, _ in parts])

    def finish(self) -> RawBatch:
        """All rows that were held back, by stamp."""
        held = self._held or (Rows.empty(3), Rows.empty(4), Rows.empty(1), Rows.empty(2))
        self._held = None
        return sorted_batch([sort(rows) for rows in held])

    def _in_time(self, signals: tuple[Rows, ...]) -> tuple[Bool, ...]:
        """Mask of the rows that came in time, in file order: within the window of the newest stamp before."""
        stamps = np.concatenate([rows.t_ns for rows in signals])
        if not stamps.size:
            return tuple(np.ones(0, bool) for _ in signals)
        by_file = np.argsort(np.concatenate([rows.order for rows in signals]), kind="stable")
        newest = np.maximum(np.maximum.accumulate(stamps[by_file]), self._newest_ns)
        before = np.concatenate([[self._newest_ns], newest[:-1]])
        in_time = np.empty(stamps.size, bool)
        in_time[by_file] = (before == EARLIEST) | (stamps[by_file] >= before - self.window_ns)
        self._newest_ns = int(newest[-1])
        ends = np.cumsum([len(rows) for rows in signals])[:-1]
        return tuple(np.split(in_time, ends))


def sorted_batch(signals: list[Rows]) -> RawBatch:
    """Pose, torque, mode and wheel speeds as a batch."""
    return RawBatch(*signals[:3], wheels=signals[3])


def take(rows: Rows, index: Bool | I64) -> Rows:
    """The rows of a mask or of indices; all of them as they are."""
    if index.dtype == bool and index.all():
        return rows
    return Rows(rows.t_ns[index], rows.order[index], rows.values[:, index])


def join(first: Rows, second: Rows) -> Rows:
    """Two batches of rows, one after the other."""
    if not len(first) or not len(second):
        return first if len(first) else second
    return Rows(
        np.concatenate([first.t_ns, second.t_ns]),
        np.concatenate([first.order, second.order]),
        np.concatenate([first.values, second.values], axis=1),
    )


def in_order(rows: Rows) -> bool:
    """Whether the stamps strictly increase."""
    return bool((rows.t_ns[1:] > rows.t_ns[:-1]).all())


def divide(rows: Rows, limit_ns: int) -> tuple[Rows, Rows]:
    """The rows stamped before a limit, by stamp, and the others, as they came."""
    if in_order(rows):
        n = int(np.searchsorted(rows.t_ns, limit_ns))
        return between(rows, slice(n)), between(rows, slice(n, None))
    early = np.asarray(rows.t_ns < limit_ns)
    return sort(take(rows, early)), take(rows, ~early)


def between(rows: Rows, part: slice) -> Rows:
    """Consecutive rows of a slice, as a view."""
    return Rows(rows.t_ns[part], rows.order[part], rows.values[:, part])


def sort(rows: Rows) -> Rows:
    """Rows by stamp, ties in file order."""
    return rows if in_order(rows) else take(rows, np.lexsort((rows.order, rows.t_ns)))

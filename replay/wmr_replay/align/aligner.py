"""One row per pose sample: the pose, the mean inputs of the interval that it ends, and the true mode."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.align.batch import SampleBatch
from wmr_replay.align.hold import hold_mean, last_before
from wmr_replay.align.reorder import EARLIEST, Reorder, between, join, take
from wmr_schemas.absurd import without_absurd
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S
from wmr_schemas.batches import RawBatch, Rows


@dataclass
class AlignmentCounts:
    """What alignment used and what it left out."""

    n_pose: int = 0
    n_torque: int = 0
    n_pose_duplicate: int = 0
    n_pose_backward: int = 0
    n_pose_not_finite: int = 0
    n_torque_duplicate: int = 0
    n_torque_backward: int = 0


class Held:
    """One signal's input in force, and its rows that belong to later intervals."""

    def __init__(self, n_columns: int) -> None:
        self.waiting = Rows.empty(n_columns)
        self.values, self.t_ns = np.full(n_columns, np.nan), EARLIEST
        self.seen = False
        """Whether any row has come."""


class Aligner:
    """Stage: raw batches → aligned rows, which depend neither on later stamps nor on the batches."""

    def __init__(self, *, reorder_window_s: float = 2.0, max_hold_s: float = 1.0) -> None:
        self.counts = AlignmentCounts()
        self._reorder = Reorder(round(reorder_window_s * NS_PER_S))
        self._max_hold_ns = round(max_hold_s * NS_PER_S)
        self._inputs, self._wheels, self._modes = Held(4), Held(2), Rows.empty(1)
        self._mode = -1.0
        self._last_ns, self._yaw, self._turns = EARLIEST, np.nan, 0

    def push(self, batch: RawBatch) -> SampleBatch:
        """Rows that are complete: every input up to their stamps has come."""
        return self._align(self._reorder.push(batch))

    def finish(self) -> SampleBatch:
        """The rows that were still held back, at the end of the log."""
        return self._align(self._reorder.finish())

    def _align(self, ready: RawBatch) -> SampleBatch:
        """Sorted signals → one row per pose sample."""
        pose = self._clean_pose(ready.pose)
        inputs = self._hold(pose.t_ns, self._clean_torque(ready.torque), self._inputs)
        if self._wheels.seen or len(ready.wheels):
            inputs = self._with_wheels(inputs, pose.t_ns, ready.wheels)
        mode_true = self._truth(pose.t_ns, ready.mode)
        self.counts.n_pose += len(pose)
        if len(pose):
            self._last_ns = int(pose.t_ns[-1])
        return SampleBatch.measured(pose.t_ns, pose.values, inputs, mode_true)

    def _clean_pose(self, rows: Rows) -> Rows:
        """Rows without NaN, absurd numbers and repeated stamps, the yaw unwrapped; losses are counted."""
        finite = np.asarray(np.isfinite(without_absurd(rows.values)).all(axis=0))
        self.counts.n_pose_not_finite += int(np.count_nonzero(~finite))
        self.counts.n_pose_backward = self._reorder.n_late[0]
        rows = take(rows, finite)
        first = np.asarray(np.diff(rows.t_ns, prepend=EARLIEST) != 0)
        self.counts.n_pose_duplicate += int(np.count_nonzero(~first))
        rows = take(rows, first)
        return Rows(rows.t_ns, rows.order, np.stack([*rows.values[:2], self._unwrap(rows.values[2])]))

    def _unwrap(self, yaw: F64) -> F64:
        """Yaw without steps of a turn: yaw + 2π·(whole turns counted so far)."""
        if not yaw.size:
            return yaw
        steps = np.diff(yaw, prepend=yaw[0] if np.isnan(self._yaw) else self._yaw)
        turns = self._turns - np.cumsum(np.rint(steps / (2 * np.pi)).astype(np.int64))
        self._yaw, self._turns = float(yaw[-1]), int(turns[-1])
        return yaw + 2 * np.pi * turns

    def _clean_torque(self, rows: Rows) -> Rows:
        """The first row of each stamp, absurd numbers unknown; repeated and late ones are counted."""
        first = np.asarray(np.diff(rows.t_ns, prepend=EARLIEST) != 0)
        self.counts.n_torque_duplicate += int(np.count_nonzero(~first))
        self.counts.n_torque_backward = self._reorder.n_late[1]
        rows = take(rows, first)
        self.counts.n_torque += len(rows)
        return Rows(rows.t_ns, rows.order, without_absurd(rows.values))

    def _hold(self, pose_ns: I64, arrived: Rows, signal: Held) -> F64:
        """Mean inputs (k, n) of the intervals that end at the pose stamps; later inputs are held back."""
        rows = join(signal.waiting, arrived)
        if not pose_ns.size:
            signal.waiting = rows
            return np.empty((len(signal.values), 0))
        before_ns = int(pose_ns[0]) if self._last_ns == EARLIEST else self._last_ns
        means, signal.t_ns, used = hold_mean(
            pose_ns, before_ns, rows.t_ns, rows.values, signal.t_ns, signal.values, self._max_hold_ns
        )
        signal.waiting = between(rows, slice(used, None))
        return means

    def _with_wheels(self, inputs: F64, pose_ns: I64, arrived: Rows) -> F64:
        """The inputs with the wheel speeds of a channel of their own, where these are known."""
        self._wheels.seen = True
        first = np.asarray(np.diff(arrived.t_ns, prepend=EARLIEST) != 0)
        rows = take(arrived, first)
        means = self._hold(pose_ns, Rows(rows.t_ns, rows.order, without_absurd(rows.values)), self._wheels)
        return np.concatenate([inputs[:2], np.where(np.isnan(means), inputs[2:], means)])

    def _truth(self, pose_ns: I64, arrived: Rows) -> I8:
        """The mode in force at each pose stamp, (n,), −1 where there is none."""
        rows = join(self._modes, arrived)
        mode, used = last_before(pose_ns, rows.t_ns, rows.values[0], self._mode)
        if used:
            self._mode = float(rows.values[0, used - 1])
        self._modes = between(rows, slice(used, None))
        return np.where((mode >= 0) & (mode <= 3), mode, -1).astype(np.int8)

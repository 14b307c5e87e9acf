"""The batch that travels from alignment to the tables: one row per pose sample."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, Bool
from wmr_schemas.status import Status


@dataclass(frozen=True, eq=False)
class SampleBatch:
    """Pose samples in strictly increasing time, with the inputs and the truth that belong to them.

    ``t_ns`` (n,) are the stamps. ``pose_raw`` (3, n) is x, y in m and yaw in rad as measured, the yaw
    unwrapped. ``pose`` (3, n) is the repaired pose: jumps are taken out; before the repair it equals
    ``pose_raw``. ``inputs`` (4, n) are left and right effort in N·m and left and right wheel speed in rad/s,
    each the mean over the interval that ends at the row's stamp, NaN where unknown. ``mode_true`` (n,) is −1
    without a truth. ``repair`` (n,) is the repair's status of each row: ``OK``, ``OUTLIER``,
    ``POSE_JUMP``, or ``GAP`` where the sender repeated a frozen pose.
    """

    t_ns: I64
    pose_raw: F64
    pose: F64
    inputs: F64
    mode_true: I8
    repair: I8

    def __len__(self) -> int:
        """Number of rows, n."""
        return len(self.t_ns)

    @classmethod
    def measured(cls, t_ns: I64, pose: F64, inputs: F64, mode_true: I8) -> "SampleBatch":
        """Rows before the repair: every row is kept and no pose is changed."""
        return cls(t_ns, pose, pose, inputs, mode_true, np.full(len(t_ns), Status.OK, np.int8))

    @cached_property
    def kept(self) -> Bool:
        """Mask (n,) of the rows whose pose is a measurement: no outlier, and not frozen."""
        return np.asarray((self.repair != Status.OUTLIER) & (self.repair != Status.GAP))

    @property
    def frozen(self) -> Bool:
        """Mask (n,) of the rows that repeat a frozen pose."""
        return np.asarray(self.repair == Status.GAP)

    @cached_property
    def restarts(self) -> Bool:
        """Mask (n,) of the rows before which the pose has jumped; no window may reach back behind them."""
        return np.asarray(self.repair == Status.POSE_JUMP)

    def part(self, index: slice | I64 | Bool) -> "SampleBatch":
        """The rows of a slice (as views), of indices or of a mask."""
        return SampleBatch(*(getattr(self, field.name)[..., index] for field in fields(self)))

    def without_outliers(self) -> "SampleBatch":
        """The rows of the mask ``kept``; the batch itself where all are kept."""
        kept = self.kept
        return self if kept.all() else self.part(kept)


def concatenate(batches: Sequence[SampleBatch]) -> SampleBatch:
    """Consecutive batches as one. Raises ValueError for an empty sequence."""
    names = [field.name for field in fields(SampleBatch)]
    return SampleBatch(*(np.concatenate([getattr(b, name) for b in batches], axis=-1) for name in names))

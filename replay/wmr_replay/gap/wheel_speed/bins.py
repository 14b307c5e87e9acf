"""Bins of poses and blocks of bins: where errors are compared, and over what they are correlated."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.settings.wheel_speed import LayoutSettings
from wmr_replay.gap.wheel_speed.record import Record
from wmr_schemas.arrays import F64, I64, Bool


@dataclass(frozen=True, eq=False)
class Bins:
    """``start`` (n,) first pose of each bin, ``count`` (n,); ``t_s`` (n,) its mean time; ``table`` (K, B) the
    bins of each block, −1 behind its end; ``stretch`` (n,). Bins in no block are −1 in ``block_of`` (n,).
    """

    step_s: float
    start: I64
    count: I64
    t_s: F64
    stretch: I64
    table: I64
    block_of: I64

    @property
    def inside(self) -> Bool:
        """Places (K, B) of the table that hold a bin."""
        return self.table >= 0

    def mean(self, values: F64) -> F64:
        """Means over the bins (…, n) of values by pose (…, N)."""
        return np.add.reduceat(values, self.start, axis=-1) / self.count

    def blocks(self, values: F64) -> F64:
        """Values by bin (…, n) as blocks (…, K, B), 0 behind the end of a block."""
        return np.where(self.inside, values[..., np.maximum(self.table, 0)], 0.0)

    def flat(self, blocks: F64) -> F64:
        """Values by bin (…, n) from blocks (…, K, B), NaN where a bin is in no block."""
        out = np.full((*blocks.shape[:-2], len(self.start)), np.nan)
        out[..., self.table[self.inside]] = blocks[..., self.inside]
        return out


def bins_of(record: Record, settings: LayoutSettings, left_out: Bool | None = None) -> Bins:
    """The bins of a record; a block ends with its stretch, at an empty bin, and where poses are
    ``left_out`` (N,).
    """
    pose_step_s = float(np.median(np.diff(record.pose_s)))
    bin_s = max(settings.bin_s, pose_step_s)
    stretch = record.stretch_of_pose
    begin_s = record.pose_s[record.first_pose[:-1]]
    index = np.floor((record.pose_s - begin_s[stretch]) / bin_s + 1e-6).astype(np.int64)
    fresh = np.concatenate([[True], (np.diff(index) != 0) | (np.diff(stretch) != 0)])
    start = np.flatnonzero(fresh)
    count = np.diff(np.append(start, len(index)))
    usable = np.ones(len(start), bool)
    if left_out is not None:
        usable = np.add.reduceat(left_out.astype(np.int64), start) == 0
    size = max(round(settings.block_s / bin_s), settings.least_bins)
    table, block_of = blocks_of(index[start], stretch[start], usable, size, settings.least_bins)
    t_s = np.add.reduceat(record.pose_s, start) / count
    return Bins(bin_s, start, count, t_s, stretch[start], table, block_of)


def blocks_of(index: I64, stretch: I64, usable: Bool, size: int, least: int) -> tuple[I64, I64]:
    """Table (K, B) of the bins of each block, and the block (n,) of each bin.

    ``index`` (n,) counts bins in a stretch. Blocks of ``size`` bins begin at multiples of it in each stretch;
    B is the longest block's length.
    """
    broken = (np.diff(stretch) != 0) | (np.diff(index) != 1) | (np.diff(index // size) != 0)
    broken |= usable[1:] != usable[:-1]
    label = np.concatenate([[0], np.cumsum(broken)])
    lengths = np.bincount(label)
    kept = (lengths >= least) & usable[np.flatnonzero(np.concatenate([[True], broken]))]
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    block_of = number[label]
    begins = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    table = np.full((int(kept.sum()), int(lengths[kept].max(initial=0))), -1, np.int64)
    rows = np.flatnonzero(block_of >= 0)
    table[block_of[rows], rows - begins[label[rows]]] = rows
    return table, block_of

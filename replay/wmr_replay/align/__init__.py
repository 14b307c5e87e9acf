"""Alignment: one row per pose sample, with the mean inputs of the interval that ends at it.

The package imports numpy, numba and the schemas alone.
"""

from wmr_replay.align.aligner import Aligner, AlignmentCounts
from wmr_replay.align.batch import SampleBatch, concatenate
from wmr_replay.align.frozen import FrozenPose
from wmr_replay.align.lag import Lag
from wmr_replay.align.reorder import Reorder
from wmr_replay.align.repair import PoseRepair

__all__ = [
    "Aligner",
    "AlignmentCounts",
    "FrozenPose",
    "Lag",
    "PoseRepair",
    "Reorder",
    "SampleBatch",
    "concatenate",
]

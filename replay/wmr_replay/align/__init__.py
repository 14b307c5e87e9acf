"""Alignment: one row per pose sample, with the torques that were in force up to it."""

from wmr_replay.align.aligner import AlignedBatch, Aligner
from wmr_replay.align.lag import Lag
from wmr_replay.align.reorder import Reorder

__all__ = ["AlignedBatch", "Aligner", "Lag", "Reorder"]

"""Mode tracks with some modes replaced by others."""

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack


def without_skid(track: ModeTrack) -> ModeTrack:
    """The track with skidding replaced by ideal, and skidding and slipping by slipping."""
    mode = np.where(track.mode == ContactMode.SKIDDING, ContactMode.IDEAL, track.mode)
    mode = np.where(mode == ContactMode.SKIDDING_SLIPPING, ContactMode.SLIPPING, mode)
    return ModeTrack(track.t_ns, mode.astype(np.int8))


def with_mode_at(binned: BinnedLog, rows: Bool, mode: ContactMode) -> ModeTrack:
    """The binned log's modes with those of ``rows`` (n,) replaced by ``mode``."""
    return with_modes(binned, np.where(rows, mode, binned.mode))


def with_slipping(binned: BinnedLog, slips: Bool) -> ModeTrack:
    """The binned log's modes with slipping exactly at the rows ``slips`` (n,); skidding stays."""
    skids = np.where(binned.skids, ContactMode.SKIDDING, ContactMode.IDEAL)
    return with_modes(binned, np.where(slips, skids + ContactMode.SLIPPING, skids))


def with_modes(binned: BinnedLog, mode: F64 | I64) -> ModeTrack:
    """The modes (n,) of the binned log's rows."""
    t_ns = binned.start_ns + np.rint(binned.t_s * NS_PER_S).astype(np.int64)
    return ModeTrack(t_ns, mode.astype(np.int8))

"""Breaks: a log may hold several stretches that were not recorded in one go, such as steps of a calibration.

A break is the stamp of the first row of a stretch that does not follow on the one before it.
"""

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TypeVar

import numpy as np

from wmr_schemas.arrays import I64
from wmr_schemas.signals import CommandTrack, Log, ModeTrack, PoseTrack, TorqueTrack, WheelSpeedTrack

BREAKS_NAME, KEY = "wmr_replay_breaks", "breaks_ns"
"""The metadata record of a log that has breaks, and its key."""
MOST_BREAKS = 100_000
_LARGEST, _NUMBER = 2**63, re.compile(r"-?[0-9]{1,19}")

Track = TypeVar("Track", PoseTrack, TorqueTrack, WheelSpeedTrack, CommandTrack, ModeTrack)


def to_metadata(breaks_ns: tuple[int, ...]) -> dict[str, str]:
    """The metadata record that holds the breaks."""
    return {KEY: " ".join(map(str, breaks_ns))}


def from_metadata(record: Mapping[str, str]) -> tuple[int, ...]:
    """The breaks of an untrusted record, in order; none where it is damaged."""
    words = record.get(KEY, "").split(maxsplit=MOST_BREAKS)
    if len(words) > MOST_BREAKS or not all(_NUMBER.fullmatch(word) for word in words):
        return ()
    return tuple(sorted({t_ns for t_ns in map(int, words) if -_LARGEST <= t_ns < _LARGEST}))


def stretches(log: Log, hole_s: float | None = None) -> list[Log]:
    """The log by its stretches, each with its own rows of every signal and no break.

    With ``hole_s`` a stretch ends, too, where no pose follows within so many seconds. Stretches of fewer than
    two poses are left out. An input that was held at a break is unknown behind it.
    """
    starts = np.array(log.breaks_ns, np.int64)
    if hole_s is not None:
        later = np.flatnonzero(np.diff(log.pose.t_ns) > round(hole_s * 1e9)) + 1
        starts = np.union1d(starts, log.pose.t_ns[later])
    edges = [np.iinfo(np.int64).min, *starts.tolist(), np.iinfo(np.int64).max]
    parts = [_between(log, edges[k], edges[k + 1]) for k in range(len(edges) - 1)]
    return [part for part in parts if len(part.pose) > 1]


def _between(log: Log, start_ns: int, end_ns: int) -> Log:
    """Rows stamped from ``start_ns`` on and before ``end_ns``."""
    parts = {
        f.name: _rows(track, start_ns, end_ns)
        for f in fields(log)
        if f.name not in {"robot", KEY} and (track := getattr(log, f.name)) is not None
    }
    return replace(log, **parts, breaks_ns=())


def _rows(track: Track, start_ns: int, end_ns: int) -> Track:
    """Consecutive rows of a track, as views."""
    t_ns: I64 = track.t_ns
    rows = slice(*np.searchsorted(t_ns, [start_ns, end_ns]).tolist())
    return replace(track, **{f.name: getattr(track, f.name)[rows] for f in fields(track)})

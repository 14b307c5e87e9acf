"""Paths and URLs as a caller gives them."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from wmr_replay.ingest import LogPath, RemotePath, log_path
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import check_writable

LocalPlace: TypeAlias = str | os.PathLike[str]
"""A file or directory of this machine."""
Place: TypeAlias = LocalPlace | RemotePath
"""A file or directory of this machine, or a URL: as text (``s3://bucket/log.mcap``) or as ``URL``."""
URL = RemotePath

__all__ = [
    "URL",
    "LocalPlace",
    "LogPath",
    "Place",
    "check_writable",
    "home_of",
    "local_path",
    "place_of",
    "places_of",
]


def place_of(given: Place) -> LogPath:
    """A path or URL as the stages take it."""
    return given if isinstance(given, RemotePath) else log_path(os.fspath(given))


def places_of(given: Place | Sequence[Place]) -> tuple[LogPath, ...]:
    """One path or URL, or several, at least one. Raises InvalidSetting."""
    if isinstance(given, (str, os.PathLike, RemotePath)):
        return (place_of(given),)
    found = tuple(map(place_of, given))
    if not found:
        raise InvalidSetting("no log was named")
    return found


def local_path(given: LocalPlace) -> Path:
    """A path of this machine. Raises InvalidSetting for a URL."""
    place = place_of(given)
    if isinstance(place, RemotePath):
        raise InvalidSetting(f"{place} is a URL; results are written to a directory of this machine")
    return place


def home_of(target: Path) -> Path:
    """The directory of a file that is to be written. Raises InvalidSetting where there is none."""
    if not target.parent.is_dir():
        raise InvalidSetting(f"{target}: there is no directory {target.parent}; create it first")
    return target.parent

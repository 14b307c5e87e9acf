"""Resolves the places that a user names to logs: files, rosbag2 directories, globs, directories, URLs."""

import glob
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from wmr_replay.ingest import LogPath, RemotePath
from wmr_schemas.errors import InvalidSetting

ENDINGS = (".mcap", ".mcap.zst", ".db3", ".bag")
_BAG = "metadata.yaml"
_WILD = "*?["


def find_logs(places: Iterable[LogPath]) -> list[LogPath]:
    """The logs in the order of the places, those of a directory by name, none twice.

    A file that is named but does not exist stays in the list: it fails as a log. Raises InvalidSetting for a
    pattern or directory without any log.
    """
    found: dict[str, LogPath] = {}
    for place in places:
        logs = [log if isinstance(log, RemotePath) else log.absolute() for log in _expanded(place)]
        if not logs:
            raise InvalidSetting(f"{place}: no log found there ({', '.join(ENDINGS)} or a rosbag2 directory)")
        found |= {str(log): log for log in logs if str(log) not in found}
    return list(found.values())


def _expanded(place: LogPath) -> Iterator[LogPath]:
    if isinstance(place, RemotePath):
        yield from _remote(place)
    elif place.is_dir():
        yield from logs_below(place)
    elif not place.exists() and any(sign in str(place) for sign in _WILD):
        for match in sorted(glob.glob(str(place), recursive=True)):  # noqa: PTH207 – absolute patterns too
            yield from logs_at(Path(match))
    else:
        yield place


def logs_below(folder: Path) -> Iterator[Path]:
    """The logs of a directory and those below it; what a rosbag2 directory holds is one log."""
    if (folder / _BAG).is_file():
        yield folder
        return
    for entry in sorted(folder.iterdir()):
        if not entry.name.startswith("."):
            yield from logs_at(entry)


def logs_at(entry: Path) -> Iterator[Path]:
    """The logs at an entry of a directory: those below it, or the file itself if its name is a log's."""
    if entry.is_dir():
        yield from logs_below(entry)
    elif entry.name.endswith(ENDINGS):
        yield entry


def _remote(place: RemotePath) -> Iterator[LogPath]:
    """A remote folder's or pattern's logs; a web server has neither, so its URL is a log."""
    bare, star, rest = str(place).partition("*")
    if star:
        pattern = bare.rpartition("/")[2] + star + rest
        folder = RemotePath(bare.rpartition("/")[0])
        files = [file for file in folder.walk() if PurePosixPath(file.url).match(pattern)]
        yield from files
    elif place.is_dir():
        files = list(place.walk())
        bags = [file.url.removesuffix(f"/{_BAG}") for file in files if file.name == _BAG]
        yield from (RemotePath(bag) for bag in bags)
        yield from (f for f in files if f.name.endswith(ENDINGS) and not f.url.startswith(tuple(bags)))
    else:
        yield place

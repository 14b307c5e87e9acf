"""Which pair a comparison in a directory belongs to: that of another pair of the same name is not replaced.

A comparison is named after the log of its first side, so that ``a.mcap b.mcap`` and ``a.mcap c.mcap``, or one
log under other settings, want the same names. ``<stem>.compare.json`` says what was compared: the places with
their settings, and the hashes of the logs.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from wmr_replay.jobs.owner import same_place
from wmr_schemas.errors import InvalidSetting

ENDINGS = {"json": "compare.json", "timeline": "compare.rrd", "report": "compare.html"}


class OtherPair(InvalidSetting):
    """The ``directory`` holds the comparison of another pair of the same name."""

    def __init__(self, directory: Path, wanted: str, other: str) -> None:
        self.directory, self.wanted, self.other = directory, wanted, other
        super().__init__(
            f"{directory} holds the comparison of {other}, another pair than {wanted}; "
            "choose another place with --out DIR, or replace it with --force"
        )


@dataclass(frozen=True)
class Compared:
    """One of the two: its place with its settings, and what gives the hash of its log."""

    name: str
    sha256: Callable[[], str | None]


@dataclass(frozen=True)
class PairClaim:
    """A comparison of ``a`` and ``b`` that wants to write to a directory."""

    directory: Path
    stem: str
    a: Compared
    b: Compared

    def check(self, *, force: bool = False) -> None:
        """Raises OtherPair where the directory holds another pair's comparison, unless ``force`` is given."""
        stored = self.stored()
        if force or stored is None or all(map(self.is_same, (self.a, self.b), stored)):
            return
        raise OtherPair(
            self.directory, f"{self.a.name} and {self.b.name}", " and ".join(name for name, _ in stored)
        )

    def is_same(self, side: Compared, stored: tuple[str, str | None]) -> bool:
        """Whether a side is the stored one: at its place, or of its name and content."""
        name, sha256 = stored
        return same_place(name, side.name, self.directory) or (
            name == side.name and sha256 is not None and sha256 == side.sha256()
        )

    def stored(self) -> list[tuple[str, str | None]] | None:
        """Name and hash of the two whose comparison lies there; None where no file says so."""
        try:
            content = json.loads(self.file("json").read_text(encoding="utf-8"))
            hashes = content.get("log_sha256", {})
            return [(str(content[side]), hashes.get(side)) for side in ("a", "b")]
        except (OSError, ValueError, KeyError, AttributeError):
            return None

    def file(self, kind: str) -> Path:
        """Where a file of the comparison lies: ``json``, ``timeline`` or ``report``."""
        return self.directory / f"{self.stem}.{ENDINGS[kind]}"

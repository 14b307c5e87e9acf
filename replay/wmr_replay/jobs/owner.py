"""Which log the results in a directory belong to: those of another log of the same name are not replaced.

Results are named after the log's stem, so that ``monday/drive.mcap`` and ``tuesday/drive.mcap`` want the same
names. The files themselves say whose they are: by hash and path in ``summary.json`` and ``gap.json``, by hash
in ``model.toml``. A log is the same where its content is, or its path: one that was written again replaces
its results.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from wmr_replay.ingest import LogPath, sha256_of
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.files import check_writable
from wmr_schemas.text import encodable
from wmr_schemas.tomlfile import read_toml

RECORDS = ("summary.json", "gap.json")
MODEL = "model.toml"
HASH_SHOWN = 12
RUN_ENDINGS = (
    "summary.json",
    "summary.parquet",
    "segments.parquet",
    "confusion.parquet",
    "samples.parquet",
    "hindsight.parquet",
    "hindsight_segments.parquet",
    "rrd",
    "report.html",
)
GAP_ENDINGS = ("gap.json", "gap_traces.parquet", "gap_proof.parquet", "gap.rrd", "gap.html", MODEL)


class OtherLog(InvalidSetting):
    """The ``directory`` holds results of another log of the same name, ``other``."""

    def __init__(self, directory: Path, log: str, other: str) -> None:
        self.directory, self.log, self.other = directory, log, other
        super().__init__(
            f"{directory} holds results of {other}, another log than {log}; "
            "choose another place with --out DIR, or replace them with --force"
        )


@dataclass(frozen=True)
class Claim:
    """A log that wants to write to a directory. ``sha256`` is called where its path is not that of the files.

    ``models``: whether a model file is among what it writes.
    """

    directory: Path
    stem: str
    log: str
    sha256: Callable[[], str | None]
    models: bool = False

    @classmethod
    def of(cls, directory: Path, log: LogPath, *, models: bool = False) -> "Claim":
        """That of a log that has not been read yet."""
        return cls(directory, encodable(log.stem), encodable(log), lambda: sha256_of(log), models)

    def check(self) -> None:
        """Raises OtherLog where the directory holds results of another log of this name."""
        for file, name, recorded in owners(self.directory, self.stem, models=self.models):
            if name is not None and same_place(name, self.log, self.directory):
                return
            if recorded is None or recorded != self.sha256():
                content = f" (sha256 {recorded[:HASH_SHOWN]}…)" if recorded else ""
                raise OtherLog(self.directory, self.log, (name or str(file)) + content)

    def settled(self, *, force: bool) -> bool:
        """Whether another log's results are to be replaced; without ``force`` these raise OtherLog.

        Raises InvalidSetting where nothing can be written.
        """
        check_writable(self.directory)
        try:
            self.check()
        except OtherLog:
            if not force:
                raise
            return True
        return False

    def remove_others(self, written: Iterable[Path]) -> None:
        """Remove all results of this name but those just written: they are another log's."""
        kept = set(written)
        for ending in (*RUN_ENDINGS, *GAP_ENDINGS):
            file = self.directory / f"{self.stem}.{ending}"
            if file not in kept:
                file.unlink(missing_ok=True)


def owners(
    directory: Path, stem: str, *, models: bool = False
) -> Iterator[tuple[Path, str | None, str | None]]:
    """What the results of this name say of their log: (file, its path, its hash).

    A model states a hash at most, and counts with ``models`` where no other file says more.
    """
    found = False
    for ending in RECORDS:
        file = directory / f"{stem}.{ending}"
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(content, dict) and isinstance(content.get("log"), str):
            found = True
            yield file, content["log"], content.get("log_sha256")
    file = directory / f"{stem}.{MODEL}"
    if models and not found and file.is_file():
        yield file, None, model_sha256(file)


def model_sha256(file: Path) -> str | None:
    """The hash of the log that a model was fitted to."""
    try:
        provenance = read_toml(file).get("provenance")
    except InvalidFile:
        return None
    return provenance.get("log_sha256") if isinstance(provenance, dict) else None


def same_place(name: str, log: str, directory: Path) -> bool:
    """Whether a path in a result names this log.

    One that is not absolute counts from the directory of that call. This is taken to be the present one where
    the results lie below it, and is unknown elsewhere.
    """
    if "://" in log or "://" in name:
        return name == log
    recorded = Path(name)
    if not recorded.is_absolute() and not directory.resolve().is_relative_to(Path.cwd()):
        return False
    return recorded.resolve() == Path(log).resolve()


def outdated(directory: Path, stem: str, sha256: str | None) -> list[Path]:
    """Results of this name that were made of an earlier content of the log."""
    if sha256 is None:
        return []
    return [file for file, _, recorded in owners(directory, stem) if recorded and recorded != sha256]

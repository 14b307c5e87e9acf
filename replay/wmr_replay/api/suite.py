"""Named, versioned sets of synthetic logs: written, and checked against their manifest."""

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wmr_replay.api.places import LocalPlace, local_path
from wmr_replay.regress.decoded import first_difference
from wmr_schemas.errors import InvalidSetting
from wmr_synth.suites import (
    SUITES,
    LogSpec,
    Manifest,
    Suite,
    find_suite,
    read_manifest,
    read_suite,
    write_suite,
)

Progress = Callable[[int, int], None]
Announce = Callable[[str], Any]
"""Called with the name of each log as it is done."""
SAME_BYTES, SAME_COLUMNS = "same bytes", "other bytes, same columns within tolerance"
SAME = (SAME_BYTES, SAME_COLUMNS)


@dataclass(frozen=True, eq=False)
class WrittenSuite:
    """The answer of ``suite``: the manifest, and the logs that were whole already."""

    directory: Path
    manifest: Manifest
    kept: tuple[str, ...]

    @property
    def written(self) -> tuple[str, ...]:
        """Logs that were written now."""
        return tuple(log.name for log in self.manifest.suite.logs if log.name not in self.kept)

    @property
    def size_bytes(self) -> int:
        """All files of the suite."""
        names = (name for files in self.manifest.files.values() for name in files)
        return sum((self.directory / name).stat().st_size for name in names)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        suite = self.manifest.suite
        head = {"suite": suite.name, "version": suite.version, "seed": self.manifest.seed}
        return head | {
            "directory": str(self.directory),
            "written": list(self.written),
            "kept": list(self.kept),
        }


@dataclass(frozen=True)
class VerifiedSuite:
    """The answer of ``verify_suite``: how each log compares with the one written again."""

    directory: Path
    logs: dict[str, str]

    @property
    def n_same(self) -> int:
        """Logs of the same bytes, or of the same columns within rounding."""
        return sum(outcome in SAME for outcome in self.logs.values())

    @property
    def passed(self) -> bool:
        """Whether every log is what the manifest says."""
        return self.n_same == len(self.logs)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"directory": str(self.directory), "passed": self.passed, "logs": self.logs}


def suites() -> list[dict[str, Any]]:
    """Name, version, description and logs of every suite."""
    return [{**vars(suite), "logs": [log.name for log in suite.logs]} for suite in SUITES.values()]


def suite_of(name: LocalPlace) -> Suite:
    """One of ours by name, or that of a ``.toml`` file."""
    text = os.fspath(name)
    return read_suite(Path(text)) if text.endswith(".toml") else find_suite(text)


def suite(
    name: LocalPlace,
    out: LocalPlace,
    *,
    seed: int = 0,
    jobs: int | None = None,
    announce: Announce | None = None,
    progress: Progress | None = None,
) -> WrittenSuite:
    """Write a suite of synthetic logs into a directory, with a manifest. Logs that are whole are kept.

    Args:
        name: One of ``suites``, or a TOML file of your own.
        out: Directory of the logs.
        seed: Added to the seed of every log.
        jobs: Logs written at the same time; None: one per processor.
        announce: Called with the name of each log as it is done.
        progress: Called with messages written and messages in all.

    Raises:
        InvalidSetting: An unknown suite, or a directory that holds another one or cannot be written.
    """
    directory, kept = local_path(out), list[str]()

    def done(log: LogSpec, was_there: bool) -> None:
        kept.extend([log.name] if was_there else [])
        if announce is not None:
            announce(log.name)

    n_jobs = jobs or os.cpu_count() or 1
    try:
        manifest = write_suite(
            suite_of(name), directory, seed=seed, jobs=n_jobs, announce=done, progress=progress
        )
    except OSError as error:
        raise InvalidSetting(f"--out {directory}: cannot be written ({error.strerror or error})") from None
    return WrittenSuite(directory, manifest, tuple(kept))


def verify_suite(
    directory: LocalPlace,
    *,
    jobs: int | None = None,
    announce: Announce | None = None,
    progress: Progress | None = None,
) -> VerifiedSuite:
    """Write the suite of a directory's manifest again, elsewhere, and compare: bytes, else decoded columns.

    Raises InvalidSetting where there is no manifest.
    """
    folder = local_path(directory)
    manifest = manifest_of(folder)
    with tempfile.TemporaryDirectory(prefix="wmr-suite-") as elsewhere:
        again = write_suite(
            manifest.suite,
            Path(elsewhere),
            jobs=jobs or os.cpu_count() or 1,
            announce=lambda log, _: None if announce is None else announce(log.name),
            progress=progress,
        )
        logs = manifest.suite.logs
        found = {log.name: compared(log, manifest, again, folder, Path(elsewhere)) for log in logs}
    return VerifiedSuite(folder, found)


def manifest_of(folder: LocalPlace) -> Manifest:
    """A suite's manifest. Raises InvalidSetting where there is none."""
    manifest = read_manifest(local_path(folder))
    if manifest is None:
        raise InvalidSetting(f"--verify {folder}: there is no manifest.json; is it a suite's directory?")
    return manifest


def compared(log: LogSpec, manifest: Manifest, again: Manifest, directory: Path, elsewhere: Path) -> str:
    """How a log of ``directory`` compares with the same log written again ``elsewhere``."""
    if not manifest.is_whole(directory, log):
        return "changed: a file is missing, or is not what the manifest's sha256 says"
    if dict(again.files[log.name]) == dict(manifest.files[log.name]):
        return SAME_BYTES
    name = f"{log.name}.mcap"
    return first_difference(directory / name, elsewhere / name) or SAME_COLUMNS

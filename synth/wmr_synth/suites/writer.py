"""Writes suites: in parallel, under temporary names, the manifest last."""

import multiprocessing
import shutil
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import TypeAlias

import numpy as np

from wmr_schemas.errors import InvalidSetting
from wmr_synth.recorder import DEFAULT_CHUNK_BYTES, Progress, record, write_mcap
from wmr_synth.suites.damage import DAMAGES
from wmr_synth.suites.definition import LogSpec, Suite
from wmr_synth.suites.manifest import GENERATOR, MANIFEST, Manifest, read_manifest, sha256_of
from wmr_synth.synthesis import SimulatedLog

STAGING = ".suite.part"
"""Where a suite grows, inside its directory, until it is whole."""
Files: TypeAlias = dict[str, str]
"""Names of files and their sha256."""
Announce: TypeAlias = Callable[[LogSpec, bool], None]
"""Called with every log as it is done, and whether it was there already."""


def write_log(log: LogSpec, directory: Path, progress: Progress | None = None) -> Files:
    """Write one log of a suite, with its side files; their names and hashes."""
    simulated = log.simulated()
    path = directory / f"{log.name}.mcap"
    chunk_bytes = int(log.parameters.get("chunk_bytes", DEFAULT_CHUNK_BYTES))
    if log.damage is None:
        paths = record(
            simulated,
            path,
            encoding=log.encoding,
            truth=log.has_truth,
            mode_topic=bool(log.parameters.get("mode_topic", True)),
            chunk_bytes=chunk_bytes,
            progress=progress,
        )
    else:
        paths = (write_damaged(simulated, path, log, chunk_bytes),)
    return {path.name: sha256_of(path) or "" for path in paths}


def write_damaged(simulated: SimulatedLog, path: Path, log: LogSpec, chunk_bytes: int) -> Path:
    """Write the good log, then put the damaged one in its place."""
    angles = simulated.wheel_angles_rad
    write_mcap(simulated.log, path, encoding=log.encoding, angles=angles, chunk_bytes=chunk_bytes)
    damage = DAMAGES[log.damage or "none"]
    path.write_bytes(damage.apply(path.read_bytes(), np.random.default_rng(log.seed)))
    return path


def write_suite(
    suite: Suite,
    directory: Path,
    *,
    seed: int = 0,
    jobs: int = 1,
    announce: Announce | None = None,
    progress: Progress | None = None,
) -> Manifest:
    """Write ``suite`` into ``directory``; its manifest, which is written last.

    Logs that an earlier run of the same suite, seed and version left whole are kept. What is written appears
    when everything is complete; after an error or an interruption the directory is as it was. ``progress``
    counts messages; logs written in parallel count when they are done.

    Raises InvalidSetting where the directory holds another suite.
    """
    suite = suite.seeded(seed)
    before = earlier(suite, directory)
    same = before is not None and before.describes(suite, seed)
    kept = [log for log in suite.logs if same and before is not None and before.is_whole(directory, log)]
    missing = [log for log in suite.logs if log not in kept]
    report = Report(announce, progress, sum(log.n_messages for log in missing))
    files = {log.name: dict(before.files[log.name]) for log in kept if before is not None}
    for log in kept:
        report.done(log, was_there=True)
    with staging(directory) as stage:
        for log, written in written_logs(missing, stage, jobs, report):
            files[log.name] = written
        manifest = Manifest(suite, seed, GENERATOR, files)
        put_in_place(manifest, before, stage, directory)
    return manifest


def earlier(suite: Suite, directory: Path) -> Manifest | None:
    """The manifest that lies in the directory already; it must be of the same suite."""
    found = read_manifest(directory)
    if found is not None and found.suite.name != suite.name:
        raise InvalidSetting(
            f"{directory} holds the suite {found.suite.name}; give {suite.name} a directory of its own"
        )
    return found


class Report:
    """Tells how far the writing is."""

    def __init__(self, announce: Announce | None, progress: Progress | None, total: int) -> None:
        self._announce, self._progress = announce, progress
        self._n_done, self._total = 0, total

    def within(self, done: int, _: int) -> None:
        """``done`` messages of the log being written."""
        if self._progress is not None:
            self._progress(self._n_done + done, self._total)

    def done(self, log: LogSpec, *, was_there: bool = False) -> None:
        """A log is complete."""
        if not was_there:
            self._n_done += log.n_messages
            self.within(0, 0)
        if self._announce is not None:
            self._announce(log, was_there)


@contextmanager
def staging(directory: Path) -> Iterator[Path]:
    """A place inside the directory for incomplete files, removed in the end."""
    stage = directory / STAGING
    was_there = directory.is_dir()
    shutil.rmtree(stage, ignore_errors=True)
    stage.mkdir(parents=True)
    try:
        yield stage
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        if not was_there and not any(directory.iterdir()):
            directory.rmdir()


def put_in_place(manifest: Manifest, before: Manifest | None, stage: Path, directory: Path) -> None:
    """Give every new file its name, remove what the suite no longer holds, and write the manifest last."""
    text = manifest.to_json()
    path = directory / MANIFEST
    if path.is_file() and path.read_text(encoding="utf-8") == text and not any(stage.iterdir()):
        return
    path.unlink(missing_ok=True)
    for file in sorted(stage.iterdir()):
        file.replace(directory / file.name)
    wanted = {name for files in manifest.files.values() for name in files}
    stale = {name for files in before.files.values() for name in files} - wanted if before else set()
    for name in stale:
        (directory / name).unlink(missing_ok=True)
    (stage / MANIFEST).write_text(text, encoding="utf-8")
    (stage / MANIFEST).replace(path)


def written_logs(
    logs: list[LogSpec], stage: Path, jobs: int, report: Report
) -> Iterator[tuple[LogSpec, Files]]:
    """Every log with its files, as they are done: here with one job, else in processes of their own."""
    if min(jobs, len(logs)) <= 1:
        for log in logs:
            files = write_log(log, stage, report.within)
            report.done(log)
            yield log, files
        return
    with workers(min(jobs, len(logs))) as pool:
        longest_first = sorted(logs, key=lambda log: -log.n_messages)
        waiting = {pool.submit(write_log, log, stage): log for log in longest_first}
        for future in as_completed(waiting):
            report.done(waiting[future])
            yield waiting[future], future.result()


@contextmanager
def workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """A pool whose processes leave interruptions to this one, and which ends at once when the block fails."""
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=ignore_interrupts)
    try:
        yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def ignore_interrupts() -> None:
    """Ctrl-C reaches every process of a terminal; the one in front ends the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

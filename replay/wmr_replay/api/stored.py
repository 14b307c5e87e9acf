"""Results on disk as reports and pictures: what ``run`` and ``gap`` wrote, found by its name."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import polars as pl

from wmr_replay.api.compare import Comparison
from wmr_replay.api.gap import Gap
from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.result import Result
from wmr_replay.jobs.result_files import ENDINGS
from wmr_replay.jobs.run import write_report
from wmr_replay.report.gap import gap_page
from wmr_replay.report.run import RunTables
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file
from wmr_schemas.gap_file import read_gap

if TYPE_CHECKING:
    from wmr_replay.api.plots.figure import Figure

GAP_ENDING, TRACES_ENDING = ".gap.json", ".gap_traces.parquet"
PROOF_ENDING = ".gap_proof.parquet"
RUN_ENDING = f".{ENDINGS['summary']}"
Shown: TypeAlias = LocalPlace | Result | Gap
"""A result in memory, a file of a stored one (``<stem>.summary.parquet``, ``<stem>.gap.json``), or its
directory.
"""


@dataclass(frozen=True)
class StoredRun:
    """The files of a replay, by kind."""

    stem: str
    files: dict[str, Path]

    @property
    def tables(self) -> RunTables:
        """The tables."""
        return RunTables.of_files(self.files)


@dataclass(frozen=True)
class StoredGap:
    """The files of a gap analysis."""

    stem: str
    json: Path
    traces: Path


def report(result: Shown | Comparison, path: LocalPlace | None = None) -> Path:
    """Write a result as one HTML file to mail; the file.

    Args:
        result: A result of ``run``, ``gap`` or ``compare`` in memory, or the directory or a file of a stored
            one. Where a directory holds a replay and a gap analysis, the replay is meant.
        path: The file to write; for a stored result by default beside it, ``<stem>.report.html`` or
            ``<stem>.gap.html``.

    Raises:
        InvalidSetting: No result there, or several.
        MissingExtra: The extra ``report`` is not installed.
    """
    if isinstance(result, Result | Gap | Comparison):
        if path is None:
            raise InvalidSetting("a result in memory needs the path of its report")
        return result.report(path)
    found = stored_at(local_path(result))
    beside = found.files["summary"] if isinstance(found, StoredRun) else found.json
    ending = "report.html" if isinstance(found, StoredRun) else "gap.html"
    target = beside.with_name(f"{found.stem}.{ending}") if path is None else local_path(path)
    home_of(target)
    if isinstance(found, StoredRun):
        write_report(target, found.tables, found.stem)
        return target
    text = gap_page(
        read_gap(found.json), pl.read_parquet(found.traces, glob=False), found.stem, proof_beside(found.json)
    )
    with whole_file(target) as part:
        part.write_text(text, encoding="utf-8")
    return target


def proof_beside(json: Path) -> pl.DataFrame | None:
    """The paths on another log, where they lie beside gap.json."""
    file = json.with_name(json.name.removesuffix(GAP_ENDING) + PROOF_ENDING)
    return pl.read_parquet(file, glob=False) if file.exists() else None


def plot(result: Shown, path: LocalPlace | None = None) -> "Figure":
    """A result as a matplotlib figure, written to ``path`` (``.png``, ``.pdf``, ``.svg``) where one is given.

    Args:
        result: A result of ``run`` or ``gap`` in memory, or the directory or a file of a stored one.
        path: The picture to write; its ending names the format.

    Raises:
        InvalidSetting: No result there, or several; an ending that is no picture's.
        MissingExtra: The extra ``plot`` is not installed.
    """
    from wmr_replay.api.plots import check_target, gap_figure, tables_figure, write_figure  # noqa: PLC0415

    target = None if path is None else local_path(path)
    if target is not None:
        check_target(target)
    if isinstance(result, Result | Gap):
        figure = result.plot()
    else:
        found = stored_at(local_path(result))
        if isinstance(found, StoredRun):
            figure = tables_figure(found.tables, found.stem)
        else:
            figure = gap_figure(read_gap(found.json), pl.read_parquet(found.traces, glob=False), found.stem)
    if target is not None:
        write_figure(figure, target, dpi=150)
    return figure


def stored_at(place: Path) -> StoredRun | StoredGap:
    """The stored result at a place. Raises InvalidSetting where there is none, or more than one."""
    if not place.is_dir():
        found = stored_file(place)
        if found is None or not place.exists():
            raise InvalidSetting(
                f"{place} is no result: name a directory, a {RUN_ENDING[1:]} or a {GAP_ENDING[1:]}"
            )
        return found
    for ending in (RUN_ENDING, GAP_ENDING):
        files = sorted(place.glob(f"*{ending}"))
        if len(files) > 1:
            raise InvalidSetting(
                f"{place} holds {len(files)} results; name the file of one, such as {files[0]}"
            )
        if files and (only := stored_file(files[0])) is not None:
            return only
    raise InvalidSetting(f"{place} holds no result of run or gap")


def stored_file(file: Path) -> StoredRun | StoredGap | None:
    """The stored result that a file belongs to: one of a replay's tables, or a gap.json."""
    if file.name.endswith(GAP_ENDING):
        stem = file.name.removesuffix(GAP_ENDING)
        traces = file.with_name(stem + TRACES_ENDING)
        if not traces.exists():
            raise InvalidSetting(f"{file}: {traces.name} is not beside it; run `wmr-replay gap` once more")
        return StoredGap(stem, file, traces)
    for ending in ENDINGS.values():
        if file.name.endswith(f".{ending}"):
            stem = file.name.removesuffix(f".{ending}")
            files = {kind: file.with_name(f"{stem}.{name}") for kind, name in ENDINGS.items()}
            files = {kind: path for kind, path in files.items() if path.exists()}
            if {"summary", "samples"} <= set(files):
                return StoredRun(stem, files)
    return None

"""``wmr-replay gap`` and ``wmr-replay fit`` as functions: a log in, a verdict or a model out."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from wmr_replay.gap import GapOptions, GapResult, analyse, calibrate
from wmr_replay.ingest import Between
from wmr_replay.ingest.tracks import Progress, WholeLog, read_whole
from wmr_replay.jobs.base_model import base_for
from wmr_replay.jobs.gap_document import document_of
from wmr_replay.jobs.run import default_directory
from wmr_replay.tables import replace_files
from wmr_replay.timeline.gap.writer import write_gap_timeline
from wmr_schemas import __version__
from wmr_schemas.errors import InvalidSignal, LogUnusable
from wmr_schemas.gap_file import GapFile, gap_to_json
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model, Provenance, model_to_toml
from wmr_schemas.signals import Log

TRY_LONGER = (
    "A gap analysis needs a minute or so of driving with changes of speed and of yaw rate, poses and wheel "
    "torques throughout. `wmr-replay info {path}` says what the log holds."
)


@dataclass(frozen=True, eq=False)
class GapRun:
    """What a gap analysis wrote and found: ``files`` by kind, the contents of gap.json, the whole result."""

    files: dict[str, Path]
    document: GapFile
    result: GapResult
    log: Log


@dataclass(frozen=True, eq=False)
class FitRun:
    """The model file that a calibration wrote, and the model."""

    file: Path
    model: Model
    log: Log
    notes: tuple[str, ...]


def gap_log(  # noqa: PLR0913 – keyword arguments
    path: Path,
    out: Path | None = None,
    *,
    base: Model | None = None,
    options: GapOptions | None = None,
    mode_topic: str | None = None,
    mapping: LogMapping | None = None,
    between: Between | None = None,
    timeline: bool = True,
    command: str = "",
    progress: Progress | None = None,
) -> GapRun:
    """Analyse ``path`` and write gap.json, gap.rrd and the extended model to ``out`` (``./<stem>.wmr/``).

    With ``mode_topic`` the contact modes are those of that topic, and the result says so. The side files are
    never read. The files appear together or not at all. Raises LogUnusable.
    """
    options = options or GapOptions()
    if mode_topic is not None:
        options = replace(options, modes="given")
    whole = read_whole(path, mapping or LogMapping(), between or Between(), mode_topic, progress)
    base, notes = base_for(base, whole.sha256)
    with said_of(path):
        result = analyse(whole.log, base, options, progress)
    result = finished(result, replace(whole, notes=notes + whole.notes), mode_topic, command)
    document = document_of(result, options, str(path), whole.sha256)
    files = names(path, out, timeline=timeline)
    with replace_files(files) as parts:
        parts["json"].write_text(gap_to_json(document), encoding="utf-8")
        parts["model"].write_text(model_to_toml(result.model), encoding="utf-8")
        if timeline:
            write_gap_timeline(parts["timeline"], result, path.name, f"{path.stem}-{whole.sha256[:16]}-gap")
    if not timeline:
        names(path, out, timeline=True)["timeline"].unlink(missing_ok=True)
    return GapRun(files, document, result, whole.log)


def fit_log(
    path: Path,
    out: Path | None = None,
    *,
    options: GapOptions | None = None,
    mode_topic: str | None = None,
    mapping: LogMapping | None = None,
    between: Between | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> FitRun:
    """Calibrate a robot's base model on ``path`` and write ``<stem>.model.toml``. Raises LogUnusable."""
    options = options or GapOptions()
    if mode_topic is not None:
        options = replace(options, modes="given")
    whole = read_whole(path, mapping or LogMapping(), between or Between(), mode_topic, progress)
    with said_of(path):
        model = calibrate(whole.log, whole.log.robot, options)
    model = replace(model, provenance=Provenance(whole.sha256, __version__, command))
    file = names(path, out, timeline=False)["model"]
    with replace_files({"model": file}) as parts:
        parts["model"].write_text(model_to_toml(model), encoding="utf-8")
    return FitRun(file, model, whole.log, whole.notes)


@contextmanager
def said_of(path: Path) -> Iterator[None]:
    """What the analysis says of signals, said of the log that holds them."""
    try:
        yield
    except InvalidSignal as error:
        raise LogUnusable(path, str(error), TRY_LONGER.format(path=path)) from error


def finished(result: GapResult, whole: WholeLog, mode_topic: str | None, command: str) -> GapResult:
    """The result with what only the file's side knows: the mode's topic, remarks on the log, provenance."""
    return replace(
        result,
        modes=result.modes if mode_topic is None else f"topic:{mode_topic}",
        notes=(*result.notes, *whole.notes),
        model=replace(result.model, provenance=Provenance(whole.sha256, __version__, command)),
    )


def names(path: Path, out: Path | None, *, timeline: bool) -> dict[str, Path]:
    """The files by kind, in a directory that is there."""
    directory = out or default_directory(path)
    directory.mkdir(parents=True, exist_ok=True)
    kinds = {"json": "gap.json", "model": "model.toml"} | ({"timeline": "gap.rrd"} if timeline else {})
    return {kind: directory / f"{path.stem}.{ending}" for kind, ending in kinds.items()}

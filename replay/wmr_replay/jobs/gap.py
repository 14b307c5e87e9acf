"""Gap analysis and calibration of a log: read it, analyse it, and write the results where they are wanted."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
import polars as pl

from wmr_replay.gap import GapOptions, GapResult, analyse, calibrate
from wmr_replay.gap.scan.turning_in_doubt import doubts
from wmr_replay.gap.search.rests import that_matter
from wmr_replay.ingest import Between, LogPath
from wmr_replay.ingest.tracks import Progress, WholeLog, read_whole
from wmr_replay.jobs.base_model import base_for, check_same_robot
from wmr_replay.jobs.data_quality import TORQUE_FACTOR, checked_findings
from wmr_replay.jobs.gap_document import document_of
from wmr_replay.jobs.gap_traces import traces_frame
from wmr_replay.jobs.measured_poses import with_measured_poses
from wmr_replay.jobs.request_texts import request_texts
from wmr_replay.report.bundle import check_extra
from wmr_replay.report.gap import gap_page
from wmr_schemas import __version__
from wmr_schemas.errors import InvalidSignal, LogUnusable
from wmr_schemas.files import made_folder, whole_file, whole_files
from wmr_schemas.findings import Finding
from wmr_schemas.gap_file import GapFile, gap_to_json
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model, Provenance, model_to_toml
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_schemas.text import encodable

TRY_LONGER = (
    "A gap analysis needs a minute or so of driving with changes of speed and of yaw rate, poses and wheel "
    "torques throughout. `wmr-replay info {path}` says what the log holds."
)
TRY_KNOWN = (
    "Name it in a file, such as `[robot]` with `wheel_radius_m = 0.1` and `half_track_m = 0.25` in "
    "robot.toml, with --map robot.toml."
)

RAN_AWAY = (
    "the simulated motion runs away from this log: it has hardly a thing in common with the model's robot"
)
HELD = (
    "{name} acts on this log by as much as matters: the base model holds it, and `gap` with this model names "
    "only what another log shows beyond it"
)


@dataclass(frozen=True, eq=False)
class GapRun:
    """A gap analysis: the contents of gap.json, the whole result, the log and where it lies."""

    document: GapFile
    result: GapResult
    log: Log
    path: LogPath
    sha256: str
    proof: pl.DataFrame | None = None
    """The paths on another log, where the models were simulated on one."""
    base: Model | None = None
    """The base model that was given, or a simulator's."""


@dataclass(frozen=True, eq=False)
class FitRun:
    """A calibrated model, what was noticed on the way, and what is wrong with the data."""

    model: Model
    log: Log
    path: LogPath
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


def analyse_log(  # noqa: PLR0913 – keyword arguments
    path: LogPath,
    *,
    base: Model | None = None,
    options: GapOptions | None = None,
    mode_topic: str | None = None,
    mapping: LogMapping | None = None,
    between: Between | None = None,
    clock_offset_s: float = 0.0,
    command: str = "",
    progress: Progress | None = None,
) -> GapRun:
    """Analyse the log at ``path``; nothing is written.

    With ``mode_topic`` the contact modes are those of that topic, and the result says so. The side files are
    never read. Raises LogUnusable, also where the data's quality bars an answer.
    """
    options = options or GapOptions()
    if mode_topic is not None:
        options = replace(options, modes="given")
    whole = read_whole(
        path,
        mapping or LogMapping(),
        between or Between(),
        mode_topic,
        progress,
        clock_offset_s=clock_offset_s,
    )
    asked = {"clock_offset_s": clock_offset_s, "given": request_texts(mapping, between, base)}
    check_same_robot(path, whole.log.robot, base)
    base, notes = base_for(base, whole.sha256)
    findings = checked_findings(path, whole, robot_of(whole.log, base), TORQUE_FACTOR)
    whole = with_measured_poses(whole)
    with errors_naming(path):
        result = analyse(whole.log, base, options, progress)
    result = finished(result, replace(whole, notes=notes + whole.notes), mode_topic, command)
    document = document_of(result, options, str(path), whole.sha256, findings, asked)
    return GapRun(document, result, whole.log, path, whole.sha256, base=base)


def write_gap(run: GapRun, out: Path, *, timeline: bool = True, report: bool = False) -> dict[str, Path]:
    """Write gap.json, its traces, gap.rrd, the report and the extended model to ``out``; the files by kind.

    They appear together or not at all. A timeline or report that is not asked for is removed, where an
    earlier analysis left one.
    """
    if report:
        check_extra()
    path = run.path
    files = names(path, out, timeline=timeline, report=report, proof=run.proof is not None)
    traces = traces_frame(run.result.traces)
    with made_folder(out), whole_files(files) as parts:
        parts["json"].write_text(gap_to_json(run.document), encoding="utf-8")
        parts["model"].write_text(model_to_toml(run.result.model), encoding="utf-8")
        traces.write_parquet(parts["traces"])
        if run.proof is not None:
            run.proof.write_parquet(parts["proof"])
        if report:
            parts["report"].write_text(gap_page(run.document, traces, path.name, run.proof), encoding="utf-8")
        if timeline:
            from wmr_replay.timeline.gap.writer import write_gap_timeline  # noqa: PLC0415 – Rerun is slow to import

            identity = f"{path.stem}-{run.sha256[:16]}-gap"
            found = [msgspec.to_builtins(finding) for finding in run.document.findings]
            write_gap_timeline(parts["timeline"], run.result, path.name, identity, found)
    for kind, file in names(path, out, timeline=True, report=True, proof=True).items():
        if kind not in files:
            file.unlink(missing_ok=True)
    return files


def calibrate_log(
    path: LogPath,
    *,
    options: GapOptions | None = None,
    mode_topic: str | None = None,
    mapping: LogMapping | None = None,
    between: Between | None = None,
    clock_offset_s: float = 0.0,
    command: str = "",
    progress: Progress | None = None,
) -> FitRun:
    """Calibrate a robot's base model on the log at ``path``; nothing is written.

    Raises LogUnusable, also where the data's quality bars an answer.
    """
    options = options or GapOptions()
    if mode_topic is not None:
        options = replace(options, modes="given")
    whole = read_whole(
        path,
        mapping or LogMapping(),
        between or Between(),
        mode_topic,
        progress,
        clock_offset_s=clock_offset_s,
    )
    findings = checked_findings(path, whole, whole.log.robot, TORQUE_FACTOR)
    whole = with_measured_poses(whole)
    with errors_naming(path):
        model = calibrate(whole.log, whole.log.robot, options)
    asked = {
        "modes": mode_source(options.modes, mode_topic),
        "clock_offset_s": clock_offset_s,
        "given": request_texts(mapping, between, None),
    }
    origin = Provenance(whole.sha256, __version__, command, json.dumps(asked, ensure_ascii=False))
    model = replace(model, provenance=origin)
    own = options.gates.misfit
    notes = (*(HELD.format(name=name) for name in that_matter(model, own)), *doubts(model.misfit, own))
    return FitRun(model, whole.log, path, (*whole.notes, *notes), findings)


def robot_of(log: Log, base: Model | None) -> RobotParameters:
    """The robot's parameters as the base model has them, key by key, else the log."""
    return log.robot if base is None else replace(log.robot, **base.robot.known())  # type: ignore[arg-type]


def write_model(run: FitRun, out: Path) -> Path:
    """Write ``<stem>.model.toml`` to ``out``; the file."""
    file = names(run.path, out, timeline=False)["model"]
    with made_folder(out), whole_file(file) as part:
        part.write_text(model_to_toml(run.model), encoding="utf-8")
    return file


@contextmanager
def errors_naming(path: LogPath, advice: str = TRY_LONGER) -> Iterator[None]:
    """Turn an InvalidSignal of the analysis, or numbers that run away, into a LogUnusable with the log."""
    try:
        yield
    except InvalidSignal as error:
        if error.signal == "robot":
            advice = TRY_KNOWN
        raise LogUnusable(path, str(error), advice.format(path=path)) from error
    except np.linalg.LinAlgError as error:
        raise LogUnusable(path, RAN_AWAY, advice.format(path=path)) from error


def finished(result: GapResult, whole: WholeLog, mode_topic: str | None, command: str) -> GapResult:
    """The result with what only the file's side knows: the mode's topic, remarks on the log, provenance."""
    return replace(
        result,
        modes=mode_source(result.modes, mode_topic),
        notes=(*result.notes, *whole.notes),
        model=replace(result.model, provenance=Provenance(whole.sha256, __version__, command)),
    )


def mode_source(modes: str, mode_topic: str | None) -> str:
    """Where contact modes come from, as the option --modes spells it."""
    return modes if mode_topic is None else f"topic:{mode_topic}"


def names(
    path: LogPath, out: Path, *, timeline: bool, report: bool = False, proof: bool = False
) -> dict[str, Path]:
    """The files by kind."""
    kinds = {"json": "gap.json", "model": "model.toml", "traces": "gap_traces.parquet"}
    kinds |= ({"timeline": "gap.rrd"} if timeline else {}) | ({"report": "gap.html"} if report else {})
    kinds |= {"proof": "gap_proof.parquet"} if proof else {}
    return {kind: out / encodable(f"{path.stem}.{ending}") for kind, ending in kinds.items()}

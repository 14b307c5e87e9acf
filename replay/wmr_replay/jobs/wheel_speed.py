"""Gap analysis and calibration of robots whose base model wheel speeds or commands drive."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from wmr_replay.gap import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds, most_effects
from wmr_replay.gap.wheel_speed.calibrate import calibrate_wheel_speeds
from wmr_replay.ingest import Between, LogPath
from wmr_replay.ingest.channels.detect import WANTED
from wmr_replay.ingest.tracks import Need, Progress, WholeLog, check_class, read_whole
from wmr_replay.jobs.base_model import base_for, check_same_robot
from wmr_replay.jobs.data_quality import checked_findings
from wmr_replay.jobs.gap import FitRun, GapRun, errors_naming, robot_of
from wmr_replay.jobs.gap_document import document_of
from wmr_replay.jobs.measured_poses import with_measured_poses
from wmr_replay.jobs.request_texts import request_texts
from wmr_schemas import __version__
from wmr_schemas.errors import ChannelNotFound, LogUnusable
from wmr_schemas.findings import Finding
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model, Provenance

Run = TypeVar("Run")
NO_EFFORT = "no row has an effort"
"""The words of a log whose torque channel is empty."""
WHEEL_SPEED = "wheel_speed"
SAME_LENGTH = 0.01
"""Relative difference of a length that two logs state of one robot."""
TRY_LONGER = (
    "An analysis of wheel speeds needs half a minute or so of driving with turns, a pose, and wheel speeds "
    "throughout. `wmr-replay info {path}` says what the log holds."
)


@dataclass(frozen=True)
class Request:
    """How logs are read: mapping, part, offset of the inputs' clock, and whether commands drive the model."""

    mapping: LogMapping | None = None
    between: Between | None = None
    clock_offset_s: float = 0.0
    commands: bool = False

    @property
    def need(self) -> Need:
        """What a log has to hold."""
        return "commands" if self.commands else "wheel_speed"

    def read(self, path: LogPath, progress: Progress | None) -> WholeLog:
        """The whole log. Raises LogUnusable."""
        return read_whole(
            path,
            self.mapping or LogMapping(),
            self.between or Between(),
            None,
            progress,
            clock_offset_s=self.clock_offset_s,
            need=self.need,
        )


@dataclass(frozen=True, eq=False)
class Read:
    """Logs that belong together: each with its findings, and one hash for all."""

    wholes: tuple[WholeLog, ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    sha256: str


def read_all(
    paths: Sequence[LogPath], request: Request, base: Model | None, progress: Progress | None
) -> Read:
    """All logs, checked. Raises LogUnusable for a robot of another class and for data that bar an answer."""
    wholes, findings, notes = list[WholeLog](), list[Finding](), list[str]()
    for path in paths:
        whole = request.read(path, progress)
        check_same_robot(path, whole.log.robot, base)
        found = checked_findings(path, whole, robot_of(whole.log, base))
        check_class(path, found)
        wholes.append(with_measured_poses(whole))
        findings += list(found)
        notes += wholes[-1].notes if len(paths) == 1 else [f"{path.name}: {n}" for n in wholes[-1].notes]
    check_one_robot(paths, wholes)
    hashes = [whole.sha256 for whole in wholes]
    sha256 = hashes[0] if len(hashes) == 1 else hashlib.sha256("".join(hashes).encode()).hexdigest()
    return Read(tuple(wholes), tuple(findings), tuple(notes), sha256)


def check_one_robot(paths: Sequence[LogPath], wholes: Sequence[WholeLog]) -> None:
    """Raises LogUnusable where two logs state different lengths of the robot."""
    first = wholes[0].log.robot
    for path, whole in zip(paths[1:], wholes[1:], strict=True):
        for key in ("wheel_radius_m", "half_track_m"):
            own, other = getattr(whole.log.robot, key), getattr(first, key)
            if own is not None and other is not None and abs(own / other - 1) > SAME_LENGTH:
                raise LogUnusable(
                    path,
                    f"states {key} {own:g}, and {paths[0].name} {other:g}: they are of two robots",
                    "Logs of one robot are one data set; give its lengths in [robot] of --map FILE.",
                )


def analyse_wheel_logs(
    paths: Sequence[LogPath],
    request: Request,
    *,
    base: Model | None = None,
    options: GapOptions | None = None,
    at_most: int | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> GapRun:
    """The gap of one or several logs as one data set; nothing is written. Raises LogUnusable."""
    options = options or GapOptions()
    options = replace(options, max_effects=most_effects(options, at_most))
    asked = {
        "base": "wheel-speed",
        "input": "commands" if request.commands else "measured",
        "clock_offset_s": request.clock_offset_s,
        "given": request_texts(request.mapping, request.between, base),
    }
    read = read_all(paths, request, base, progress)
    base, notes = base_for(base, read.sha256)
    with errors_naming(paths[0], TRY_LONGER):
        result = analyse_wheel_speeds(
            [whole.log for whole in read.wholes],
            base,
            options,
            progress,
            driven_by="command" if request.commands else WHEEL_SPEED,
        )
    origin = Provenance(read.sha256, __version__, command, base_model=WHEEL_SPEED)
    result = replace(
        result,
        notes=(*result.notes, *notes, *read.notes),
        model=replace(result.model, provenance=origin),
    )
    document = document_of(result, options, named(paths), read.sha256, read.findings, asked)
    return GapRun(document, result, read.wholes[0].log, paths[0], read.sha256, base=base)


def calibrate_wheel_logs(
    paths: Sequence[LogPath],
    request: Request,
    *,
    options: GapOptions | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> FitRun:
    """The calibrated base model of one or several logs; nothing is written. Raises LogUnusable."""
    read = read_all(paths, request, None, progress)
    logs = [whole.log for whole in read.wholes]
    with errors_naming(paths[0], TRY_LONGER):
        model, notes = calibrate_wheel_speeds(logs, logs[0].robot, options)
    asked = {
        "modes": "identified",
        "base": "wheel-speed",
        "clock_offset_s": request.clock_offset_s,
        "given": request_texts(request.mapping, request.between, None),
    }
    settings = json.dumps(asked, ensure_ascii=False)
    model = replace(model, provenance=Provenance(read.sha256, __version__, command, settings, WHEEL_SPEED))
    return FitRun(model, logs[0], paths[0], (*notes, *read.notes), read.findings)


def either(on_torques: Callable[[], Run], on_wheel_speeds: Callable[[], Run]) -> Run:
    """The answer on torques; where the log has none, that on wheel speeds; the first error where it has
    neither.
    """
    try:
        return on_torques()
    except ChannelNotFound as error:
        if error.wanted != WANTED["torque"]:  # a topic that was named, a pose, modes
            raise
        missing: LogUnusable = error
    except LogUnusable as error:
        if NO_EFFORT not in str(error):
            raise
        missing = error
    try:
        return on_wheel_speeds()
    except ChannelNotFound:
        raise missing from None


def named(paths: Sequence[LogPath]) -> str:
    """The logs as they were named."""
    return ", ".join(map(str, paths))

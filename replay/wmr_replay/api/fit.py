"""A robot's base model, calibrated on a log."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from wmr_replay.api.places import LocalPlace, Place, local_path, places_of
from wmr_replay.api.request import Instant, MappingLike, between_of, mapping_of, settings_of
from wmr_replay.ingest.tracks import Progress
from wmr_replay.jobs.gap import FitRun, calibrate_log, write_model
from wmr_replay.jobs.gap_asked import options_of
from wmr_replay.jobs.owner import Claim
from wmr_replay.jobs.wheel_speed import Request, calibrate_wheel_logs, either
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Model, model_tables
from wmr_schemas.signals import Log
from wmr_schemas.text import shown

BASES = ("auto", "torque", "wheel-speed")


class Fit:
    """The answer of ``fit``.

    Attributes:
        file: The model file that was written; None without ``out``.
    """

    def __init__(self, run: FitRun, file: Path | None = None) -> None:
        self._run, self.file = run, file

    @property
    def model(self) -> Model:
        """Robot parameters with standard deviations where they were fitted, and the noise."""
        return self._run.model

    @property
    def log(self) -> Log:
        """The signals that were used."""
        return self._run.log

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed."""
        return self._run.notes

    @property
    def findings(self) -> tuple[dict[str, Any], ...]:
        """What is wrong with the data: code, severity, text, meaning, advice, n, where."""
        return tuple(found.as_dict() for found in self._run.findings)

    def as_dict(self) -> dict[str, Any]:
        """The model file's tables."""
        return model_tables(self.model)

    def save(self, directory: LocalPlace) -> Path:
        """Write ``<stem>.model.toml`` to a directory; the file."""
        return write_model(self._run, local_path(directory))

    def __repr__(self) -> str:
        return shown(f"<Fit of {self._run.path}: {self.model.robot.known()}>")


def chosen(
    base: str, n_logs: int, on_torques: Callable[[], FitRun], on_wheel_speeds: Callable[[], FitRun]
) -> FitRun:
    """The calibration on a base. Raises InvalidSetting for several logs on torques."""
    if base == "wheel-speed" or (base == "auto" and n_logs > 1):
        return on_wheel_speeds()
    if n_logs > 1:
        raise InvalidSetting("torques are calibrated on one log; several logs need --base wheel-speed")
    return on_torques() if base == "torque" else either(on_torques, on_wheel_speeds)


def fit(
    log: Place | Sequence[Place],
    out: LocalPlace | None = None,
    *,
    base: str = "auto",
    modes: str = "identified",
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    clock_offset_s: float = 0.0,
    command: str = "",
    force: bool = False,
    progress: Progress | None = None,
) -> Fit:
    """Calibrate the base model of a robot on a log: α, yaw gain, noise, stiffness where it is excited.

    On wheel speeds: wheel scales, effective track, centre of rotation, pose delay, noise, and the error of
    dead reckoning before and after on what was held out.

    Args:
        log: An MCAP file, a ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or a URL; several logs of one
            robot where wheel speeds drive the model.
        out: Directory for ``<stem>.model.toml``; None: nothing is written.
        base: What drives the base model: ``torque``, ``wheel-speed``, or ``auto``: torques where the log has
            them, else wheel speeds.
        modes: Contact modes: ``identified``, ``ideal`` throughout, or ``topic:T`` for those on topic T.
        mapping: Mapping or mapping file.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        clock_offset_s: Added to the stamps of torques and wheel speeds.
        command: What the model states as its origin.
        force: Replace the results of another log of the same name in ``out``.
        progress: Called with what is being done and the share that is done.

    Raises:
        LogUnusable: No pose, neither torques nor wheel speeds, a log that is too short, or data whose
            findings bar an answer.
        InvalidSetting: An option that makes no sense, or ``out`` holds results of another log.
    """
    if base not in BASES:
        raise InvalidSetting(f"base is one of {', '.join(BASES)}, not {base!r}")
    options, topic = options_of(modes)
    places, claim, replaces = places_of(log), None, False
    place = places[0]
    if out is not None:
        claim = Claim.of(local_path(out), place, models=True)
        replaces = claim.settled(force=force)
    shift_s = settings_of({"clock_offset_s": clock_offset_s}).clock_offset_s
    request = Request(mapping_of(mapping), between_of(start, end), shift_s)

    def on_torques() -> FitRun:
        return calibrate_log(
            place,
            options=options,
            mode_topic=topic,
            mapping=request.mapping,
            between=request.between,
            clock_offset_s=shift_s,
            command=command,
            progress=progress,
        )

    def on_wheel_speeds() -> FitRun:
        return calibrate_wheel_logs(places, request, options=options, command=command, progress=progress)

    run = chosen(base, len(places), on_torques, on_wheel_speeds)
    if claim is None:
        return Fit(run)
    file = write_model(run, claim.directory)
    if replaces:
        claim.remove_others([file])
    return Fit(run, file)

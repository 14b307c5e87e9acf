"""A robot's base model, calibrated on a log."""

from pathlib import Path
from typing import Any

from wmr_replay.api.gap import options_of
from wmr_replay.api.places import LocalPlace, Place, local_path, place_of
from wmr_replay.api.request import Instant, MappingLike, between_of, mapping_of, settings_of
from wmr_replay.ingest.tracks import Progress
from wmr_replay.jobs.gap import FitRun, calibrate_log, write_model
from wmr_replay.jobs.owner import Claim
from wmr_schemas.model_file import Model, model_tables
from wmr_schemas.signals import Log
from wmr_schemas.text import shown


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


def fit(
    log: Place,
    out: LocalPlace | None = None,
    *,
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

    Args:
        log: An MCAP file, a ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or a URL.
        out: Directory for ``<stem>.model.toml``; None: nothing is written.
        modes: Contact modes: ``identified``, ``ideal`` throughout, or ``topic:T`` for those on topic T.
        mapping: Mapping or mapping file.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        clock_offset_s: Added to the stamps of torques and wheel speeds.
        command: What the model states as its origin.
        force: Replace the results of another log of the same name in ``out``.
        progress: Called with what is being done and the share that is done.

    Raises:
        LogUnusable: No pose, no torques, a log that is too short, or data whose findings bar an answer.
        InvalidSetting: An option that makes no sense, or ``out`` holds results of another log.
    """
    options, topic = options_of(modes)
    place, claim, replaces = place_of(log), None, False
    if out is not None:
        claim = Claim.of(local_path(out), place, models=True)
        replaces = claim.settled(force=force)
    run = calibrate_log(
        place,
        options=options,
        mode_topic=topic,
        mapping=mapping_of(mapping),
        between=between_of(start, end),
        clock_offset_s=settings_of({"clock_offset_s": clock_offset_s}).clock_offset_s,
        command=command,
        progress=progress,
    )
    if claim is None:
        return Fit(run)
    file = write_model(run, claim.directory)
    if replaces:
        claim.remove_others([file])
    return Fit(run, file)

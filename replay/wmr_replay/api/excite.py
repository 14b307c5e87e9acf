"""What to drive next: a drive that tells apart what a log left open."""

from collections.abc import Sequence
from os import fspath
from pathlib import Path
from typing import Any, TypeAlias

import polars as pl

from wmr_replay.api.gap import Gap
from wmr_replay.api.places import LocalPlace, Place, local_path, place_of
from wmr_replay.api.request import Instant, MappingLike, between_of, mapping_of
from wmr_replay.api.simulation import read_robot
from wmr_replay.excite import Bounds, Design, Question, design
from wmr_replay.excite.bounds import Area
from wmr_replay.jobs.excite_document import columns_of, document_of, drive_of
from wmr_replay.jobs.excite_question import model_of_gap, model_of_log, question_about, question_of_gap
from wmr_schemas.drive_file import DriveFile, drive_to_toml
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.files import made_folder, whole_files
from wmr_schemas.gap_file import GapFile, read_gap
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model, read_model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.text import encodable, json_text
from wmr_synth.recorder import write_played
from wmr_synth.synthesis import START_NS

Source: TypeAlias = Model | RobotParameters | Place
"""A robot: its parameters or model, a model file, a file with ``[robot]``, or a log."""
GapLike: TypeAlias = Gap | GapFile | LocalPlace
"""A result of ``gap``, or its ``gap.json``."""
AreaLike: TypeAlias = float | tuple[float, float]
"""Radius of a disc about the start, or a box: ahead and across, in m."""
ENDINGS = {"scenario": "excite.toml", "commands": "excite.mcap", "csv": "excite.csv", "json": "excite.json"}


class Excitation:
    """The answer of ``excite``.

    Attributes:
        files: The files that were written, by kind (``scenario``, ``commands``, ``csv``, ``json``).
    """

    def __init__(self, found: Design, question: Question, robot: RobotParameters, source: str) -> None:
        self._design, self._question, self._robot, self._source = found, question, robot, source
        self.files: dict[str, Path] = {}

    @property
    def separate(self) -> tuple[str, ...]:
        """The effects that the drive tells apart."""
        return self._question.names

    @property
    def duration_s(self) -> float:
        """Length of the drive."""
        return self._design.profile.duration_s

    @property
    def resolves(self) -> bool:
        """Whether every pair is expected to be told apart with a BIC difference of 40 or more."""
        return bool(self.as_dict()["resolves"])

    @property
    def drive(self) -> DriveFile:
        """The drive as ``synth`` plays it."""
        return drive_of(self._design, self._question, self._robot)

    @property
    def commands(self) -> pl.DataFrame:
        """t_s, v_long_mps, yaw_rate_radps, and the torques left_nm, right_nm of the base model."""
        return pl.DataFrame(columns_of(self._design))

    @property
    def manoeuvres(self) -> pl.DataFrame:
        """Start, length, family and words of each manoeuvre."""
        rows = [
            (c.start_s, c.manoeuvre.duration_s, c.manoeuvre.family, c.manoeuvre.words)
            for c in self._design.chosen
        ]
        return pl.DataFrame(rows, schema=["start_s", "duration_s", "family", "words"], orient="row")

    @property
    def separations(self) -> pl.DataFrame:
        """The expected BIC difference of each pair: ``missing`` is hidden, ``rival`` is named (empty: nothing
        is); and the seconds of such driving after which it reaches 40.
        """
        rows = [(s.missing, s.rival, s.expected_bic, s.seconds_needed) for s in self._design.separations]
        names = ["missing", "rival", "expected_bic", "seconds_needed"]
        return pl.DataFrame(rows, schema=names, orient="row")

    def as_dict(self) -> dict[str, Any]:
        """What ``excite.json`` holds."""
        return document_of(self._design, self._question, self._source)

    def save(self, directory: LocalPlace, stem: str = "drive") -> dict[str, Path]:
        """Write the scenario, the commands as MCAP and CSV, and ``excite.json``; the files by kind.

        They appear together or not at all.
        """
        folder = local_path(directory)
        files = {kind: folder / encodable(f"{stem}.{ending}") for kind, ending in ENDINGS.items()}
        with made_folder(folder), whole_files(files) as parts:
            parts["scenario"].write_text(drive_to_toml(self.drive), encoding="utf-8")
            write_played(columns_of(self._design), self._robot, START_NS, parts["commands"])
            self.commands.write_csv(parts["csv"], float_precision=6)
            parts["json"].write_text(json_text(self.as_dict()) + "\n", encoding="utf-8")
        self.files = files
        return files

    def __repr__(self) -> str:
        asked = " and ".join(self.separate) or "the library"
        return f"<Excitation: {self.duration_s:.0f} s for {asked}>"


def excite(
    source: Source | None = None,
    out: LocalPlace | None = None,
    *,
    from_gap: GapLike | None = None,
    separate: Sequence[str] = (),
    duration_s: float = 90.0,
    max_speed_mps: float = 1.5,
    max_yaw_rate_radps: float = 1.5,
    max_torque_nm: float | None = None,
    area_m: AreaLike = 4.0,
    reverse: bool = True,
    inputs: str = "torques",
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
) -> Excitation:
    """Design a drive that tells effects apart, out of a library of manoeuvres within bounds.

    Each manoeuvre is simulated with the base model. The information that separates two effects is the part of
    one's signature in the filter's innovations that the other does not explain at any size (T-optimality).

    Args:
        source: The robot: parameters, a model or model file, a file with ``[robot]``, or a log; None: the
            base model of ``from_gap``.
        out: Directory for scenario, commands and ``excite.json``; None: nothing is written.
        from_gap: A result of ``gap`` that left something open: says the pair, their sizes, robot and noise.
        separate: Effects to be told apart; empty: those that ``from_gap`` left open, else any of the library.
        duration_s: Longest drive.
        max_speed_mps: Largest speed.
        max_yaw_rate_radps: Largest yaw rate.
        max_torque_nm: Largest torque of a wheel; None: what accelerates the robot by 1.5 m/s².
        area_m: Where the robot stays: a radius about the start, or a box ahead and across centred at it.
        reverse: Whether the robot may drive in reverse.
        inputs: ``torques``; drives for models that wheel speeds drive are not designed.
        mapping: Of a log: its mapping or mapping file.
        start: Of a log: leave out what was logged before.
        end: Of a log: leave out what was logged after.

    Raises:
        InvalidSetting: Effects that no drive tells apart, with what else would; unknown effects; bounds that
            leave nothing to drive; a result that leaves nothing open.
        InvalidFile: A file that cannot be read.
        LogUnusable: A log that cannot be used.

    Example:
        >>> import wmr_replay as wr
        >>> robot = wr.RobotParameters(alpha=0.25, alpha_yaw=0.3, half_track_m=0.25, wheel_radius_m=0.1)
        >>> found = wr.excite(robot, separate=("rolling_resistance", "viscous_drag"), duration_s=40)
        >>> found.duration_s <= 40, found.separations["missing"].unique().sort().to_list()
        (True, ['rolling_resistance', 'viscous_drag'])
    """
    check_inputs(inputs)
    area = Area(box_m=area_m) if isinstance(area_m, tuple) else Area(radius_m=area_m)
    bounds = Bounds(max_speed_mps, max_yaw_rate_radps, max_torque_nm, area, reverse)
    if not 0 < duration_s < float("inf"):
        raise InvalidSetting(f"the duration must be above 0 s, not {duration_s:g} s")
    given = None if source is None else model_of_source(source, mapping, start, end)
    question, robot = asked_of(given, from_gap, tuple(separate))
    found = Excitation(design(question, bounds, duration_s), question, robot, source_text(source, from_gap))
    if out is not None:
        found.save(out, stem_of(source, from_gap))
    return found


def asked_of(
    given: Model | None, from_gap: GapLike | None, names: tuple[str, ...]
) -> tuple[Question, RobotParameters]:
    """The question and the robot that the drive is for."""
    if from_gap is None:
        if given is None:
            raise InvalidSetting("which robot? Name a log, a model or a robot file, or a result with --from")
        return question_about(given, names), given.robot
    path = Path(fspath(from_gap)) if not isinstance(from_gap, (Gap, GapFile)) else Path("gap.json")
    document = from_gap.document if isinstance(from_gap, Gap) else from_gap
    result = document if isinstance(document, GapFile) else read_gap(path)
    model = model_of_gap(path, result)
    if given is not None:
        model = Model(given.robot, noise=model.noise, effects=given.effects, misfit=given.misfit)
    return question_of_gap(result, model, names), model.robot


def model_of_source(
    source: Source, mapping: MappingLike | None, start: Instant | None, end: Instant | None
) -> Model:
    """The robot that a source states, with its noise where it is known."""
    if isinstance(source, Model):
        return source
    if isinstance(source, RobotParameters):
        return Model(robot=source)
    if str(source).endswith(".toml"):
        path = local_path(source)  # type: ignore[arg-type]
        try:
            return read_model(path)
        except InvalidFile:
            return Model(robot=read_robot(path))
    return model_of_log(place_of(source), mapping_of(mapping) or LogMapping(), between_of(start, end))


def check_inputs(inputs: str) -> None:
    """Raises InvalidSetting for another base model than the torques'."""
    if inputs != "torques":
        raise InvalidSetting(
            f"drives are designed for models that torques drive, not for {inputs}: with wheel speeds no "
            "filter weighs the innovations, so that what a manoeuvre shows is not known beforehand; drive "
            "several speeds and yaw rates, forwards and in reverse"
        )


def source_text(source: Source | None, from_gap: GapLike | None) -> str:
    """Where the robot and the question come from, as the answer states it."""
    named = from_gap if from_gap is not None else source
    if isinstance(named, Gap):
        return str(named.document.log)
    if isinstance(named, GapFile):
        return named.log
    return "" if isinstance(named, (Model, RobotParameters)) else str(named)


def stem_of(source: Source | None, from_gap: GapLike | None) -> str:
    """The name in front of the files' endings."""
    name = Path(source_text(source, from_gap)).name
    for ending in (".gap.json", ".model.toml", ".mcap", ".toml", ".json"):
        name = name.removesuffix(ending)
    return name or "drive"

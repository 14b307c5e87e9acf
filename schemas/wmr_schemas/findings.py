"""Findings: what is wrong with the data of a log, as data.

A kind of finding is declared once, below: what it means, what to do about it, and which status the rows get
whose answer it bars. The stages that look for them are in ``wmr_replay.quality`` and ``wmr_replay.ingest``.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from wmr_schemas.status import Status


class Severity(StrEnum):
    """How much a finding matters."""

    NOTE = "note"
    """Worth knowing; every answer stands."""
    WARNING = "warning"
    """Answers are given, and less certain than they say."""
    BARS = "bars"
    """Rows get no answer; their status says which finding it is."""


@dataclass(frozen=True)
class FindingKind:
    """A kind of finding.

    ``bars`` is the status of the rows that it bars, None where it bars none. ``explained_by``: kinds that are
    the cause where both are found.
    """

    code: str
    meaning: str
    advice: str
    bars: Status | None = None
    explained_by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Finding:
    """One finding in a log.

    Attributes:
        code: Its kind, a key of :data:`KINDS`.
        severity: ``note``, ``warning`` or ``bars``.
        text: What was found, with its numbers.
        meaning: What it means for the answer.
        advice: What to do.
        n: How many rows or messages are concerned; 0 where it concerns the log as a whole.
        where: The first stretches concerned, from and to in s since the first pose; empty: the whole log.
    """

    code: str
    severity: Severity
    text: str
    meaning: str
    advice: str
    n: int = 0
    where: tuple[tuple[float, float], ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """As JSON holds it."""
        return asdict(self)


NO_HEADING = ("no_heading", "heading_not_along_path", "yaw_unit")
"""Kinds that leave no direction in which speed or acceleration could be measured."""
NO_MOTION = (*NO_HEADING, "rate_too_low")
"""Kinds that leave no speed and no acceleration."""

KINDS: dict[str, FindingKind] = {
    kind.code: kind
    for kind in (
        FindingKind(
            "clocks_apart",
            "pose and wheel signals are stamped by clocks that do not belong together",
            "run with --clock log, or set the robot's clocks (chrony, PTP) before recording",
            Status.CLOCKS_APART,
        ),
        FindingKind(
            "clock_offset",
            "the wheel signals fit the motion better when they are shifted in time",
            "give the shift with --clock-offset, or set the clocks before recording",
        ),
        FindingKind(
            "frozen_pose",
            "the tracker repeats its last pose under new stamps; the repeats are holes, not a robot at rest",
            "look for occlusions and lost markers at these times",
            Status.GAP,
        ),
        FindingKind(
            "no_heading",
            "the orientation was never filled in, or is not the robot's: sideslip cannot be seen",
            "publish the robot's orientation with its pose, or choose another pose with --pose",
            Status.NO_HEADING,
            explained_by=("drives_sideways",),
        ),
        FindingKind(
            "heading_not_along_path",
            "the yaw does not follow the path's direction: it is of another frame, or turned",
            "publish the pose of base_link in a frame whose z axis points up",
            Status.NO_HEADING,
            explained_by=("yaw_unit", "drives_sideways", "rate_too_low"),
        ),
        FindingKind(
            "pose_not_planar",
            "roll, pitch or height vary as a camera's or a flying tracker's do, not a wheeled robot's",
            "publish the pose of base_link in a frame whose z axis points up",
            Status.NO_HEADING,
        ),
        FindingKind(
            "rate_changed",
            "the pose comes at another rate than in the log's first second; the window was chosen again",
            "none is needed; a steady rate gives the shorter delay",
        ),
        FindingKind(
            "rate_too_low",
            "the pose comes too rarely for motion as quick as this: a skid can begin and end unseen",
            "record the pose at a higher rate, or choose another one with --pose",
            Status.RATE_TOO_LOW,
        ),
        FindingKind(
            "torque_sign",
            "the robot accelerates against its torques",
            "give left_torque_sign = -1, right_torque_sign = -1 or both in the torque section of --map",
            Status.IMPLAUSIBLE,
            explained_by=NO_MOTION,
        ),
        FindingKind(
            "position_unit",
            "the positions are not in metres",
            "give position_scale in the pose section of --map",
            Status.IMPLAUSIBLE,
            explained_by=NO_MOTION,
        ),
        FindingKind(
            "yaw_unit",
            "the yaw is not in radians, or turns the other way",
            "give yaw_unit or yaw_sign in the pose section of --map, or publish the yaw in radians",
            Status.IMPLAUSIBLE,
        ),
        FindingKind(
            "sides_swapped",
            "the robot turns the other way than its wheels do",
            "exchange left and right in --map",
            Status.IMPLAUSIBLE,
            explained_by=NO_MOTION,
        ),
        FindingKind(
            "wheel_speed_sign",
            "wheel speeds have the wrong sign: the slip velocities sigma are wrong, the modes are not",
            "give left_sign = -1, right_sign = -1 or both in the wheel_speeds section of --map",
            explained_by=NO_HEADING,
        ),
        FindingKind(
            "half_track",
            "the half track does not fit how the robot turns: turning under torque is taken for slipping",
            "give half_track_m with --map",
            Status.IMPLAUSIBLE,
            explained_by=NO_MOTION,
        ),
        FindingKind(
            "wheel_speed_unit",
            "wheel speeds and motion disagree by a constant factor: a unit or the wheel radius is wrong",
            "give unit or scale in the wheel_speeds section, or the robot's wheel_radius_m, in --map",
            explained_by=("yaw_unit", "rate_too_low"),
        ),
        FindingKind(
            "torque_unit",
            "torques and motion disagree by a factor that the robot's parameters do not explain",
            "give torque_scale or gear_ratio for the torque, or the robot's alpha, in --map",
            Status.IMPLAUSIBLE,
            explained_by=("yaw_unit", "rate_too_low"),
        ),
        FindingKind(
            "stamp_unit",
            "the stamps count another unit than seconds; the recorder's clock jitters more",
            "set the stamps in seconds and nanoseconds; --clock header takes them as they are",
        ),
        FindingKind(
            "parameter_without_sense",
            "a parameter in the log's own metadata makes no sense and was left out",
            "give it with --map",
        ),
        FindingKind(
            "drives_sideways",
            "the robot moves sideways on purpose (mecanum, omnidirectional): that is no skid",
            "the model is a differential drive; no mode is told for such a robot",
            Status.OTHER_DRIVE,
            explained_by=("yaw_unit",),
        ),
        FindingKind(
            "steered",
            "the robot is steered: the model is a differential drive",
            "sideslip is told as skidding; slipping and alpha mean nothing for such a robot",
        ),
        FindingKind(
            "coloured_noise",
            "the pose's noise is correlated in time, so it does not average out within the window",
            "trust the standard deviations less than they say; look for a filter or wobbling markers",
        ),
    )
}


def finding(
    code: str,
    severity: Severity,
    text: str,
    n: int = 0,
    where: Iterable[tuple[float, float]] = (),
    advice: str = "",
) -> Finding:
    """A finding of a declared kind; ``advice`` in place of the kind's where the data say more."""
    kind = KINDS[code]
    return Finding(code, severity, text, kind.meaning, advice or kind.advice, n, tuple(where))


def without_explained(findings: Iterable[Finding]) -> list[Finding]:
    """The findings without those that another one explains; see ``FindingKind.explained_by``."""
    every = list(findings)
    return [f for f in every if not any(explains(other, f) for other in every)]


def explains(cause: Finding, found: Finding) -> bool:
    """Whether ``cause`` is the cause of ``found``: it is as severe, and of half as many rows at least.

    One that held for a moment, or by chance, explains nothing that lasts.
    """
    ranks = list(Severity)
    is_kind = cause.code in KINDS[found.code].explained_by
    return is_kind and ranks.index(cause.severity) >= ranks.index(found.severity) and 2 * cause.n >= found.n


def findings_json(findings: Iterable[Finding]) -> str:
    """A JSON list, as the summary table holds it."""
    return json.dumps([f.as_dict() for f in findings], ensure_ascii=False)

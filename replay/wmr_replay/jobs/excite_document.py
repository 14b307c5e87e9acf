"""A designed drive as columns, as a drive file and as ``excite.json``."""

from dataclasses import asdict
from typing import Any

from wmr_replay.excite import Design, Question
from wmr_replay.excite.design import Chosen, Separation
from wmr_replay.excite.profile import Reached
from wmr_schemas import __version__
from wmr_schemas.arrays import F64
from wmr_schemas.drive_file import Controller, DriveFile
from wmr_schemas.robot import RobotParameters

GAINS = (2.0, 0.5)
"""Of the controller that a drive file proposes, 1/s and 1/s²: settles in a second."""
ON_PATH = (0.6, 0.8, 1.2)
"""Its gains towards the planned path, 1/s, 1/m², 1/s: slower than the speeds' own, so both are stable."""
COLUMNS = ("t_s", "v_long_mps", "yaw_rate_radps", "left_nm", "right_nm")


def drive_of(design: Design, question: Question, robot: RobotParameters) -> DriveFile:
    """The drive as ``synth`` plays it: speeds that a controller follows within the torque bound."""
    profile = design.profile
    asked = " and ".join(question.names) or "the effects of the library"
    return DriveFile(
        "excite-" + "-".join(question.names or ("library",)),
        "speeds",
        tuple(round(t, 6) for t in profile.t_s.tolist()),
        tuple(profile.v_mps.tolist()),
        tuple(profile.yaw_rate_radps.tolist()),
        robot,
        Controller(*GAINS, design.limits.torque_nm, *ON_PATH),
        f"designed to tell {asked} apart",
    )


def columns_of(design: Design) -> dict[str, F64]:
    """The commands on the torques' grid, by name: speeds, and the torques that the base model needs."""
    reached = Reached.of(design.profile, design.limits.settings.step_s)
    left, right = reached.torques(design.limits.base)
    found = (reached.t_s, reached.v_mps, reached.yaw_rate_radps, left, right)
    return dict(zip(COLUMNS, found, strict=True))


def document_of(design: Design, question: Question, source: str) -> dict[str, Any]:
    """``excite.json``."""
    limits, settings = design.limits, design.limits.settings
    area = limits.bounds.area
    return {
        "source": source,
        "separate": list(question.names),
        "library": question.library,
        "duration_s": design.profile.duration_s,
        "resolves": bool(design.weakest.expected_bic >= settings.wanted_bic),
        "wanted_bic": settings.wanted_bic,
        "manoeuvres": [manoeuvre_row(one) for one in design.chosen],
        "separations": [separation_row(one) for one in design.separations],
        "rest_of_library": [separation_row(one) for one in design.rest_of_library],
        "bounds": {
            "speed_mps": limits.bounds.speed_mps,
            "yaw_rate_radps": limits.bounds.yaw_rate_radps,
            "torque_nm": limits.torque_nm,
            "area_m": [area.radius_m] if area.box_m is None else list(area.box_m),
            "reverse": limits.bounds.reverse,
        },
        "sizes": {name: dict(values) for name, values in question.sizes.items()},
        "noise": {"pose_sd": list(question.pose_sd), "disturbance": question.noise._asdict()},
        "version": __version__,
    }


def manoeuvre_row(one: Chosen) -> dict[str, Any]:
    """A manoeuvre with its time and what it contributes, in units of deviance."""
    return {
        "start_s": one.start_s,
        "duration_s": one.manoeuvre.duration_s,
        "family": one.manoeuvre.family,
        "words": one.manoeuvre.words,
        "contribution": [
            {"missing": missing, "rival": rival, "deviance": drop}
            for (missing, rival), drop in one.contribution.items()
        ],
    }


def separation_row(one: Separation) -> dict[str, Any]:
    """What is expected of a pair."""
    return asdict(one)

"""One colour for each mode and role, safe for the common colour deficiencies (after Okabe and Ito)."""

from typing import TypeAlias

from wmr_schemas.modes import ContactMode
from wmr_schemas.status import Status

Colour: TypeAlias = tuple[int, int, int]

MODE_COLOURS: dict[ContactMode, Colour] = {
    ContactMode.UNDECIDED: (108, 114, 124),
    ContactMode.IDEAL: (0, 158, 115),
    ContactMode.SKIDDING: (230, 159, 0),
    ContactMode.SLIPPING: (204, 121, 167),
    ContactMode.SKIDDING_SLIPPING: (150, 30, 50),
}

STATUS_COLOURS: dict[Status, Colour] = {
    Status.OK: (44, 74, 92),
    Status.WARMING_UP: (86, 140, 180),
    Status.GAP: (170, 60, 60),
    Status.NO_TORQUE: (140, 110, 60),
    Status.NOT_EXCITED: (96, 100, 110),
    Status.NOT_TURNING: (120, 124, 132),
    Status.POSE_NOT_INDEPENDENT: (160, 90, 40),
    Status.POSE_JUMP: (200, 80, 40),
    Status.OUTLIER: (190, 110, 110),
    Status.CLOCKS_APART: (150, 60, 110),
    Status.NO_HEADING: (150, 70, 90),
    Status.RATE_TOO_LOW: (150, 80, 70),
    Status.IMPLAUSIBLE: (160, 60, 60),
    Status.OTHER_DRIVE: (120, 80, 130),
}

ESTIMATE: Colour = (86, 180, 233)
SECOND: Colour = (240, 228, 66)
TRUTH: Colour = (213, 94, 0)
TRUE_PATH: Colour = (232, 234, 238)
BAND: Colour = (52, 108, 140)
SECOND_BAND: Colour = (132, 124, 46)
DIFFERENCE: Colour = (240, 160, 120)
NOMINAL: Colour = (150, 154, 160)
BASE: Colour = (213, 94, 0)
EXTENDED: Colour = (86, 180, 233)
VECTOR: Colour = (250, 250, 250)
MODELS: dict[str, Colour] = {"base": BASE, "extended": EXTENDED}
ERRORS: tuple[Colour, ...] = (
    (58, 96, 190),
    (52, 138, 214),
    (64, 182, 206),
    (120, 210, 150),
    (236, 220, 70),
    (246, 164, 44),
    (236, 104, 40),
    (214, 40, 48),
)
"""Errors from none to the largest."""
NOT_SIMULATED: Colour = (96, 100, 108)
HELD_OUT: Colour = (62, 66, 74)
FITTED: Colour = (44, 74, 92)
REGION: Colour = (240, 228, 66)
GRID: Colour = (58, 61, 66)
GRID_LABEL: Colour = (150, 154, 160)
ROBOT: Colour = (255, 255, 255)
VELOCITY: Colour = (120, 200, 255)


def mode_name(mode: ContactMode) -> str:
    """The mode's name on screen, such as ``skidding and slipping``."""
    return mode.label.replace("_", " and ")


def class_id(mode: int) -> int:
    """Rerun's class of a mode: classes start at 0, modes at −1."""
    return mode + 1

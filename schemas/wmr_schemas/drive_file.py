"""``drive.toml``: a drive to be played, as speeds that a controller follows or as torques.

``synth`` plays it, ``excite`` writes it. Robot conventions (REP 103), N·m, m/s, rad/s.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, get_args

import tomli_w

from wmr_schemas.errors import InvalidFile
from wmr_schemas.robot import RobotParameters
from wmr_schemas.text import toml_shown
from wmr_schemas.tomlfile import check_keys, expect_number, expect_table, expect_text, read_toml

Follow = Literal["speeds", "torques"]
COLUMNS: dict[Follow, tuple[str, str]] = {
    "speeds": ("v_long_mps", "yaw_rate_radps"),
    "torques": ("left_nm", "right_nm"),
}
GAINS = ("proportional_per_s", "integral_per_s2", "limit_nm")
ON_PATH = ("ahead_per_s", "across_per_m2", "heading_per_s")


@dataclass(frozen=True)
class Controller:
    """PI control on speed and yaw rate towards an acceleration, in 1/s and 1/s²; the largest torque of a
    wheel in N·m.

    Where the pose is known, speed and yaw rate are corrected towards the path that the drive leads along:

        v cos e_yaw + k_x e_x      yaw_rate + v k_y e_y + k_yaw sin e_yaw      (Kanayama et al., 1990)

    with k_x (1/s), k_y (1/m²) and k_yaw (1/s); all 0: nobody looks at the pose.
    """

    proportional_per_s: float
    integral_per_s2: float
    limit_nm: float
    ahead_per_s: float = 0.0
    across_per_m2: float = 0.0
    heading_per_s: float = 0.0


@dataclass(frozen=True)
class DriveFile:
    """A drive: knots ``t_s`` from 0 on, and two columns at them.

    With ``follow`` ``speeds``, ``first`` is v_long and ``second`` the yaw rate, joined by straight lines;
    the controller follows them, with the acceleration that they ask for as feedforward. With ``torques`` they
    are the torques left and right, each held from its knot on, whatever the robot does.
    """

    name: str
    follow: Follow
    t_s: tuple[float, ...]
    first: tuple[float, ...]
    second: tuple[float, ...]
    robot: RobotParameters
    controller: Controller | None = None
    description: str = ""

    @property
    def duration_s(self) -> float:
        """The last knot."""
        return self.t_s[-1]


def drive_to_toml(drive: DriveFile) -> str:
    """The text of a drive file; :func:`read_drive` gives the same back."""
    first, second = COLUMNS[drive.follow]
    tables: dict[str, Any] = {
        "drive": {
            "name": drive.name,
            "description": drive.description,
            "follow": drive.follow,
            "t_s": list(drive.t_s),
            first: list(drive.first),
            second: list(drive.second),
        },
        "robot": drive.robot.known(),
    }
    if drive.controller is not None:
        tables["controller"] = vars(drive.controller)
    return toml_shown(tomli_w.dumps(tables))


def read_drive(path: Path) -> DriveFile:
    """Read and check a drive file. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, ("drive", "robot", "controller"))
    drive = expect_table(path, "[drive]", tables.get("drive"))
    follow = follow_of(path, drive.get("follow"))
    names = COLUMNS[follow]
    check_keys(path, "[drive]", drive, ("name", "description", "follow", "t_s", *names))
    t_s, first, second = (numbers(path, f"[drive] {key}", drive.get(key)) for key in ("t_s", *names))
    check_knots(path, t_s, first, second, names)
    controller = tables.get("controller")
    if (controller is None) == (follow == "speeds"):
        need = "speeds need one to follow them" if controller is None else "torques are played as they are"
        raise InvalidFile(path, "[controller]", need)
    return DriveFile(
        expect_text(path, "[drive] name", drive.get("name")),
        follow,
        t_s,
        first,
        second,
        RobotParameters.from_values(expect_table(path, "[robot]", tables.get("robot", {})), str(path)),
        None if controller is None else controller_of(path, expect_table(path, "[controller]", controller)),
        expect_text(path, "[drive] description", drive.get("description", "")),
    )


def follow_of(path: Path, value: object) -> Follow:
    """What is played."""
    for known in get_args(Follow):
        if value == known:
            return known  # type: ignore[no-any-return]
    raise InvalidFile(path, "[drive] follow", f"expected {' or '.join(get_args(Follow))}, found {value!r}")


def controller_of(path: Path, table: Mapping[str, Any]) -> Controller:
    """The gains, not below 0, and a limit above it."""
    check_keys(path, "[controller]", table, (*GAINS, *ON_PATH))
    missing = [key for key in GAINS if key not in table]
    if missing:
        raise InvalidFile(path, "[controller]", f"lacks {', '.join(missing)}")
    p, i, limit = (expect_number(path, f"[controller] {key}", table[key]) for key in GAINS)
    on_path = [expect_number(path, f"[controller] {key}", table.get(key, 0.0)) for key in ON_PATH]
    if min(p, i, *on_path) < 0 or not limit > 0:
        raise InvalidFile(path, "[controller]", "gains must not be negative, and the limit above 0")
    if any(on_path) and not all(on_path):
        raise InvalidFile(path, "[controller]", f"{', '.join(ON_PATH)} belong together")
    return Controller(p, i, limit, *on_path)


def numbers(path: Path, key: str, value: object) -> tuple[float, ...]:
    """A list of finite numbers."""
    if not isinstance(value, list) or not all(
        isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x) for x in value
    ):
        raise InvalidFile(path, key, "expected a list of finite numbers")
    return tuple(map(float, value))


def check_knots(
    path: Path,
    t_s: tuple[float, ...],
    first: tuple[float, ...],
    second: tuple[float, ...],
    names: tuple[str, str],
) -> None:
    """Raises InvalidFile unless there are two knots or more from 0 on, increasing, with both columns."""
    if len(t_s) < 2 or t_s[0] != 0 or any(b <= a for a, b in pairwise(t_s)):
        raise InvalidFile(path, "[drive] t_s", "expected two times or more, increasing from 0 on")
    for name, column in zip(names, (first, second), strict=True):
        if len(column) != len(t_s):
            raise InvalidFile(path, f"[drive] {name}", f"{len(column)} values for {len(t_s)} times")

"""``columns.toml``: which columns of a CSV file hold time, pose, torques, wheel speeds and commands, and
where the pose is of.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from wmr_schemas.errors import InvalidFile
from wmr_schemas.mapping_file import one_of, positive, sign
from wmr_schemas.model_file import number
from wmr_schemas.robot import RobotParameters
from wmr_schemas.tomlfile import check_keys, expect_table, expect_text, read_toml
from wmr_schemas.units import RIM_SPEED, SPEED_UNITS

REQUIRED = ("time", "x", "y", "yaw")
COMMANDED = ("command_left", "command_right")
TWIST = ("command_linear", "command_angular")
OPTIONAL = (
    "effort_left",
    "effort_right",
    "speed_left",
    "speed_right",
    *COMMANDED,
    *TWIST,
    "steering",
    "mode",
    "window",
)
PAIRS = (COMMANDED, TWIST)


@dataclass(frozen=True)
class SpeedUnits:
    """What wheel speeds in a CSV file are multiplied with."""

    scale: float = 1.0
    unit: str = "rad/s"
    left_sign: float = 1.0
    right_sign: float = 1.0
    gear_ratio: float = 1.0

    def gains(self, wheel_radius_m: float | None) -> tuple[float, float]:
        """Rad/s of the wheel per unit of the values, left and right, with their signs."""
        radians = 1 / (wheel_radius_m or 1.0) if self.unit == RIM_SPEED else SPEED_UNITS[self.unit]
        gain = self.scale * radians / self.gear_ratio
        return gain * self.left_sign, gain * self.right_sign


@dataclass(frozen=True)
class CsvMap:
    """Column names by signal; the tracked point in the robot's frame, from N; what to add to the measured
    yaw.

    Time in s (since whenever), x and y in m, yaw in rad, efforts in N·m forward positive, measured and
    commanded wheel speeds in rad/s unless ``speeds`` and ``commands`` say otherwise, a commanded twist in m/s
    and rad/s, mode 0 to 3. The pose of N is p − R(yaw)·(reference_x_m, reference_y_m). Where the value of the
    column ``window`` changes, a stretch begins that does not follow on the one before it.
    """

    columns: dict[str, str]
    reference_x_m: float = 0.0
    reference_y_m: float = 0.0
    yaw_offset_rad: float = 0.0
    robot: RobotParameters = RobotParameters()
    speeds: SpeedUnits = SpeedUnits()
    commands: SpeedUnits = SpeedUnits()


def read_csv_map(path: Path) -> CsvMap:
    """Read and check a column map. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, ("columns", "pose", "wheel_speeds", "commands", "robot"))
    columns = expect_table(path, "[columns]", tables.get("columns", {}))
    check_keys(path, "[columns]", columns, (*REQUIRED, *OPTIONAL))
    missing = [key for key in REQUIRED if key not in columns]
    if missing:
        raise InvalidFile(path, "[columns]", f"lacks {', '.join(missing)}")
    for pair in PAIRS:
        if len(lacking := [key for key in pair if key not in columns]) == 1:
            raise InvalidFile(path, f"[columns] {lacking[0]}", f"is needed, too: {' and '.join(pair)}")
    if all(pair[0] in columns for pair in PAIRS):
        raise InvalidFile(path, "[columns] command_linear", "stands in place of command_left, not beside it")
    place = expect_table(path, "[pose]", tables.get("pose", {}))
    check_keys(path, "[pose]", place, ("reference_x_m", "reference_y_m", "yaw_offset_rad"))
    robot = expect_table(path, "[robot]", tables.get("robot", {}))
    known = RobotParameters.from_values(robot, str(path))
    speeds, commands = (speed_units(path, name, tables) for name in ("wheel_speeds", "commands"))
    if RIM_SPEED in (speeds.unit, commands.unit) and known.wheel_radius_m is None:
        raise InvalidFile(path, "[robot] wheel_radius_m", f"is needed where a unit is {RIM_SPEED}")
    if TWIST[0] in columns and None in (known.wheel_radius_m, known.half_track_m):
        raise InvalidFile(path, "[robot]", "needs wheel_radius_m and half_track_m for command_linear")
    return CsvMap(
        {key: expect_text(path, f"[columns] {key}", name) for key, name in columns.items()},
        **{key: number(path, f"[pose] {key}", value) for key, value in place.items()},
        robot=known,
        speeds=speeds,
        commands=commands,
    )


def speed_units(path: Path, section: str, tables: dict[str, Any]) -> SpeedUnits:
    """The units of a section. Raises InvalidFile naming the key at fault."""
    table = expect_table(path, f"[{section}]", tables.get(section, {}))
    check_keys(path, f"[{section}]", table, tuple(f.name for f in fields(SpeedUnits)))
    readers: dict[str, Callable[[Path, str, object], Any]] = {
        "unit": one_of((*SPEED_UNITS, RIM_SPEED)),
        "left_sign": sign,
        "right_sign": sign,
    }
    return SpeedUnits(
        **{key: readers.get(key, positive)(path, f"[{section}] {key}", value) for key, value in table.items()}
    )

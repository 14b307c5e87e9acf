"""``columns.toml``: which columns of a CSV file hold time, pose, torques and wheel speeds, and where the pose
is of.
"""

from dataclasses import dataclass
from pathlib import Path

from wmr_schemas.errors import InvalidFile
from wmr_schemas.model_file import number
from wmr_schemas.robot import RobotParameters
from wmr_schemas.tomlfile import check_keys, expect_table, expect_text, read_toml

REQUIRED = ("time", "x", "y", "yaw")
OPTIONAL = ("effort_left", "effort_right", "speed_left", "speed_right", "mode")


@dataclass(frozen=True)
class CsvMap:
    """Column names by signal; the tracked point in the robot's frame, from N; what to add to the measured
    yaw.

    Time in s (since whenever), x and y in m, yaw in rad, efforts in N·m forward positive, wheel speeds in
    rad/s, mode 0 to 3. The pose of N is p − R(yaw)·(reference_x_m, reference_y_m).
    """

    columns: dict[str, str]
    reference_x_m: float = 0.0
    reference_y_m: float = 0.0
    yaw_offset_rad: float = 0.0
    robot: RobotParameters = RobotParameters()


def read_csv_map(path: Path) -> CsvMap:
    """Read and check a column map. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, ("columns", "pose", "robot"))
    columns = expect_table(path, "[columns]", tables.get("columns", {}))
    check_keys(path, "[columns]", columns, (*REQUIRED, *OPTIONAL))
    missing = [key for key in REQUIRED if key not in columns]
    if missing:
        raise InvalidFile(path, "[columns]", f"lacks {', '.join(missing)}")
    place = expect_table(path, "[pose]", tables.get("pose", {}))
    check_keys(path, "[pose]", place, ("reference_x_m", "reference_y_m", "yaw_offset_rad"))
    robot = expect_table(path, "[robot]", tables.get("robot", {}))
    return CsvMap(
        {key: expect_text(path, f"[columns] {key}", name) for key, name in columns.items()},
        **{key: number(path, f"[pose] {key}", value) for key, value in place.items()},
        robot=RobotParameters.from_values(robot, str(path)),
    )

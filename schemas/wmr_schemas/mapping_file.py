"""``robot.toml``: which topics of a log hold pose, torques and truth, and what is known of the robot."""

from dataclasses import dataclass
from pathlib import Path

from wmr_schemas.errors import InvalidFile
from wmr_schemas.robot import RobotParameters
from wmr_schemas.tomlfile import check_keys, expect_table, expect_text, read_toml


@dataclass(frozen=True)
class LogMapping:
    """What the user said about a log; None and () mean "find it yourself"."""

    pose_topic: str | None = None
    torque_topic: str | None = None
    left_joints: tuple[str, ...] = ()
    right_joints: tuple[str, ...] = ()
    truth_topic: str | None = None
    robot: RobotParameters | None = None


_SECTIONS = {"pose": ("topic",), "torque": ("topic", "left", "right"), "truth": ("topic",)}


def read_mapping(path: Path) -> LogMapping:
    """Read and check a mapping file. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, (*_SECTIONS, "robot"))
    sections = {name: expect_table(path, f"[{name}]", tables.get(name, {})) for name in _SECTIONS}
    for name, keys in _SECTIONS.items():
        check_keys(path, f"[{name}]", sections[name], keys)
    robot = tables.get("robot")
    return LogMapping(
        pose_topic=text(path, "[pose] topic", sections["pose"].get("topic")),
        torque_topic=text(path, "[torque] topic", sections["torque"].get("topic")),
        left_joints=names(path, "[torque] left", sections["torque"].get("left", [])),
        right_joints=names(path, "[torque] right", sections["torque"].get("right", [])),
        truth_topic=text(path, "[truth] topic", sections["truth"].get("topic")),
        robot=None
        if robot is None
        else RobotParameters.from_values(expect_table(path, "[robot]", robot), str(path)),
    )


def text(path: Path, key: str, value: object) -> str | None:
    """A string, or nothing."""
    return None if value is None else expect_text(path, key, value)


def names(path: Path, key: str, value: object) -> tuple[str, ...]:
    """A list of names; one name alone is a list of one."""
    items = [value] if isinstance(value, str) else value
    if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
        raise InvalidFile(path, key, f"expected a list of joint names, found {value!r}")
    return tuple(items)

"""``robot.toml``: topics and fields that hold the signals of a log; the robot's known parameters."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

import tomli_w

from wmr_schemas.errors import InvalidFile
from wmr_schemas.robot import RobotParameters, described
from wmr_schemas.text import toml_shown
from wmr_schemas.tomlfile import check_keys, expect_number, expect_table, expect_text, read_toml
from wmr_schemas.units import ANGLE_UNITS, CLOCKS, SPEED_UNITS, Clock
from wmr_schemas.wheel_fields import (
    COMMAND_UNITS,
    WHEEL_UNITS,
    CommandFields,
    WheelSpeedFields,
    what_is_wrong,
)


@dataclass(frozen=True)
class PoseFields:
    """What ``[pose]`` says besides the topic; None: found by schema."""

    position: str | None = field(default=None, metadata=described("path", "of a struct with `x` and `y`"))
    orientation: str | None = field(
        default=None, metadata=described("path", "of a quaternion with `x`, `y`, `z`, `w`")
    )
    x: str | None = field(
        default=None,
        metadata=described("path", "of a number; with `y` and `yaw` instead of the two above"),
    )
    y: str | None = field(default=None, metadata=described("path", "of a number"))
    yaw: str | None = field(default=None, metadata=described("path", "of a number in `yaw_unit`"))
    parent: str | None = field(
        default=None, metadata=described("string", "transforms: the fixed frame, such as `map`")
    )
    child: str | None = field(
        default=None, metadata=described("string", "transforms: the robot's frame, such as `base_link`")
    )
    position_scale: float = field(
        default=1.0, metadata=described("number", "m per unit of the position: 0.001 for millimetres")
    )
    yaw_unit: str = field(default="rad", metadata=described("string", "`rad` or `deg`; of the field `yaw`"))
    yaw_sign: float = field(
        default=1.0, metadata=described("1 or -1", "-1 where the field `yaw` grows clockwise, as a heading")
    )
    yaw_offset_rad: float = field(default=0.0, metadata=described("number", "measured yaw minus the robot's"))
    lever_arm_m: tuple[float, float] = field(
        default=(0.0, 0.0),
        metadata=described("[x, y]", "the measured point, ahead of and left of the driving axle's midpoint"),
    )
    clock: Clock | None = field(default=None, metadata=described("string", "`header`, `publish` or `log`"))


@dataclass(frozen=True)
class TorqueFields:
    """What ``[torque]`` says besides topic and joints; None: found by schema."""

    names: str | None = field(
        default=None, metadata=described("path", "of the array of joint names (`name`)")
    )
    efforts: str | None = field(
        default=None,
        metadata=described(
            "path", "of the array of torques or currents (`effort`); in DynamicJointState the interface"
        ),
    )
    speeds: str | None = field(
        default=None,
        metadata=described("path", "of the array of speeds (`velocity`); in DynamicJointState the interface"),
    )
    left_fields: tuple[str, ...] = field(
        default=(),
        metadata=described("paths", "of torques or currents of the left side, instead of joints by name"),
    )
    right_fields: tuple[str, ...] = field(
        default=(), metadata=described("paths", "the same of the right side")
    )
    left_speed_fields: tuple[str, ...] = field(
        default=(), metadata=described("paths", "of wheel speeds of the left side")
    )
    right_speed_fields: tuple[str, ...] = field(
        default=(), metadata=described("paths", "the same of the right side")
    )
    left_sign: float = field(
        default=1.0, metadata=described("1 or -1", "-1 where a positive value drives the left side backward")
    )
    right_sign: float = field(default=1.0, metadata=described("1 or -1", "the same of the right side"))
    left_torque_sign: float | None = field(
        default=None, metadata=described("1 or -1", "for the torque alone, in place of `left_sign`")
    )
    right_torque_sign: float | None = field(
        default=None, metadata=described("1 or -1", "the same of the right side")
    )
    left_speed_sign: float | None = field(
        default=None, metadata=described("1 or -1", "for the speed alone, in place of `left_sign`")
    )
    right_speed_sign: float | None = field(
        default=None, metadata=described("1 or -1", "the same of the right side")
    )
    torque_scale: float = field(
        default=1.0, metadata=described("number", "N·m, or A, per unit of the values: 0.001 for mN·m or mA")
    )
    speed_scale: float = field(
        default=1.0,
        metadata=described("number", "`speed_unit` per unit of the values: 1/pole pairs for electrical rpm"),
    )
    speed_unit: str = field(
        default="rad/s", metadata=described("string", "`rad/s`, `rpm`, `deg/s` or `rev/s`")
    )
    torque_constant_nm_per_a: float = field(
        default=1.0, metadata=described("number", "N·m per A at the motor, where the values are currents")
    )
    gear_ratio: float = field(
        default=1.0, metadata=described("number", "motor turns per wheel turn: multiplies torques")
    )
    speeds_before_gear: bool = field(
        default=False,
        metadata=described("true or false", "whether speeds are the motor's, to be divided by `gear_ratio`"),
    )
    clock: Clock | None = field(default=None, metadata=described("string", "`header`, `publish` or `log`"))

    @property
    def torque_gains(self) -> tuple[float, float]:
        """N·m at the wheel per unit of the values, left and right, with their signs."""
        gain = self.torque_scale * self.torque_constant_nm_per_a * self.gear_ratio
        return _signed(gain, (self.left_torque_sign, self.right_torque_sign), self._signs)

    @property
    def speed_gains(self) -> tuple[float, float]:
        """Rad/s of the wheel per unit of the values, left and right, with their signs."""
        slower = self.gear_ratio if self.speeds_before_gear else 1.0
        gain = self.speed_scale * SPEED_UNITS[self.speed_unit] / slower
        return _signed(gain, (self.left_speed_sign, self.right_speed_sign), self._signs)

    @property
    def _signs(self) -> tuple[float, float]:
        """The signs of both signals, left and right."""
        return self.left_sign, self.right_sign


def _signed(
    gain: float, own: tuple[float | None, float | None], common: tuple[float, float]
) -> tuple[float, float]:
    """The gain of each side, with the signal's own sign where there is one."""
    left, right = (usual if sign is None else sign for sign, usual in zip(own, common, strict=True))
    return left * gain, right * gain


@dataclass(frozen=True)
class TruthFields:
    """What ``[truth]`` says besides the topic."""

    path: str = field(default="mode", metadata=described("path", "of the number of the mode"))
    clock: Clock | None = field(default=None, metadata=described("string", "`header`, `publish` or `log`"))


Joints = tuple[tuple[str, ...], tuple[str, ...]]


@dataclass(frozen=True)
class LogMapping:
    """What the user said about a log; None and () mean "find it yourself"."""

    pose_topic: str | None = None
    torque_topic: str | None = None
    left_joints: tuple[str, ...] = ()
    right_joints: tuple[str, ...] = ()
    truth_topic: str | None = None
    robot: RobotParameters | None = None
    """Parameters that override the log's own, key by key."""
    pose: PoseFields = PoseFields()
    torque: TorqueFields = TorqueFields()
    truth: TruthFields = TruthFields()
    clock: Clock | None = None
    """For all signals whose own section names none."""
    robot_from_log: bool = True
    """Whether parameters that ``robot`` does not name come from the log's own metadata."""
    wheel_speed_topic: str | None = None
    wheel_speed_joints: Joints = ((), ())
    """Joints of the left and of the right side; none: those of the torques, else by their names."""
    wheel_speeds: WheelSpeedFields = field(default_factory=WheelSpeedFields)
    command_topic: str | None = None
    command_joints: Joints = ((), ())
    commands: CommandFields = field(default_factory=CommandFields)


WheelFields = TypeVar("WheelFields", bound=CommandFields)

_SECTIONS: dict[str, tuple[type, tuple[str, ...]]] = {
    "pose": (PoseFields, ("topic",)),
    "torque": (TorqueFields, ("topic", "left", "right")),
    "truth": (TruthFields, ("topic",)),
    "wheel_speeds": (WheelSpeedFields, ("topic", "left", "right")),
    "commands": (CommandFields, ("topic", "left", "right")),
}


def read_mapping(path: Path) -> LogMapping:
    """Read and check a mapping file. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, (*_SECTIONS, "robot", "clock", "robot_from_log"))
    sections = {name: expect_table(path, f"[{name}]", tables.get(name, {})) for name in _SECTIONS}
    for name, (record, own) in _SECTIONS.items():
        check_keys(path, f"[{name}]", sections[name], (*own, *(f.name for f in fields(record))))
    robot = tables.get("robot")
    return LogMapping(
        pose_topic=text(path, "[pose] topic", sections["pose"].get("topic")),
        torque_topic=text(path, "[torque] topic", sections["torque"].get("topic")),
        left_joints=joints(path, "torque", sections)[0],
        right_joints=joints(path, "torque", sections)[1],
        truth_topic=text(path, "[truth] topic", sections["truth"].get("topic")),
        robot=None
        if robot is None
        else RobotParameters.from_values(expect_table(path, "[robot]", robot), str(path)),
        pose=PoseFields(**further(path, "pose", sections["pose"])),
        torque=TorqueFields(**further(path, "torque", sections["torque"])),
        truth=TruthFields(**further(path, "truth", sections["truth"])),
        clock=clock(path, "clock", tables["clock"]) if "clock" in tables else None,
        robot_from_log=truth_value(path, "robot_from_log", tables.get("robot_from_log", True)),
        wheel_speed_topic=text(path, "[wheel_speeds] topic", sections["wheel_speeds"].get("topic")),
        wheel_speed_joints=joints(path, "wheel_speeds", sections),
        wheel_speeds=checked(path, "wheel_speeds", WheelSpeedFields, sections),
        command_topic=text(path, "[commands] topic", sections["commands"].get("topic")),
        command_joints=joints(path, "commands", sections),
        commands=checked(path, "commands", CommandFields, sections),
    )


def joints(path: Path, section: str, sections: dict[str, dict[str, Any]]) -> Joints:
    """The joints of the left and of the right side, as a section names them."""
    left, right = (
        names(path, f"[{section}] {side}", sections[section].get(side, [])) for side in ("left", "right")
    )
    return left, right


def checked(
    path: Path, section: str, record: type[WheelFields], sections: dict[str, dict[str, Any]]
) -> WheelFields:
    """A section's record, whose keys go together."""
    found = record(**further(path, section, sections[section]))
    if wrong := what_is_wrong(found):
        raise InvalidFile(path, f"[{section}] {wrong[0]}", wrong[1])
    return found


def further(path: Path, section: str, table: dict[str, Any]) -> dict[str, Any]:
    """The keys of a section's record, checked."""
    kinds = {f.name: f.metadata["unit"] for f in fields(_SECTIONS[section][0])}
    return {
        name: reader(section, name, kinds[name])(path, f"[{section}] {name}", value)
        for name, value in table.items()
        if name in kinds
    }


def reader(section: str, name: str, kind: str) -> Callable[[Path, str, object], Any]:
    """What reads a key of a section's record."""
    own = _UNITS.get(section) if name == "unit" else None
    return own or _READERS.get(name, _KINDS[kind])


def text(path: Path, key: str, value: object) -> str | None:
    """A string, or nothing."""
    return None if value is None else expect_text(path, key, value)


def names(path: Path, key: str, value: object, what: str = "joint names") -> tuple[str, ...]:
    """A list of names; one name alone is a list of one."""
    items = [value] if isinstance(value, str) else value
    if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
        raise InvalidFile(path, key, f"expected a list of {what}, found {value!r}")
    return tuple(items)


def paths(path: Path, key: str, value: object) -> tuple[str, ...]:
    """A list of field paths."""
    return names(path, key, value, "field paths")


def clock(path: Path, key: str, value: object) -> Clock:
    """The name of a clock."""
    for known in CLOCKS:
        if value == known:
            return known
    raise InvalidFile(path, key, f"expected header, publish or log, found {value!r}")


def sign(path: Path, key: str, value: object) -> float:
    """1 or −1."""
    if value not in {1, -1} or isinstance(value, bool):
        raise InvalidFile(path, key, f"expected 1 or -1, found {value!r}")
    return float(value)


def positive(path: Path, key: str, value: object) -> float:
    """A number above 0."""
    number = expect_number(path, key, value)
    if number <= 0:
        raise InvalidFile(path, key, f"expected a number above 0, found {value!r}")
    return number


def one_of(known: Iterable[str]) -> Callable[[Path, str, object], str]:
    """A reader of one of these words."""
    words = tuple(known)

    def read(path: Path, key: str, value: object) -> str:
        if not isinstance(value, str) or value not in words:
            raise InvalidFile(path, key, f"expected {', '.join(words[:-1])} or {words[-1]}, found {value!r}")
        return value

    return read


def point(path: Path, key: str, value: object) -> tuple[float, float]:
    """Two numbers."""
    if not isinstance(value, list) or len(value) != 2:
        raise InvalidFile(path, key, f"expected two numbers [x, y], found {value!r}")
    return expect_number(path, key, value[0]), expect_number(path, key, value[1])


def truth_value(path: Path, key: str, value: object) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise InvalidFile(path, key, f"expected true or false, found {value!r}")
    return value


_KINDS: dict[str, Callable[[Path, str, object], Any]] = {
    "path": expect_text,
    "string": expect_text,
    "paths": paths,
    "number": expect_number,
    "1 or -1": sign,
    "[x, y]": point,
    "true or false": truth_value,
}
_READERS: dict[str, Callable[[Path, str, object], Any]] = {
    "clock": clock,
    "gear_ratio": positive,
    "torque_constant_nm_per_a": positive,
    "position_scale": positive,
    "torque_scale": positive,
    "speed_scale": positive,
    "scale": positive,
    "ticks_per_rev": positive,
    "wraps_at": positive,
    "yaw_unit": one_of(ANGLE_UNITS),
    "speed_unit": one_of(SPEED_UNITS),
}


_UNITS = {"wheel_speeds": one_of(WHEEL_UNITS), "commands": one_of(COMMAND_UNITS)}


def mapping_toml(mapping: LogMapping) -> str:
    """The text of a file that reads back as ``mapping``; unset fields are left out."""
    sides = {
        "torque": (mapping.left_joints, mapping.right_joints),
        "wheel_speeds": mapping.wheel_speed_joints,
        "commands": mapping.command_joints,
    }
    joints = {name: {"left": left, "right": right} for name, (left, right) in sides.items()}
    sections: dict[str, Any] = {
        "pose": _section(mapping.pose_topic, {}, mapping.pose),
        "torque": _section(mapping.torque_topic, joints["torque"], mapping.torque),
        "truth": _section(mapping.truth_topic, {}, mapping.truth),
        "wheel_speeds": _section(mapping.wheel_speed_topic, joints["wheel_speeds"], mapping.wheel_speeds),
        "commands": _section(mapping.command_topic, joints["commands"], mapping.commands),
        "robot": mapping.robot.known() if mapping.robot else {},
    }
    head: dict[str, Any] = {"clock": mapping.clock} if mapping.clock else {}
    if not mapping.robot_from_log:
        head["robot_from_log"] = False
    return toml_shown(tomli_w.dumps(head | {name: table for name, table in sections.items() if table}))


def _section(topic: str | None, more: dict[str, Any], record: Any) -> dict[str, Any]:
    values = {f.name: (getattr(record, f.name), f.default) for f in fields(record)}
    found = (
        {"topic": topic} | more | {name: value for name, (value, usual) in values.items() if value != usual}
    )
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in found.items()
        if value not in (None, ())
    }

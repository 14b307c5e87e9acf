"""``[wheel_speeds]`` and ``[commands]`` of a mapping file: where wheel speeds stand, and in which units."""

import math
from dataclasses import dataclass, field

from wmr_schemas.robot import described
from wmr_schemas.units import RIM_SPEED, SPEED_UNITS, TICKS, TURN_UNITS, Clock

COMMAND_UNITS = (*SPEED_UNITS, RIM_SPEED)
WHEEL_UNITS = (*COMMAND_UNITS, *TURN_UNITS, TICKS)
USUAL_UNIT = "rad/s"


@dataclass(frozen=True)
class CommandFields:
    """What ``[commands]`` says besides topic and joints; None: found by schema."""

    names: str | None = field(
        default=None, metadata=described("path", "of the array of joint names (`name`, `joint_names`)")
    )
    values: str | None = field(
        default=None,
        metadata=described(
            "path",
            "of the array of values (`velocity`, `feedback.velocities`); in DynamicJointState the interface",
        ),
    )
    left_fields: tuple[str, ...] = field(
        default=(), metadata=described("paths", "of values of the left side, instead of joints by name")
    )
    right_fields: tuple[str, ...] = field(
        default=(), metadata=described("paths", "the same of the right side")
    )
    linear: str | None = field(
        default=None,
        metadata=described("path", "of a twist's speed in m/s, instead of wheels (`twist.twist.linear.x`)"),
    )
    angular: str | None = field(
        default=None, metadata=described("path", "of its yaw rate in rad/s (`twist.twist.angular.z`)")
    )
    left_sign: float = field(
        default=1.0, metadata=described("1 or -1", "-1 where a positive value drives the left side backward")
    )
    right_sign: float = field(default=1.0, metadata=described("1 or -1", "the same of the right side"))
    scale: float = field(
        default=1.0,
        metadata=described("number", "`unit` per unit of the values: 1/pole pairs for electrical rpm"),
    )
    unit: str | None = field(
        default=None, metadata=described("string", f"{', '.join(f'`{unit}`' for unit in COMMAND_UNITS)}")
    )
    gear_ratio: float = field(
        default=1.0,
        metadata=described("number", "motor turns per wheel turn, where the values are the motor's: divides"),
    )
    clock: Clock | None = field(default=None, metadata=described("string", "`header`, `publish` or `log`"))

    @property
    def name_values(self) -> bool:
        """Whether they say where the values stand, and not only what they are."""
        return bool(self.values or self.left_fields or self.linear)

    def gains(self, wheel_radius_m: float) -> tuple[float, float]:
        """Rad/s, or rad, of the wheel per unit of the values, left and right, with their signs."""
        gain = self.scale * self._radians(wheel_radius_m) / self.gear_ratio
        return gain * self.left_sign, gain * self.right_sign

    def _radians(self, wheel_radius_m: float) -> float:
        """Radians, or rad/s, in one unit."""
        unit = self.unit or USUAL_UNIT
        return 1 / wheel_radius_m if unit == RIM_SPEED else SPEED_UNITS[unit]


@dataclass(frozen=True)
class WheelSpeedFields(CommandFields):
    """What ``[wheel_speeds]`` says besides topic and joints; None: found by schema.

    With a unit of angles the values are positions, whose differences give the speeds.
    """

    unit: str | None = field(
        default=None,
        metadata=described(
            "string",
            f"{', '.join(f'`{unit}`' for unit in COMMAND_UNITS)}; of positions "
            f"{', '.join(f'`{unit}`' for unit in (*TURN_UNITS, TICKS))}",
        ),
    )
    ticks_per_rev: float | None = field(
        default=None, metadata=described("number", "an encoder's counts in one turn; of positions in `ticks`")
    )
    wraps_at: float | None = field(
        default=None,
        metadata=described(
            "number",
            "positions: the range after which they begin again; integers of 8 to 32 bits have their own",
        ),
    )

    @property
    def are_positions(self) -> bool:
        """Whether the values are positions by their unit."""
        return self.ticks_per_rev is not None or self.unit in (*TURN_UNITS, TICKS)

    def _radians(self, wheel_radius_m: float) -> float:
        if self.ticks_per_rev is not None:
            return 2 * math.pi / self.ticks_per_rev
        return TURN_UNITS[self.unit] if self.unit in TURN_UNITS else super()._radians(wheel_radius_m)


def what_is_wrong(fields: CommandFields) -> tuple[str, str] | None:
    """The key and the reason of what does not go together; None where all does."""
    pairs = (("left_fields", "right_fields"), ("linear", "angular"))
    for pair in pairs:
        for key, other in (pair, pair[::-1]):
            if getattr(fields, key) and not getattr(fields, other):
                return other, f"has to be given with {key}"
    if fields.linear and (fields.left_fields or fields.values):
        return "linear", "a twist is given in place of values by wheel, not beside them"
    if fields.linear and fields.unit:
        return "unit", "a twist is in m/s and rad/s"
    return _wrong_positions(fields) if isinstance(fields, WheelSpeedFields) else None


def _wrong_positions(fields: WheelSpeedFields) -> tuple[str, str] | None:
    """The same of the keys for positions."""
    if fields.unit == TICKS and fields.ticks_per_rev is None:
        return "ticks_per_rev", 'has to be given with unit = "ticks"'
    if fields.ticks_per_rev is not None and fields.unit not in {None, TICKS}:
        return "ticks_per_rev", f'goes with unit = "ticks", not with {fields.unit!r}'
    if fields.ticks_per_rev is not None and fields.linear:
        return "ticks_per_rev", "a twist has no ticks"
    if fields.wraps_at is not None and not fields.are_positions:
        return "wraps_at", "is for positions: give unit, or ticks_per_rev"
    return None

"""Signals that are checked once, at construction, and trusted afterwards.

Conventions: REP 103 (x forward, y left, yaw counter-clockwise from the world's x axis; a positive effort
drives forward), int64 nanoseconds, SI units named in every field. All arrays of a track have shape (n,).
"""

from dataclasses import dataclass, fields

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, NS_PER_S
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.robot import RobotParameters


def first_true(mask: np.ndarray) -> int | None:
    """Index of the first true element, or None."""
    index = int(np.argmax(mask)) if mask.size else 0
    return index if mask.size and mask[index] else None


def check_stamps(signal: str, t_ns: I64) -> None:
    """Stamps are int64, one-dimensional and strictly increasing."""
    if t_ns.ndim != 1 or t_ns.dtype != np.int64:
        raise InvalidSignal(
            signal, f"t_ns must be int64 of shape (n,), not {t_ns.dtype} of shape {t_ns.shape}"
        )
    row = first_true(np.diff(t_ns) <= 0)
    if row is not None:
        raise InvalidSignal(signal, "t_ns not increasing", row + 1)


def check_columns(signal: str, n: int, columns: dict[str, F64], *, allow_nan: bool = False) -> None:
    """Columns are float64 of shape (n,) and finite (or NaN, where that means "unknown")."""
    for name, column in columns.items():
        if column.shape != (n,) or column.dtype != np.float64:
            raise InvalidSignal(
                signal, f"{name} must be float64 of shape ({n},), not {column.dtype} of shape {column.shape}"
            )
        row = first_true(np.isinf(column) if allow_nan else ~np.isfinite(column))
        if row is not None:
            raise InvalidSignal(signal, f"{name} is {column[row]}", row)


def described(
    track: "PoseTrack | TorqueTrack | WheelSpeedTrack | CommandTrack | SteeringTrack | ModeTrack",
) -> str:
    """``<PoseTrack: 6000 rows, 60 s>``."""
    span_s = (int(track.t_ns[-1]) - int(track.t_ns[0])) / NS_PER_S if len(track) else 0.0
    return f"<{type(track).__name__}: {len(track)} rows, {span_s:g} s>"


@dataclass(frozen=True, eq=False, repr=False)
class PoseTrack:
    """External pose of the midpoint N of the driving axle; ``yaw_rad`` wrapped or not."""

    t_ns: I64
    x_m: F64
    y_m: F64
    yaw_rad: F64

    def __post_init__(self) -> None:
        check_stamps("pose", self.t_ns)
        check_columns("pose", len(self.t_ns), {"x_m": self.x_m, "y_m": self.y_m, "yaw_rad": self.yaw_rad})

    def __len__(self) -> int:
        return len(self.t_ns)

    def __repr__(self) -> str:
        return described(self)


@dataclass(frozen=True, eq=False, repr=False)
class TorqueTrack:
    """Wheel torques in N·m, held from their stamp on; wheel speeds in rad/s where known (NaN elsewhere)."""

    t_ns: I64
    left_nm: F64
    right_nm: F64
    left_radps: F64
    right_radps: F64

    def __post_init__(self) -> None:
        check_stamps("torque", self.t_ns)
        columns = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "t_ns"}
        check_columns("torque", len(self.t_ns), columns, allow_nan=True)

    def __len__(self) -> int:
        return len(self.t_ns)

    def __repr__(self) -> str:
        return described(self)


@dataclass(frozen=True, eq=False, repr=False)
class WheelSpeedTrack:
    """Measured wheel speeds in rad/s, at their stamp; positive drives forward, NaN where unknown."""

    t_ns: I64
    left_radps: F64
    right_radps: F64

    def __post_init__(self) -> None:
        check_wheels("wheel speed", self)

    def __len__(self) -> int:
        return len(self.t_ns)

    def __repr__(self) -> str:
        return described(self)


@dataclass(frozen=True, eq=False, repr=False)
class CommandTrack:
    """Commanded wheel speeds in rad/s, held from their stamp on; NaN where unknown.

    A twist command is turned into wheel speeds with the robot's nominal r and l.
    """

    t_ns: I64
    left_radps: F64
    right_radps: F64

    def __post_init__(self) -> None:
        check_wheels("command", self)

    def __len__(self) -> int:
        return len(self.t_ns)

    def __repr__(self) -> str:
        return described(self)


@dataclass(frozen=True, eq=False, repr=False)
class SteeringTrack:
    """What a steered robot is steered by, an angle or a command; a log carries it, no analysis reads it."""

    t_ns: I64
    position: F64

    def __post_init__(self) -> None:
        check_stamps("steering", self.t_ns)
        check_columns("steering", len(self.t_ns), {"position": self.position}, allow_nan=True)

    def __len__(self) -> int:
        return len(self.t_ns)

    def __repr__(self) -> str:
        return described(self)


def check_wheels(signal: str, track: WheelSpeedTrack | CommandTrack) -> None:
    """Stamps and columns of a track of wheel speeds. Raises InvalidSignal."""
    check_stamps(signal, track.t_ns)
    columns = {"left_radps": track.left_radps, "right_radps": track.right_radps}
    check_columns(signal, len(track.t_ns), columns, allow_nan=True)


@dataclass(frozen=True, eq=False, repr=False)
class ModeTrack:
    """Contact mode, held from its stamp on."""

    t_ns: I64
    mode: I8

    def __post_init__(self) -> None:
        check_stamps("mode", self.t_ns)
        if self.mode.shape != self.t_ns.shape or self.mode.dtype != np.int8:
            raise InvalidSignal("mode", f"mode must be int8 of shape {self.t_ns.shape}")
        row = first_true((self.mode < 0) | (self.mode > 3))
        if row is not None:
            raise InvalidSignal("mode", f"{self.mode[row]} is no contact mode (0 to 3)", row)

    def __len__(self) -> int:
        return len(self.t_ns)

    def __repr__(self) -> str:
        return described(self)


@dataclass(frozen=True, eq=False)
class Log:
    """Contents of a log: a pose, and the other signals and nominal parameters where there are any.

    ``wheels`` are the measured wheel speeds, whichever channel holds them; ``commands`` the commanded ones.
    ``breaks_ns`` are the stamps at which a stretch begins that does not follow on the one before it; see
    :func:`wmr_schemas.breaks.stretches`. A ``steering`` says that the robot is no differential drive.
    """

    pose: PoseTrack
    torque: TorqueTrack | None = None
    mode: ModeTrack | None = None
    robot: RobotParameters = RobotParameters()
    wheels: WheelSpeedTrack | None = None
    commands: CommandTrack | None = None
    breaks_ns: tuple[int, ...] = ()
    steering: SteeringTrack | None = None

"""Encoders: counts at a rate of their own, and speeds as differences of counts over their interval."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.signals import TorqueTrack, WheelSpeedTrack
from wmr_synth.plants.motion import Motion
from wmr_synth.sensors import Sensors, arrived, measured, stream

TURN_RAD = 2 * np.pi
OF_TORQUES = ("torque_rate_hz", "noise_effort_sd_nm")
"""Fields of ``Sensors`` that a robot without torques does not use."""


@dataclass(frozen=True)
class EncoderSensors(Sensors):
    """Sensors of a robot that records wheel speeds and no torque.

    ``encoder_ticks`` are the counts of one turn of a wheel, 0 for an exact angle. ``clock_offset_s`` is what
    the wheels' stamps show ahead of the pose's clock.
    """

    wheel_rate_hz: float = 100.0
    encoder_ticks: float = 2048.0
    command_rate_hz: float = 50.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("wheel_rate_hz", "command_rate_hz"):
            if not 1e-3 <= getattr(self, name) <= 1e5:
                raise InvalidSetting(f"{name} must lie between 0.001 and 100000, not {getattr(self, name)}")
        if self.encoder_ticks != round(self.encoder_ticks):
            raise InvalidSetting(f"encoder_ticks is a whole number, not {self.encoder_ticks:g}")


def rates_hz(sensors: Sensors) -> tuple[float, ...]:
    """The rates of the messages that the sensors give."""
    if isinstance(sensors, EncoderSensors):
        return sensors.rate_hz, sensors.wheel_rate_hz, sensors.command_rate_hz
    return sensors.rate_hz, sensors.torque_rate_hz


def counted(angle_rad: F64, ticks: float) -> F64:
    """The angle as an encoder gives it: whole counts, rounded down, in rad."""
    return angle_rad if ticks == 0 else np.floor(angle_rad * (ticks / TURN_RAD)) * (TURN_RAD / ticks)


def measure_wheels(
    motion: Motion, sensors: EncoderSensors, seed: int, start_ns: int
) -> tuple[WheelSpeedTrack, tuple[F64, F64]]:
    """Wheel speeds as logged, of the motion at the encoders' instants, and the positions (left, right) beside
    them. A speed is the difference of two positions over their interval, stamped at its end; the first
    instant has none and gives no message.
    """
    positions = [counted(angle, sensors.encoder_ticks) for angle in (motion.left_rad, motion.right_rad)]
    interval_s = np.diff(motion.t_ns) / NS_PER_S
    names = ("wheel_speed_left", "wheel_speed_right")
    speeds = [
        measured(np.diff(position) / interval_s, sensors.noise_wheel_speed_sd_radps, seed, name)
        for position, name in zip(positions, names, strict=True)
    ]
    kept = arrived(len(interval_s), sensors.dropout, stream(seed, "torque_dropout"))
    t_ns: I64 = start_ns + round(sensors.clock_offset_s * NS_PER_S) + motion.t_ns[1:][kept]
    left, right = (position[1:][kept] for position in positions)
    return WheelSpeedTrack(t_ns, speeds[0][kept], speeds[1][kept]), (left, right)


def measure_efforts(
    motion: Motion, wheels: WheelSpeedTrack, sensors: EncoderSensors, seed: int, *, together: bool
) -> TorqueTrack:
    """Torques as logged at the stamps of the ``wheels``, of the motion at the encoders' instants; with the
    wheel speeds where both are in one message.
    """
    kept = arrived(len(motion.t_ns) - 1, sensors.dropout, stream(seed, "torque_dropout"))
    left, right = (
        measured(effort[1:], sensors.noise_effort_sd_nm, seed, name)[kept]
        for effort, name in (
            (motion.effort_left_nm, "effort_left"),
            (motion.effort_right_nm, "effort_right"),
        )
    )
    unknown = np.full(len(wheels), np.nan)
    speeds = (wheels.left_radps, wheels.right_radps) if together else (unknown, unknown)
    return TorqueTrack(wheels.t_ns, left, right, *speeds)

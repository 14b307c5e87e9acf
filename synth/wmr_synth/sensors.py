"""Sensors: when they sample, what noise they add, what is lost, and whose clock stamps it.

Every draw comes from a stream of its own, derived from the one seed, so that changing one option leaves the
draws of the others alone.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.signals import PoseTrack, TorqueTrack
from wmr_synth.plants.motion import Motion

STREAMS = (
    "scenario",
    "pose_jitter",
    "torque_jitter",
    "pose_dropout",
    "torque_dropout",
    "x",
    "y",
    "yaw",
    "effort_left",
    "effort_right",
    "wheel_speed_left",
    "wheel_speed_right",
    "hide",
    "patch",
    "disturbance",
    "labels",
    "robot",
    "ground",
    "roughness",
    "drivetrain",
)
NOISE_LEVELS = {"mocap": (0.001, 0.002), "rtk": (0.01, 0.005), "poor": (0.05, 0.02)}
"""Standard deviations of a pose sample in m and rad: motion capture, satellites, and worse."""
MAX_JITTER = 0.45
"""Largest displacement of a sample, as a share of the period: samples keep their order."""


@dataclass(frozen=True)
class Sensors:
    """Rates in Hz, standard deviations of a sample, and imperfections of timing.

    ``jitter_s`` is the standard deviation of the sampling instants about their grid; each sample is taken,
    and stamped, at its displaced instant. ``dropout`` is the share of messages lost. ``clock_offset_s`` is
    what the torque stamps show ahead of the pose's clock.
    """

    rate_hz: float = 100.0
    torque_rate_hz: float = 100.0
    noise_xy_sd_m: float = 0.001
    noise_yaw_sd_rad: float = 0.002
    noise_effort_sd_nm: float = 0.0
    noise_wheel_speed_sd_radps: float = 0.0
    jitter_s: float = 0.0
    dropout: float = 0.0
    clock_offset_s: float = 0.0

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            if not np.isfinite(value) or (value < 0 and name != "clock_offset_s"):
                raise InvalidSetting(f"{name} must be a number not below 0, not {value}")
        for name in ("rate_hz", "torque_rate_hz"):
            if not 1e-3 <= getattr(self, name) <= 1e5:
                raise InvalidSetting(f"{name} must lie between 0.001 and 100000, not {getattr(self, name)}")
        if self.dropout > 0.99:
            raise InvalidSetting(f"dropout is a share of the messages, at most 0.99, not {self.dropout}")

    def without_noise(self) -> "Sensors":
        """The same sensors, exact."""
        noise = {f.name: 0.0 for f in fields(self) if f.name.startswith("noise_")}
        return replace(self, **noise)


def stream(seed: int, name: str, *part: int) -> np.random.Generator:
    """The random stream called ``name``, or a part of it, independent of all others of the seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAMS.index(name), *part)))


def sampling_instants(duration_s: float, rate_hz: float, jitter_s: float, rng: np.random.Generator) -> I64:
    """Instants k/rate from 0 to ``duration_s`` in ns, each but the first displaced by the jitter."""
    n = int(np.floor(duration_s * rate_hz * (1 + 1e-12))) + 1
    k = np.arange(n)
    shift = np.clip(rng.normal(0.0, 1.0, n) * jitter_s * rate_hz, -MAX_JITTER, MAX_JITTER)
    shift[0] = 0.0
    return np.rint((k + shift) * (NS_PER_S / rate_hz)).astype(np.int64)


def arrived(n: int, dropout: float, rng: np.random.Generator) -> Bool | slice:
    """Which of n messages were not lost; the first never is."""
    if dropout == 0:
        return slice(None)
    kept = rng.random(n) >= dropout
    kept[:1] = True
    return kept


def measured(values: F64, sd: float, seed: int, name: str) -> F64:
    """The values with normal noise of the stream ``name``."""
    if sd == 0:
        return values
    return values + sd * stream(seed, name).normal(0.0, 1.0, len(values))


def measure_pose(
    motion: Motion, sensors: Sensors, seed: int, start_ns: int
) -> tuple[PoseTrack, Bool | slice]:
    """The pose as logged, of the motion at the pose instants, and which of its samples arrived."""
    kept = arrived(len(motion.t_ns), sensors.dropout, stream(seed, "pose_dropout"))
    x_m = measured(motion.x_m, sensors.noise_xy_sd_m, seed, "x")
    y_m = measured(motion.y_m, sensors.noise_xy_sd_m, seed, "y")
    yaw_rad = measured(motion.yaw_rad, sensors.noise_yaw_sd_rad, seed, "yaw")
    return PoseTrack(start_ns + motion.t_ns[kept], x_m[kept], y_m[kept], yaw_rad[kept]), kept


def measure_torque(
    motion: Motion, sensors: Sensors, seed: int, start_ns: int
) -> tuple[TorqueTrack, Bool | slice]:
    """Torques and wheel speeds as logged, of the motion at the torque instants, and which samples arrived."""
    kept = arrived(len(motion.t_ns), sensors.dropout, stream(seed, "torque_dropout"))
    effort_sd, speed_sd = sensors.noise_effort_sd_nm, sensors.noise_wheel_speed_sd_radps
    columns = (
        measured(motion.effort_left_nm, effort_sd, seed, "effort_left"),
        measured(motion.effort_right_nm, effort_sd, seed, "effort_right"),
        measured(motion.left_radps, speed_sd, seed, "wheel_speed_left"),
        measured(motion.right_radps, speed_sd, seed, "wheel_speed_right"),
    )
    t_ns = start_ns + round(sensors.clock_offset_s * NS_PER_S) + motion.t_ns[kept]
    return TorqueTrack(t_ns, *(column[kept] for column in columns)), kept

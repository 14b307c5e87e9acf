"""A case: one log of the benchmark, named by family, plant, noise, effect and seed; and what its seed draws.

Each purpose has a random stream of its own, so that the same seed with another effect, noise or plant has the
same robot, drive and conditions.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wmr_schemas.arrays import F64, I8
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_synth.driving.patrol import small_robot
from wmr_synth.sensors import NOISE_LEVELS
from worlds.drivers import FAMILIES, Drive, drawn_drive

DURATION_S = 90.0
RATE_HZ = 100.0
STREAMS = ("robot", "drive", "conditions", "size", "place", "disturbance", "stamps", "pose")
LARGEST_DISTURBANCE_MPS2 = 0.03
CORNER_HZ = (0.1, 2.0)
LARGEST_DROPOUT = 0.02
JITTER_S = 0.0015
STRAY_SPEED_MPS, STRAY_YAW_RATE_RADPS = 12.0, 8.0


@dataclass(frozen=True)
class Conditions:
    """What surrounds a drive: disturbance, stamps, and the share of pose noise that is a marker's wobble.

    The disturbance has this standard deviation on each channel and falls off above its corner.
    """

    disturbance_mps2: float
    corner_hz: float
    jitter_s: float
    dropout: float
    wobble_share: float
    wobble_s: float

    @property
    def disturbance_s(self) -> float:
        """Correlation time of the disturbance."""
        return 1 / (2 * np.pi * self.corner_hz)


@dataclass(frozen=True)
class Case:
    """One log of the benchmark; an empty effect hides nothing."""

    plant: int
    family: str
    noise: str
    effect: str
    seed: int
    duration_s: float = DURATION_S

    @property
    def key(self) -> str:
        """Key of the case's row of results."""
        return f"{self.family}/{self.plant}/{self.noise}/{self.effect or 'nothing'}/{self.seed}"

    @property
    def noise_sd(self) -> tuple[float, float]:
        """Standard deviations of a pose sample in m and rad."""
        return NOISE_LEVELS[self.noise]

    def stream(self, purpose: str, *part: int) -> np.random.Generator:
        """The random stream for a purpose, or a part of it."""
        family = list(FAMILIES).index(self.family)
        return np.random.default_rng([self.seed, STREAMS.index(purpose), family, *part])

    def robot(self) -> RobotParameters:
        """A robot of 10 to 100 kg, its tyres' cornering stiffness within ×2 of the project's small robot."""
        rng = self.stream("robot")
        robot = small_robot(
            mass_kg=float(np.exp(rng.uniform(np.log(10.0), np.log(100.0)))),
            half_track_m=float(rng.uniform(0.15, 0.4)),
            wheel_radius_m=float(rng.uniform(0.06, 0.18)),
            gyration_m=float(rng.uniform(0.15, 0.3)),
        )
        stiffness = robot.cornering_stiffness_over_epsilon
        assert stiffness is not None
        factor = float(np.exp(rng.uniform(-np.log(2.0), np.log(2.0))))
        return replace(robot, cornering_stiffness_over_epsilon=stiffness * factor)

    def drive(self) -> Drive:
        """Where it is driven, and how the contact changes."""
        return drawn_drive(self.family, self.duration_s, self.stream("drive"))

    def conditions(self) -> Conditions:
        """Disturbance and stamps; a third of logs has steady stamps, a third (not on plant one) wobbles."""
        rng = self.stream("conditions")
        level, corner = rng.uniform(0.0, LARGEST_DISTURBANCE_MPS2), np.exp(rng.uniform(*np.log(CORNER_HZ)))
        steady, wobbles = rng.uniform(0.0, 1.0, 2) < 1 / 3
        return Conditions(
            disturbance_mps2=float(level),
            corner_hz=float(corner),
            jitter_s=0.0 if steady else JITTER_S,
            dropout=0.0 if steady else float(rng.uniform(0.0, LARGEST_DROPOUT)),
            wobble_share=0.5 if wobbles and self.plant != 1 else 0.0,
            wobble_s=float(np.exp(rng.uniform(np.log(0.03), np.log(0.3)))),
        )


class RanAway(RuntimeError):
    """A hidden effect makes the controlled robot unstable."""


def check_stable(case: Case, v_long_mps: F64, yaw_rate_radps: F64) -> None:
    """Raises RanAway where the robot leaves every sensible speed."""
    if not (
        np.abs(v_long_mps).max() < STRAY_SPEED_MPS and np.abs(yaw_rate_radps).max() < STRAY_YAW_RATE_RADPS
    ):
        raise RanAway(case.key)


@dataclass(frozen=True, eq=False)
class Truth:
    """The noise-free motion at ``t_s`` (n,) since the start; torques and modes as in force from then on.

    Torques are the commanded ones. Pose and speeds are the robot's, before any error of their measurement.
    """

    t_s: F64
    x_m: F64
    y_m: F64
    yaw_rad: F64
    v_long_mps: F64
    v_lat_mps: F64
    yaw_rate_radps: F64
    left_nm: F64
    right_nm: F64
    mode: I8


@dataclass(frozen=True, eq=False)
class World:
    """A case simulated: the log as recorded, its truth, and the hidden effect's declared parameters."""

    case: Case
    log: Log
    truth: Truth
    robot: RobotParameters
    conditions: Conditions
    sizes: dict[str, float]

    def without_modes(self) -> Log:
        """The log without its mode track, so that the analysis cannot use it."""
        return replace(self.log, mode=None)

    def facts(self) -> dict[str, Any]:
        """What a row says of the world; ``demand_mps2``: the dv_long/dt that torques ask for, rms."""
        assert self.robot.alpha is not None
        asked = self.robot.alpha * (self.truth.left_nm + self.truth.right_nm)
        demand = float(np.sqrt(np.mean(asked**2)))
        level = self.conditions.disturbance_mps2
        return {"sizes": self.sizes, "disturbance_mps2": level, "demand_mps2": demand}

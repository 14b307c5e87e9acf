"""A case: one log of the engine, named by robot, driver family, noise, effect and seed.

Each purpose has a random stream of its own, so that the same seed with another effect or noise has the same
drive.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import quality_logs
from encoders.drivers import FAMILIES as TURNING_FAMILIES
from worlds.drivers import path_of, slow_square_wave

from engine.robot import BY_WHEELS
from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Profile
from wmr_synth.driving.patrol import stop_go_reverse_turn
from wmr_synth.sensors import NOISE_LEVELS

DURATION_S = 90.0
STREAMS = ("drive", "size", "place", "pose", "wheels")
Draw = Callable[[float, np.random.Generator], Profile]
FAMILIES: dict[str, Draw] = {
    "stop-go": stop_go_reverse_turn,
    "square-wave": slow_square_wave,
    "teleoperated": path_of(quality_logs.teleoperated),
    "wander": TURNING_FAMILIES["wander"],
    "spin-and-go": TURNING_FAMILIES["spin-and-go"],
    "aisles": TURNING_FAMILIES["aisles"],
}

PACE = {"beetle": 0.5, "puck": 0.5, "tutor": 0.4}
"""The share of a family's speeds that a robot with small wheels drives."""


@dataclass(frozen=True)
class Case:
    """One log; an empty effect hides nothing. ``again`` is another log of the same robot: the effect has the
    same size, drive and noise are others.
    """

    robot: str
    family: str
    noise: str
    effect: str
    seed: int
    duration_s: float = DURATION_S
    again: bool = False

    @property
    def key(self) -> str:
        """Key of the case's row of results."""
        return f"{self.robot}/{self.family}/{self.noise}/{self.effect or 'nothing'}/{self.seed}"

    @property
    def noise_sd(self) -> tuple[float, float]:
        """Standard deviations of a pose sample in m and rad."""
        return NOISE_LEVELS[self.noise]

    def stream(self, purpose: str) -> np.random.Generator:
        """The random stream for a purpose."""
        parts = [self.seed, STREAMS.index(purpose), sorted(FAMILIES).index(self.family)]
        return np.random.default_rng([*parts, 1] if self.again and purpose != "size" else parts)

    def references(self) -> Profile:
        """Speed and yaw rate that the controller follows."""
        pace = PACE.get(self.robot.removesuffix(BY_WHEELS), 1.0)
        profile = FAMILIES[self.family](self.duration_s, self.stream("drive"))

        def paced(t_s: F64) -> tuple[F64, F64]:
            v_mps, yaw_rate_radps = profile(t_s)
            return pace * v_mps, yaw_rate_radps

        return paced

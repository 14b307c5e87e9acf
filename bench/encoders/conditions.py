"""Conditions of a log: white and coloured noise of its pose, and how uneven the floor is.

The simulator's own logs have white noise and a floor whose unevenness forgets itself within .3 s. The
coloured conditions are wider: a pose that sways for seconds as a localisation does, and a floor on which
wheels slip more and for longer.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.wheel_speed.ground import ICY, Floor


@dataclass(frozen=True)
class Condition:
    """Standard deviations of a pose sample in m and rad, white and swaying with time constants between two
    bounds in s; the floor's slip by unevenness in that of an ordinary one, and its time constant.
    """

    white: tuple[float, float]
    sway: tuple[float, float] = (0.0, 0.0)
    sway_s: tuple[float, float] = (1.0, 1.0)
    uneven: float = 1.0
    uneven_s: float = 0.3

    @property
    def floor(self) -> Floor:
        """The floor, with wet and icy stretches."""
        return replace(ICY, uneven=self.uneven, uneven_tau_s=self.uneven_s)

    def swaying(self, log: Log, seed: int) -> Log:
        """The log with a coloured error on its poses."""
        if not any(self.sway):
            return log
        rng, pose = np.random.default_rng([seed, 2]), log.pose
        step_s = float(np.median(np.diff(pose.t_ns))) / NS_PER_S
        x, y, yaw = (sd * ou(len(pose.t_ns), step_s / rng.uniform(*self.sway_s), rng) for sd in self.sds)
        moved = PoseTrack(pose.t_ns, pose.x_m + x, pose.y_m + y, pose.yaw_rad + yaw)
        return replace(log, pose=moved)

    @property
    def sds(self) -> tuple[float, float, float]:
        """Standard deviations of the sway in x, y and yaw."""
        return self.sway[0], self.sway[0], self.sway[1]


def ou(n: int, step: float, rng: np.random.Generator) -> F64:
    """A stationary Ornstein–Uhlenbeck process (n,) of unit variance; ``step`` is in its time constant."""
    keep = np.exp(-step)
    drawn = rng.normal(0.0, 1.0, n)
    drawn[1:] *= np.sqrt(1 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], drawn))


CONDITIONS: dict[str, Condition] = {
    **{name: Condition(white) for name, white in NOISE_LEVELS.items()},
    "swaying": Condition((0.005, 0.003), (0.01, 0.005), (0.4, 0.8), 1.5, 0.6),
    "lidar": Condition((0.005, 0.003), (0.02, 0.01), (1.0, 3.0), 3.0, 1.5),
    "canopy": Condition((0.02, 0.005), (0.05, 0.01), (5.0, 15.0), 2.0, 3.0),
}

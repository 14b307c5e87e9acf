"""What the initial stretch of a log says about its signals: step, start and noise."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.differentiate import robust_sigma
from wmr_schemas.arrays import F64, NS_PER_S


@dataclass(frozen=True, eq=False)
class InitialLevels:
    """``step_s``: median step of the stamps; ``start_ns``: first stamp; ``sigma`` (3,): noise of x, y, yaw.

    ``position_sd_m`` is the root mean square of the noise of x and y, ``yaw_sd_rad`` the noise of the yaw.
    """

    step_s: float
    start_ns: int
    sigma: F64
    position_sd_m: float
    yaw_sd_rad: float

    @property
    def pose_sd(self) -> F64:
        """The noise (3,) with x and y taken together."""
        return np.array([self.position_sd_m, self.position_sd_m, self.yaw_sd_rad])


def initial_levels(stretch: SampleBatch) -> InitialLevels:
    """Levels of a stretch of two rows or more."""
    sigma = np.array([robust_sigma(stretch.t_ns, signal) for signal in stretch.pose_raw])
    return InitialLevels(
        step_s=float(np.median(np.diff(stretch.t_ns))) / NS_PER_S,
        start_ns=int(stretch.t_ns[0]),
        sigma=sigma,
        position_sd_m=float(np.sqrt(np.mean(sigma[:2] ** 2))),
        yaw_sd_rad=float(sigma[2]),
    )

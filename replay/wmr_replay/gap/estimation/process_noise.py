"""The disturbances of the filter as Ornstein–Uhlenbeck states, and all other process noise.

A disturbance with standard deviation s and correlation time τ has the autocorrelation s² exp(−|t|/τ); a step
of length dt keeps the share exp(−dt/τ) of it and adds the variance s² (1 − exp(−2 dt/τ)).
"""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.model.dynamics import (
    D_LAT,
    D_LONG,
    D_YAW,
    N_STATE,
    V_LAT,
    Row,
    V,
    W,
    X,
    Y,
    is_skidding,
    is_slipping,
)
from wmr_replay.gap.settings.filter import FilterSettings
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import inlined, lean


class Diffusion(NamedTuple):
    """Standard deviation and correlation time of each disturbance; the lateral one is a velocity. Root
    densities of the white disturbances ahead and in yaw while swivel casters swing round.
    """

    long_sd_mps2: float
    long_tau_s: float
    yaw_sd_mps2: float
    yaw_tau_s: float
    lat_sd_mps: float
    lat_tau_s: float
    swing_long_mps2_rthz: float = 0.0
    swing_yaw_mps2_rthz: float = 0.0

    @property
    def densities_mps2_rthz(self) -> tuple[float, float]:
        """Root density at low frequency ahead and in yaw, √Q = s √(2 τ), of correlation s² exp(−|t|/τ)."""
        long = self.long_sd_mps2 * np.sqrt(2 * self.long_tau_s)
        yaw = self.yaw_sd_mps2 * np.sqrt(2 * self.yaw_tau_s)
        return float(long), float(yaw)

    @property
    def swings_mps2_rthz(self) -> tuple[float, float]:
        """Root density ahead and in yaw while casters swing."""
        return self.swing_long_mps2_rthz, self.swing_yaw_mps2_rthz

    def with_swings(self, mps2_rthz: tuple[float, float]) -> "Diffusion":
        """With other root densities while casters swing."""
        long, yaw = mps2_rthz
        return self._replace(swing_long_mps2_rthz=long, swing_yaw_mps2_rthz=yaw)


@lean
def decays(dt: float, noise: Diffusion) -> tuple[float, float, float]:
    """Share of each disturbance left after ``dt``: of v_long and v_lat, of w, and of a lateral velocity."""
    return math.exp(-dt / noise.long_tau_s), math.exp(-dt / noise.yaw_tau_s), math.exp(-dt / noise.lat_tau_s)


@inlined
def add_noise(
    P: F64,
    row: F64,
    mode_before: float,
    noise: Diffusion,
    kept: tuple[float, float, float],
    settings: FilterSettings,
) -> None:
    """Add the process noise of one step to ``P`` (9, 9); exact for the Ornstein–Uhlenbeck states."""
    dt, mode = row[Row.DT], row[Row.MODE]
    kept_long, kept_yaw, kept_lat = kept
    ahead, switch = noise.long_sd_mps2**2 * (1 - kept_long**2), settings.switch_sd_mps**2
    P[D_LONG, D_LONG] += ahead
    P[D_LAT, D_LAT] += ahead
    P[D_YAW, D_YAW] += noise.yaw_sd_mps2**2 * (1 - kept_yaw**2)
    if is_skidding(mode):
        P[V_LAT, V_LAT] += noise.lat_sd_mps**2 * dt
    else:
        P[V_LAT, V_LAT] += noise.lat_sd_mps**2 * (1 - kept_lat**2)
    if row[Row.LOOSE] > 0.0:
        P[V_LAT, V_LAT] += row[Row.LOOSE] ** 2
        moved = (row[Row.LOOSE] * dt) ** 2 / 3
        P[X, X] += moved
        P[Y, Y] += moved
    if row[Row.SWING] > 0.0:
        swinging = row[Row.SWING] ** 2 * dt
        P[V, V] += swinging * noise.swing_long_mps2_rthz**2
        P[W, W] += swinging * noise.swing_yaw_mps2_rthz**2
    if is_slipping(mode):
        slipped = settings.slip_disturbance_mps2_rthz**2 * dt
        P[V, V] += slipped
        P[W, W] += slipped
    if mode != mode_before:
        P[V, V] += switch
        P[W, W] += switch


@lean
def decay_disturbances(F: F64, z: F64, kept: tuple[float, float, float]) -> None:
    """Multiply the disturbances' rows of ``F`` (9, 9) and ``z`` (9,) by the shares that a step leaves."""
    z[D_LONG] *= kept[0]
    z[D_LAT] *= kept[0]
    z[D_YAW] *= kept[1]
    F[D_LONG, D_LONG] *= kept[0]
    F[D_LAT, D_LAT] *= kept[0]
    F[D_YAW, D_YAW] *= kept[1]


def first_covariance(noise: Diffusion, variance: float) -> F64:
    """(9, 9): ``variance`` for pose and speeds, the stationary distribution for the disturbances."""
    P = np.diag(np.full(N_STATE, variance))
    ahead, turning, aside = np.square([noise.long_sd_mps2, noise.yaw_sd_mps2, noise.lat_sd_mps])
    P[D_LONG, D_LONG] = P[D_LAT, D_LAT] = ahead
    P[D_YAW, D_YAW] = turning
    P[V_LAT, V_LAT] = aside + 1e-6
    return P

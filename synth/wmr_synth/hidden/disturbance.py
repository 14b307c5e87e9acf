"""Accelerations that no model has: coloured by channel, or white as a model file gives them."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import NoiseModel

CHANNELS = ("longitudinal", "lateral", "yaw")
GRID_NS = NS_PER_S // 100
"""A disturbance is held for 10 ms at most."""


@dataclass(frozen=True)
class Disturbance:
    """An Ornstein-Uhlenbeck process on dv_long/dt, dv_lat/dt (while skidding) and l·yaw_acc each.

    dw = −w dt/τ + sd √(2/τ) dB, started in its stationary distribution; ``white_mps2_rthz`` by channel comes
    on top: its time integral over T seconds has the variance white² T.
    """

    sd_mps2: float = 0.0
    tau_s: float = 0.4
    white_mps2_rthz: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.sd_mps2) and self.sd_mps2 >= 0):
            raise InvalidSetting(f"a disturbance's sd must not be negative, not {self.sd_mps2}")
        if not (np.isfinite(self.tau_s) and self.tau_s > 0):
            raise InvalidSetting(f"a disturbance's tau must be above 0 s, not {self.tau_s}")

    @property
    def acts(self) -> bool:
        """Whether there is any."""
        return self.sd_mps2 > 0 or any(self.white_mps2_rthz)

    def held(self, t_ns: I64, rng: np.random.Generator) -> F64:
        """Values (n, 3) by channel, each held from its instant to the next one."""
        if not self.acts:
            return np.zeros((len(t_ns), 3))
        dt_s = np.diff(t_ns) / NS_PER_S
        coloured = self.sd_mps2 * unit_ou(dt_s / self.tau_s, rng)
        white = rng.normal(0.0, 1.0, (len(dt_s), 3)) / np.sqrt(dt_s)[:, None]
        coloured[:-1] += white * np.array(self.white_mps2_rthz)
        return coloured


NO_DISTURBANCE = Disturbance()
DEFAULT_DISTURBANCE = Disturbance(0.015, 0.4)


def unit_ou(steps: F64, rng: np.random.Generator) -> F64:
    """Three stationary processes of unit variance and time constant, (n + 1, 3), at the ends of steps."""
    normal = rng.normal(0.0, 1.0, (len(steps) + 1, 3))
    decay = np.exp(-steps).tolist()
    fresh = np.sqrt(-np.expm1(-2.0 * steps)).tolist()
    for k in range(len(steps)):
        normal[k + 1] = decay[k] * normal[k] + fresh[k] * normal[k + 1]
    return normal


def from_model(noise: NoiseModel) -> Disturbance:
    """The disturbance of a model file."""
    densities = (getattr(noise, f"disturbance_{channel}_mps2_rthz") or 0.0 for channel in CHANNELS)
    longitudinal, lateral, yaw = densities
    return Disturbance(white_mps2_rthz=(longitudinal, lateral, yaw))


def parse_disturbance(text: str) -> Disturbance:
    """``SD:TAU`` in m/s² and s, or ``none``."""
    if text == "none":
        return NO_DISTURBANCE
    sd, _, tau = text.partition(":")
    try:
        return Disturbance(float(sd), float(tau) if tau else DEFAULT_DISTURBANCE.tau_s)
    except ValueError:
        raise InvalidSetting(
            f"a disturbance is SD:TAU in m/s² and s, such as 0.015:0.4, not {text!r}"
        ) from None

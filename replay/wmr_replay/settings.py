"""Settings of a run; a value of None means "chosen from the initial stretch of the log"."""

from dataclasses import asdict, dataclass
from typing import Any

from wmr_schemas.errors import InvalidSetting


@dataclass(frozen=True)
class Settings:
    """Everything that decides a run's numbers, besides the log and the robot's parameters."""

    window_s: float | None = None
    """T of the differentiator; None: the shortest that brings dv_long/dt to ``target_a_long_sd_mps2``."""
    degree: int = 2
    kappa: int = 0
    mu: int = 0
    theta: float = 0.0
    threshold_sd: float = 3.0
    """Thresholds of C_k and C_d in standard deviations."""
    min_c_k_mps: float = 0.005
    min_c_d_mps2: float = 0.02
    """The thresholds never fall below these, however quiet the pose."""
    target_a_long_sd_mps2: float = 0.1
    initial_stretch_s: float = 1.0
    """Rate, noise and window come from this first stretch, and from its first 20 rows at least."""
    noise_time_constant_s: float = 5.0
    reorder_window_s: float = 2.0
    max_hold_s: float = 1.0
    """A torque is held no longer than this."""

    def __post_init__(self) -> None:
        if self.window_s is not None and not self.window_s > 0:
            raise InvalidSetting(f"the window must be longer than 0 s, not {self.window_s:g} s")
        if not self.threshold_sd > 0:
            raise InvalidSetting(f"thresholds must be above 0 standard deviations, not {self.threshold_sd:g}")

    def as_dict(self) -> dict[str, Any]:
        """As they stand in ``summary.settings``."""
        return asdict(self)

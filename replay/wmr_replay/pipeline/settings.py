"""Settings of a run; a value of None means "chosen from the initial stretch of the log"."""

from dataclasses import asdict, dataclass, replace
from typing import Any

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.modes import ModeSet
from wmr_schemas.robot import RobotParameters

IDENTIFIERS = ("paper", "algebraic", "bank")
NO_IDENTIFIER = "none"
"""For a replay that is asked for the data's quality alone; no choice of a user's."""
WHEEL_BANK = "wheel_bank"
"""What becomes of ``bank`` where a log has wheel speeds and no torques; no choice of a user's."""
JOINT_BANK = "joint_bank"
"""What becomes of ``bank`` where torques and wheel speeds tell modes together; no choice of a user's."""
WHEEL_THRESHOLDS = "wheel_thresholds"
"""What becomes of ``paper`` where a log has wheel speeds and no torques; no choice of a user's."""
EVIDENCE = ("auto", "torques", "wheel-speeds", "both")
SKIDS_ALONE = "skids_alone"
"""What becomes of ``algebraic`` there: its windows need torques, the thresholds on skidding are left."""
NOT_CHOSEN = (WHEEL_BANK, JOINT_BANK, WHEEL_THRESHOLDS, SKIDS_ALONE)
BY_WHEELS = {
    ("bank", "wheel-speeds"): WHEEL_BANK,
    ("bank", "both"): JOINT_BANK,
    ("paper", "wheel-speeds"): WHEEL_THRESHOLDS,
    ("algebraic", "wheel-speeds"): SKIDS_ALONE,
}
DEFAULT_SHAPE = (2, 0, 0, 0.0)
RUBBER_SIDESLIP = 0.15
"""8.5°: tyres of rubber that grip reach 5° at 6 m/s² of lateral acceleration (docs/dart.md)."""

MOST_OFFSET_S = 4e9
"""126 years: further, 64 bits of nanoseconds may not hold the stamps."""


@dataclass(frozen=True)
class Settings:
    """Everything that decides a run's numbers, besides the log and the robot's parameters."""

    window_s: float | None = None
    """T of the differentiator; None: the shortest that brings dv_long/dt to ``target_a_long_sd_mps2``, until
    a better design has been tuned.
    """
    degree: int = 2
    kappa: int = 0
    mu: int = 0
    theta: float = 0.0
    identifier: str = "bank"
    """``paper``, ``algebraic`` or ``bank``."""
    evidence: str = "auto"
    """What ``bank`` tells modes by: ``torques``, ``wheel-speeds``, ``both``, or ``auto``, what the log has
    (:mod:`wmr_replay.pipeline.evidence`).
    """
    min_confidence: float = 0.5
    """Below this posterior ``mode`` is −1."""
    simultaneous: bool = False
    """Whether skidding and slipping at once is a mode of its own."""
    threshold_sd: float = 3.0
    """Thresholds of C_k and C_d in standard deviations."""
    min_c_k_mps: float = 0.005
    min_c_d_mps2: float = 0.02
    """The thresholds never fall below these, however quiet the pose."""
    min_sideslip: float | None = None
    """Share of v_long up to which v_lat is a rolling tyre's elastic sideslip, and no skid; None: 0 where the
    robot's cornering stiffness is known, else .15, as of rubber.
    """
    target_a_long_sd_mps2: float = 0.1
    tune: bool = True
    """Whether a kernel of the default shape gives way to one tuned on the log's first stretch with motion."""
    max_delay_s: float | None = None
    """The delay that a tuned kernel may have; None: that of the kernel it replaces."""
    tuning_stretch_s: float = 8.0
    initial_stretch_s: float = 1.0
    """Rate, noise and window come from this first stretch, and from its first 20 rows at least."""
    noise_time_constant_s: float = 5.0
    hindsight: bool = True
    """Whether a second pass over the log follows, which looks ahead."""
    hindsight_lag_s: float = 4.0
    """How far the second pass looks ahead of a row. Measured: 2 s lose .007 of accuracy; 8 s gain .005, at
    .005 more of calibration error (docs/hindsight.md).
    """
    reorder_window_s: float = 2.0
    max_hold_s: float = 1.0
    """A torque is held no longer than this."""
    clock_offset_s: float = 0.0
    """Added to the stamps of torques and wheel speeds, where their clock is off the pose's."""

    def __post_init__(self) -> None:
        if not abs(self.clock_offset_s) < MOST_OFFSET_S:
            raise InvalidSetting(f"no clock is {self.clock_offset_s:g} s off: {MOST_OFFSET_S:g} s at most")
        self._check_identifier()
        self._check_differentiator()

    def _check_identifier(self) -> None:
        if self.identifier not in (*IDENTIFIERS, NO_IDENTIFIER, *NOT_CHOSEN):
            raise InvalidSetting(f"no identifier {self.identifier!r}; known are {', '.join(IDENTIFIERS)}")
        if self.evidence not in EVIDENCE:
            raise InvalidSetting(f"no evidence {self.evidence!r}; known are {', '.join(EVIDENCE)}")
        if not 0 <= self.min_confidence < 1:
            raise InvalidSetting(f"the confidence asked for must lie in 0 to 1, not {self.min_confidence:g}")
        if self.min_sideslip is not None and not self.min_sideslip >= 0:
            raise InvalidSetting(f"the least sideslip must not be below 0, not {self.min_sideslip:g}")
        if not self.threshold_sd > 0:
            raise InvalidSetting(f"thresholds must be above 0 standard deviations, not {self.threshold_sd:g}")

    def _check_differentiator(self) -> None:
        if not 2 <= self.degree <= 8:
            raise InvalidSetting(f"degree must be 2 to 8 (second derivatives are needed), not {self.degree}")
        if self.window_s is not None and not self.window_s > 0:
            raise InvalidSetting(f"the window must be longer than 0 s, not {self.window_s:g} s")
        if self.max_delay_s is not None and not self.max_delay_s > 0:
            raise InvalidSetting(f"the delay allowed must be above 0 s, not {self.max_delay_s:g} s")
        if self.max_delay_s is not None and self.window_s is not None:
            raise InvalidSetting(
                "a given window has its own delay: leave out the window or the delay allowed"
            )
        if not 0.1 <= self.hindsight_lag_s <= 60:
            raise InvalidSetting(f"the lag must lie between 0.1 and 60 s, not {self.hindsight_lag_s:g} s")
        if not self.tuning_stretch_s > 0:
            raise InvalidSetting(f"the stretch to tune on must be above 0 s, not {self.tuning_stretch_s:g} s")

    def min_sideslip_of(self, robot: RobotParameters) -> float:
        """The least sideslip that is called a skid of this robot."""
        if self.min_sideslip is not None:
            return self.min_sideslip
        return RUBBER_SIDESLIP if robot.cornering_stiffness_over_epsilon is None else 0.0

    @property
    def tunes(self) -> bool:
        """Whether the differentiator is to be tuned: neither its window nor its kernel was given."""
        shape = (self.degree, self.kappa, self.mu, self.theta)
        return self.tune and self.window_s is None and shape == DEFAULT_SHAPE

    @property
    def all_modes(self) -> ModeSet:
        """``mode_set`` of a row in which nothing is excluded."""
        return ModeSet.ALL if self.simultaneous else ModeSet.ALL_SINGLE

    def told_by(self, evidence: str) -> "Settings":
        """The same for a log whose modes are told by one of ``EVIDENCE``; wheel speeds tell slipping beside
        skidding.
        """
        identifier = BY_WHEELS.get((self.identifier, evidence))
        if identifier is None:
            return self
        both = self.simultaneous or identifier != SKIDS_ALONE
        return replace(self, identifier=identifier, simultaneous=both)

    def as_dict(self) -> dict[str, Any]:
        """The settings as ``summary.settings`` holds them."""
        return asdict(self)

"""The base model out of a robot's parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from wmr_replay.effects.motion import com_yaw_per_m
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect, NoiseModel, corner_share, friction_speed_mps
from wmr_schemas.robot import AUTO, RobotParameters

LATERAL_DECAY_PER_S = 5.0
"""Without a skid v_lat is noise of the pose and play of the wheels; it decays within a fifth of a second."""
ASSUMED_SKID_DECAY_MPS2 = 5.0
"""2 G_x/(ε m) of a robot of unknown stiffness or mass: at 1 m/s a skid decays within a fifth of a second. The
value decides how skidding rows are predicted; ``cornering_stiffness`` is fitted relative to it.
"""
ASSUMED_SLIP_SHARES = (0.5, 0.5)
"""Traction that slipping leaves where the robot's masses are unknown; the filter's disturbance while slipping
covers the difference.
"""


def base_of(robot: RobotParameters) -> Base:
    """Numbers of the base model. Raises InvalidSetting without α or the half track."""
    if robot.alpha is None or robot.half_track_m is None:
        raise InvalidSetting("the base model needs alpha and half_track_m")
    speed = robot.average_speed_mps
    share, share_yaw = robot.slip_shares or ASSUMED_SLIP_SHARES
    decay = robot.skid_decay_mps2
    return Base(
        alpha=robot.alpha,
        alpha_yaw=robot.alpha_yaw_or_alpha or robot.alpha,
        half_track_m=robot.half_track_m,
        skid_decay_mps2=decay if decay is not None else ASSUMED_SKID_DECAY_MPS2,
        speed_mps=0.0 if speed is None or speed == AUTO else float(speed),
        slip_share=share,
        slip_share_yaw=share_yaw,
        com_yaw_per_m=com_yaw_per_m(robot),
        lateral_decay_per_s=LATERAL_DECAY_PER_S,
    )


@dataclass(frozen=True, eq=False)
class BaseModel:
    """The model that the log is compared with, and its source; ``unnameable`` are effects that a
    calibration on the log hides.
    """

    robot: RobotParameters
    effects: tuple[Effect, ...]
    source: str
    unnameable: tuple[str, ...] = ()
    misfit: Mapping[str, float] = field(default_factory=dict)
    noise: NoiseModel = field(default_factory=NoiseModel)

    @property
    def extension(self) -> Extension:
        """The model with its own effects and nothing new."""
        known = tuple((effect.name, dict(effect.parameters)) for effect in self.effects)
        radius_m = self.robot.wheel_radius_m or 1.0
        forms = friction_speed_mps(self.effects), corner_share(self.effects)
        return Extension(base_of(self.robot), {}, radius_m, known, self.misfit, *forms)

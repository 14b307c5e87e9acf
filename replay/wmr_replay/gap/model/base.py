"""The base model out of a robot's parameters."""

from dataclasses import dataclass

from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import AUTO, RobotParameters

LATERAL_DECAY_PER_S = 5.0
UNKNOWN_SKID_RATE_MPS = 5.0


def base_of(robot: RobotParameters) -> Base:
    """Numbers of the base model. Raises InvalidSetting without α or the half track.

    Slipping leaves (3/m)/(r²/I_φ + 2/m) · 3 of α's quasi-steady effect ahead and (3 l²/I_θ)/(r²/I_φ +
    2 l²/I_θ) in yaw, by (1) with its fast σ settled; where m, I_φ, I_θ or r are unknown, half is taken, and
    the filter's disturbance while slipping makes up for it.
    """
    if robot.alpha is None or robot.half_track_m is None:
        raise InvalidSetting("the base model needs alpha and half_track_m")
    speed = robot.average_speed_mps
    share, share_yaw = slip_shares(robot)
    rate = skid_rate_mps(robot)
    mass, inertia = robot.mass_kg, robot.yaw_inertia_kgm2
    com = robot.half_track_m * mass / inertia if mass is not None and inertia is not None else 0.0
    return Base(
        alpha=robot.alpha,
        alpha_yaw=robot.alpha_yaw_or_alpha or robot.alpha,
        half_track_m=robot.half_track_m,
        skid_rate_mps=rate if rate is not None else UNKNOWN_SKID_RATE_MPS,
        speed_mps=0.0 if speed is None or speed == AUTO else float(speed),
        slip_share=share,
        slip_share_yaw=share_yaw,
        com_yaw_per_m=com,
        lateral_decay=LATERAL_DECAY_PER_S,
    )


def skid_rate_mps(robot: RobotParameters) -> float | None:
    """2 G_x/(ε m), None where unknown."""
    if robot.cornering_stiffness_over_epsilon is None or robot.mass_kg is None:
        return None
    return 2 * robot.cornering_stiffness_over_epsilon / robot.mass_kg


def slip_shares(robot: RobotParameters) -> tuple[float, float]:
    """What slipping leaves of α and α_yaw once σ has settled."""
    m, i_wheel, r = robot.mass_kg, robot.wheel_inertia_kgm2, robot.wheel_radius_m
    i_yaw, l = robot.yaw_inertia_kgm2, robot.half_track_m
    if m is None or i_wheel is None or r is None or i_yaw is None or l is None:
        return 0.5, 0.5
    stiff = r**2 / i_wheel
    return (3 / m) / (stiff + 2 / m), (3 * l**2 / i_yaw) / (stiff + 2 * l**2 / i_yaw)


@dataclass(frozen=True, eq=False)
class BaseModel:
    """The model that the log is held against, and where it came from."""

    robot: RobotParameters
    effects: tuple[Effect, ...]
    source: str
    unnameable: tuple[str, ...] = ()

    @property
    def extension(self) -> Extension:
        """Without what is still to be found."""
        known = {effect.name: dict(effect.parameters) for effect in self.effects}
        return Extension(base_of(self.robot), {}, self.robot.wheel_radius_m or 1.0, known)

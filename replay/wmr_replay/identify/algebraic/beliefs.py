"""What is believed before any data: priors and rates, none of them a stiffness or a mass."""

from typing import NamedTuple

from wmr_schemas.robot import RobotParameters

FACTOR_2_MEAN, FACTOR_2_SD = 1.08, 0.45
"""Mean and standard deviation of a factor that lies between 1/2 and 2."""
UNKNOWN_ALPHA_SD = 1.0
UNKNOWN_YAW_GAIN_SD = 3.0
MIN_HALF_TRACK_M = 0.1
START_SLIPPING_UNKNOWN_ALPHA = 0.02
"""Where α is unknown, the first push is what α is learnt from: the robot is taken to have traction then."""


class Beliefs(NamedTuple):
    """Priors and rates; times in s, the rest in SI units.

    α and the yaw gain β (dω/dt = β·(effort_right − effort_left)) are normal with the mean and sd given
    here. While slipping, a share ρ of the traction is left, normal with ``traction`` ± ``traction_sd``; in
    yaw the share is ``traction``, and what is wrong with that is white noise, relative. While skidding, v_lat
    dies out at an unknown rate exp(``log_decay`` ± ``log_decay_sd``), which wanders by ``log_decay_drift`` in
    1/√s; a side force besides, relative to v·ω, is ``side_force_diffusion``. The other ``…_diffusion`` are
    white disturbances in (m/s²)/√Hz and (rad/s²)/√Hz, those with ``free_`` where no torque is known;
    ``gain_drift`` is the wander of α and β, relative, in 1/√s. A change of load alters α and β by
    ``load_change``, relative; a jump moves the pose by ``jump_…``.
    """

    alpha: float
    alpha_sd: float
    yaw_gain: float
    yaw_gain_sd: float
    start_slipping: float = 1 / 3
    switch_rate_hz: float = 0.15
    load_change_rate_hz: float = 1 / 3600
    traction: float = 0.1
    traction_sd: float = 0.2
    yaw_traction_diffusion: float = 0.3
    log_decay: float = 1.2
    log_decay_sd: float = 1.0
    log_decay_drift: float = 0.22
    side_force_diffusion: float = 0.1
    long_diffusion: float = 2e-3
    yaw_diffusion: float = 2e-3
    gain_drift: float = 5e-5
    load_change: float = 0.15
    jump_m: float = 1.0
    jump_rad: float = 0.3
    free_long_diffusion: float = 1.0
    free_yaw_diffusion: float = 1.0
    start_speed_mps: float = 10.0
    start_lateral_mps: float = 1.0
    start_yaw_rate_radps: float = 2.0


def believe(robot: RobotParameters) -> Beliefs:
    """α and β within a factor of 2 of the nominal ones, or next to nothing where those are unknown."""
    alpha, alpha_yaw, half_track_m = robot.alpha, robot.alpha_yaw_or_alpha, robot.half_track_m
    turns = alpha_yaw is not None and half_track_m is not None
    yaw_gain = alpha_yaw / half_track_m if alpha_yaw and half_track_m else 0.0
    widest = UNKNOWN_YAW_GAIN_SD if alpha_yaw is None else alpha_yaw / MIN_HALF_TRACK_M
    return Beliefs(
        alpha=FACTOR_2_MEAN * alpha if alpha is not None else 0.0,
        alpha_sd=FACTOR_2_SD * alpha if alpha is not None else UNKNOWN_ALPHA_SD,
        yaw_gain=FACTOR_2_MEAN * yaw_gain,
        yaw_gain_sd=FACTOR_2_SD * yaw_gain if turns else widest,
        start_slipping=1 / 3 if alpha is not None else START_SLIPPING_UNKNOWN_ALPHA,
    )

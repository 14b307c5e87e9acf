"""The state of one hypothesis about a robot with encoders and known torques, and its prior.

The first twelve places are those of the wheel-speed bank. Then come α and β of traction, what resists rolling
c_v, c_ω, the disturbances d_v, d_ω (all in m/s², those of ω on l_e dω/dt), and the errors of the last bin's
wheel speeds e_v, e_ω in m/s. With u the wheels' speed, F the sum and T the difference of the efforts, s_v and
s_ω the slips s_sum and s_diff, and ± the mean and half difference of the signs of the wheels' speeds:

    dv/dt     = α (1 + g) F − g du_v/dt − c_v ±_v + d_v + v_lat ω    v     = u_v − s_v
    l_e dω/dt = β (1 + h) T − h du_ω/dt − c_ω ±_ω + d_ω              l_e ω = u_ω − s_ω

g = 2 I_φ/(m r²) is the wheels' share of inertia: a wheel that runs away takes a part of the torque along.
In grip du/dt = dv/dt, and the first line is dv/dt = α F. Traction is linear in α: it is a state itself, and
not its logarithm, so that a wide prior is no harder to leave than a narrow one.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS, JointPriors
from wmr_replay.identify.wheel_bank.states import Known, WheelPrior, make_wheel_prior
from wmr_schemas.robot import RobotParameters

ALPHA, BETA, DRAG, DRAG_TURN, AHEAD, AROUND, E_SUM, E_DIFF = range(12, 20)
N_STATES = 20


class JointPrior(NamedTuple):
    """Priors of the wheels' parameters and of traction, with the wheels' shares of inertia g and h."""

    wheels: WheelPrior
    alpha: float
    alpha_sd: float
    beta: float
    beta_sd: float
    spinning: float
    spinning_yaw: float


def make_joint_prior(robot: RobotParameters, known: Known, priors: JointPriors = JOINT_PRIORS) -> JointPrior:
    """The prior of a robot about its nominal parameters; those that are unknown get a wide one."""
    wheels = make_wheel_prior(robot, known)
    spinning, spinning_yaw = spinning_shares(robot, priors)
    if robot.alpha is None:
        wide = priors.unknown_alpha
        return JointPrior(wheels, 0.0, wide, 0.0, wide, spinning, spinning_yaw)
    alpha = robot.alpha
    beta = robot.alpha_yaw if robot.alpha_yaw is not None else alpha
    beta *= float(np.exp(wheels.mean[1])) / (robot.half_track_m or float(np.exp(wheels.mean[1])))
    alpha_sd, beta_sd = priors.alpha_sd_share * alpha, priors.yaw_sd_share * beta
    return JointPrior(wheels, alpha, alpha_sd, beta, beta_sd, spinning, spinning_yaw)


def spinning_shares(robot: RobotParameters, priors: JointPriors) -> tuple[float, float]:
    """The wheels' shares of inertia, ahead and in yaw."""
    mass, inertia, radius = robot.mass_kg, robot.wheel_inertia_kgm2, robot.wheel_radius_m
    if mass is None or inertia is None or radius is None:
        return priors.unknown_spinning, priors.unknown_spinning
    ahead = 2 * inertia / (mass * radius**2)
    if robot.yaw_inertia_kgm2 is None or robot.half_track_m is None:
        return ahead, ahead
    return ahead, ahead * mass * robot.half_track_m**2 / robot.yaw_inertia_kgm2

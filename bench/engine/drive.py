"""The closed loop: a PI controller on the engine's state drives the wheel motors at 100 Hz.

    torque_right ± torque_left = (1/α) (k_p e + k_i ∫e dt)

with e the speed error for the sum, l times the yaw rate error (and α_yaw) for the difference, and the α of
the robot's file. Integrators hold while a wheel is at its limit.
"""

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from engine.effects import Hidden
from engine.robot import Robot
from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Profile

RATE_HZ = 100.0
SETTLE_S = 0.5
STATE_EVERY = 100
"""A state is kept of every so many rows."""
STRAY_SPEED_MPS, STRAY_YAW_RATE_RADPS = 6.0, 6.0


class Gains(NamedTuple):
    """1/s, 1/s², and the torque limit of a wheel as an acceleration in m/s²."""

    proportional_per_s: float
    integral_per_s2: float
    limit_mps2: float


TWO_WHEELED = Gains(2.0, 0.5, 3.0)
SKID_STEER = Gains(8.0, 8.0, 14.0)
"""The scrub of four wheels wants several times the torque."""
WIDE_TYRES = Gains(6.0, 6.0, 5.0)
"""Tyres that are flat across stick until the torque overcomes their scrub."""


def gains_of(robot: Robot) -> Gains:
    """The controller's gains: what scrubs needs more."""
    if robot.four_wheeled:
        return SKID_STEER
    return WIDE_TYRES if robot.wide_tyres else TWO_WHEELED


class State(NamedTuple):
    """The engine's positions and speeds."""

    qpos: F64
    qvel: F64


class RanAway(RuntimeError):
    """A hidden effect makes the controlled robot unstable, or lays it on a part that is no support."""


@dataclass(frozen=True, eq=False)
class Motion:
    """At ``t_s`` (n,): the site's pose, body speeds at the axle, torques as commanded from then on, wheel
    speeds. ``states`` are the engine's positions and speeds at every ``STATE_EVERY``-th row.
    """

    t_s: F64
    x_m: F64
    y_m: F64
    yaw_rad: F64
    v_long_mps: F64
    v_lat_mps: F64
    yaw_rate_radps: F64
    left_nm: F64
    right_nm: F64
    left_radps: F64
    right_radps: F64
    states: tuple[State, ...] = ()


class Plant:
    """The compiled engine, stepped from one command to the next."""

    def __init__(self, hidden: Hidden) -> None:
        self.hidden, self.model = hidden, hidden.spec.compile()
        self.data = mujoco.MjData(self.model)
        self.steps = round(1 / (RATE_HZ * self.model.opt.timestep))
        self.site = self.model.site("pose").id
        self.wheels = [int(self.model.joint(name).dofadr[0]) for name in ("left", "right")]
        self.forward()

    def forward(self) -> None:
        """Bring everything that follows from the state up to date."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def step(self, left_nm: float, right_nm: float) -> None:
        """One period of the commands."""
        torques = np.array([left_nm, right_nm])
        width = self.hidden.dead_zone_nm
        self.data.ctrl[:] = np.sign(torques) * np.maximum(np.abs(torques) - width, 0.0)
        mujoco.mj_step(self.model, self.data, nstep=self.steps)
        self.forward()

    def state(self) -> State:
        """What another robot of the same joints can be put to."""
        return State(self.data.qpos.copy(), self.data.qvel.copy())

    def pose(self) -> tuple[float, float, float]:
        """Of the logged site."""
        x, y, _ = self.data.site_xpos[self.site]
        turned = self.data.site_xmat[self.site]
        return float(x), float(y), float(np.arctan2(turned[3], turned[0]))

    def speeds(self) -> tuple[float, float, float]:
        """Ahead, to the left, and yaw rate, of the base at the axle's middle."""
        turned = self.data.xmat[self.model.body("base").id].reshape(3, 3)
        ahead, left, _ = turned.T @ self.data.qvel[:3]
        return float(ahead), float(left), float(self.data.qvel[5])

    def settle(self) -> None:
        """Let the robot come to rest on its wheels and supports."""
        for _ in range(round(SETTLE_S * RATE_HZ)):
            self.step(0.0, 0.0)

    def touching(self) -> set[int]:
        """The geoms in contact."""
        return {int(geom) for pair in self.data.contact.geom for geom in pair}

    def tilt_rad(self) -> float:
        """Angle between the base's vertical axis and the world's."""
        upright = self.data.xmat[self.model.body("base").id][8]
        return float(np.arccos(np.clip(upright, -1.0, 1.0)))

    def load(self, mass_kg: float) -> None:
        """Put a weight on the base, at its centre of mass."""
        base = self.model.body("base").id
        self.model.body_mass[base] += mass_kg
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))


class Controller:
    """PI on speed and yaw rate."""

    def __init__(self, robot: Robot, gains: Gains) -> None:
        self.robot, self.gains = robot, gains
        self.limit_nm = gains.limit_mps2 / (2 * robot.alpha)
        self.summed = np.zeros(2)

    def torques(self, wanted: F64, speed: float, yaw_rate: float) -> tuple[float, float]:
        """Left and right, in N·m."""
        robot, gains = self.robot, self.gains
        error = np.array([wanted[0] - speed, robot.half_track_m * (wanted[1] - yaw_rate)])
        asked = gains.proportional_per_s * error + gains.integral_per_s2 * self.summed
        total, apart = asked[0] / robot.alpha, asked[1] / robot.alpha_yaw
        left, right = (total - apart) / 2, (total + apart) / 2
        if max(abs(left), abs(right)) < self.limit_nm:
            self.summed += error / RATE_HZ
        return tuple(np.clip([left, right], -self.limit_nm, self.limit_nm))  # type: ignore[return-value]


def rests_elsewhere(hidden: Hidden, clean: Hidden) -> bool:
    """Whether the robot comes to rest on a part that does not touch the ground without the effect, as on a
    lip: it drags there, and the moved mass is the least of its effects.
    """
    with_effect, without = Plant(hidden), Plant(clean)
    with_effect.settle()
    without.settle()
    return not with_effect.touching() <= without.touching()


def driven(hidden: Hidden, robot: Robot, references: Profile, duration_s: float) -> Motion:
    """The drive, after the robot has settled on its wheels. Raises RanAway."""
    plant = Plant(hidden)
    plant.settle()
    t_s = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    wanted = np.stack(references(t_s), axis=1)
    controller = Controller(robot, gains_of(robot))
    rows, states = np.empty((len(t_s), 10)), []
    load = hidden.load
    for k, at_s in enumerate(t_s):
        if load is not None and at_s >= load[1]:
            plant.load(load[0])
            load = None
        speeds = plant.speeds()
        if abs(speeds[0]) > STRAY_SPEED_MPS or abs(speeds[2]) > STRAY_YAW_RATE_RADPS:
            raise RanAway(f"after {at_s:g} s")
        if k % STATE_EVERY == 0:
            states.append(plant.state())
        torques = controller.torques(wanted[k], speeds[0], speeds[2])
        rows[k] = (*plant.pose(), *speeds, *torques, *plant.data.qvel[plant.wheels])
        plant.step(*torques)
    columns = rows.T.copy()
    columns[2] = np.unwrap(columns[2])
    return Motion(t_s, *columns, states=tuple(states))

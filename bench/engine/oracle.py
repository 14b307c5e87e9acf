"""Whether a log of the engine can tell its hidden effect at all, whatever analyses it.

The trace of the effect is what the engine does with it and without it:

- by torques: from the states of the hidden drive, once a second, the robot of its file gets the same torques;
  how its speeds part from the hidden ones is an acceleration, and sideways a speed;
- by wheel speeds: the robot of its file follows the same references; what each drive leaves of a base that is
  fitted to calibration drives differs by a speed;
- a moved or turned site and a late pose add to the pose, and so does sideways creep beyond that of the base.

The trace is seen through the noise of the poses, a coloured disturbance as large and as slow as what the
base leaves on its calibration drives, and a calibration that knows its parameters as well as those drives
show them (``oracle_base``). ``own`` is the expected difference of twice the log-likelihood to nothing hidden,
g the whitened trace, C the whitened effect of the parameters, J their information on the calibration drives:

    own = |g|² − gᵀC (CᵀC + J)⁻¹ Cᵀg

The bounds are those of ``worlds.oracle``. A patch is known by its place: traction lost on one crossing alone
may be the model's own slipping, of which neither time nor share is known; so two crossings have to show it.
No code of the analysis is used.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from worlds.oracle import SEEN, TOLERANCE_M, TOLERANCE_S
from worlds.oracle_filter import moved_m, whitened
from worlds.oracle_forms import Trace

from engine.case import Case
from engine.drive import RATE_HZ, STATE_EVERY, Motion, Plant, State, driven
from engine.effects import Hidden, World, nothing
from engine.logs import Logged
from engine.oracle_base import axle, base_of, body_pose, columns_of, left_by_base, steps_of
from engine.robot import Robot, spec_of
from wmr_schemas.arrays import F64

CROSSINGS = 2
FALLEN_RAD = 0.15
"""A robot that is tilted by so much has fallen: without friction, the same torques may throw it over. It is
stood up again.
"""
SPINS_MPS = 0.05
"""A wheel that slides by so much is put to rolling before the robot without the effect goes on."""


@dataclass(frozen=True)
class Judgement:
    """What a log says of its hidden effect: expected difference of twice the log-likelihood, how far the
    effect moves the path within 4 s, and on how many crossings alone a patch is seen; None without one.
    """

    own: float
    moved_m: float
    crossings: int | None = None

    @property
    def may_refuse(self) -> bool:
        """Whether nothing has to be said of this log."""
        once = self.crossings is not None and self.crossings < CROSSINGS
        return once or self.own < SEEN or self.moved_m < TOLERANCE_M


def judged(case: Case, found: Logged) -> Judgement:
    """The oracle's word on a log with a hidden effect."""
    base, motion = base_of(case), axle(found)
    hidden = by_wheels(case, found) if found.robot.by_wheels else by_torques(found)
    hidden = Trace(hidden.acceleration, hidden.pose + seen_elsewhere(found, motion))
    steps = steps_of(motion, found.robot, base, case.noise_sd)
    patches = crossings(found, hidden)
    seen = whitened(steps, [hidden, *patches, *columns_of(motion, found.robot)])
    own = power(seen[:, : len(patches) + 1], seen[:, len(patches) + 1 :], base.information)
    count = int(np.sum(own[1:] > SEEN)) if "friction" in found.hidden.sizes else None
    return Judgement(float(own[0]), moved_m(steps, hidden, TOLERANCE_S), count)


def power(g: F64, rest: F64, information: F64) -> F64:
    """What each column of ``g`` has beyond the base's parameters, ``rest``."""
    along = rest.T @ g
    explained = np.linalg.solve(rest.T @ rest + information, along)
    return np.asarray(np.sum(g * g, axis=0) - np.sum(along * explained, axis=0))


def crossings(found: Logged, hidden: Trace) -> list[Trace]:
    """The trace of a hidden patch, crossing by crossing."""
    sizes, motion = found.hidden.sizes, found.motion
    if "friction" not in sizes:
        return []
    reach_m = sizes["radius_m"] + found.robot.half_track_m
    off = np.maximum(np.abs(motion.x_m - sizes["x_m"]), np.abs(motion.y_m - sizes["y_m"]))
    edges = np.flatnonzero(np.diff((off < reach_m).astype(int), prepend=0, append=0))
    rows = np.arange(len(off))
    masks = [(rows >= first) & (rows < last) for first, last in edges.reshape(-1, 2)]
    return [Trace(hidden.acceleration * mask, hidden.pose * mask) for mask in masks]


def by_torques(found: Logged, other: Hidden | None = None) -> Trace:
    """How the hidden drive parts from the robot without the effect, or with another one, from the same
    states.
    """
    motion, robot = found.motion, found.robot
    bare = Plant(other or nothing(World(spec_of(robot.name), robot, np.random.default_rng(), 0.0)))
    n = len(motion.t_s)
    bare.settle()
    resting = bare.state()
    apart = np.zeros((3, n))
    for first, state in zip(range(0, n, STATE_EVERY), motion.states, strict=True):
        if bare.tilt_rad() > FALLEN_RAD:
            bare.data.qpos[:], bare.data.qvel[:] = resting
        put(bare, state, motion, first, robot)
        before = np.zeros(3)
        for row in range(first, min(first + STATE_EVERY, n - 1)):
            bare.step(float(motion.left_nm[row]), float(motion.right_nm[row]))
            v, w, q = bare.speeds()
            after = np.array(
                [
                    motion.v_long_mps[row + 1] - v,
                    motion.v_lat_mps[row + 1] - w,
                    robot.half_track_m * (motion.yaw_rate_radps[row + 1] - q),
                ]
            )
            apart[:, row] = (after - before) * RATE_HZ
            apart[1, row] = after[1]
            before = after
        apart[:, first] = apart[:, min(first + 1, n - 1)]
    return Trace(apart, np.zeros((3, n)))


def put(bare: Plant, state: State, motion: Motion, row: int, robot: Robot) -> None:
    """Put the robot without the effect to a state of the hidden one, but for its own height, tilt and
    springs, which would ring; wheels that slide roll.
    """
    data, model, tilt = bare.data, bare.model, np.empty(4)
    _, _, yaw = bare.pose()
    mujoco.mju_mulQuat(tilt, turn_by(-yaw), data.qpos[3:7])
    data.qpos[:2], data.qvel[[0, 1, 5]] = state.qpos[:2], state.qvel[[0, 1, 5]]
    mujoco.mju_mulQuat(data.qpos[3:7], turn_by(heading(state.qpos[3:7])), tilt)
    for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE):
        place, dof = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        data.qpos[place], data.qvel[dof] = state.qpos[place], state.qvel[dof]
    turning = robot.half_track_m * motion.yaw_rate_radps[row]
    for dof, side in zip(bare.wheels, (-1.0, 1.0), strict=True):
        rolling = (motion.v_long_mps[row] + side * turning) / robot.wheel_radius_m
        if abs(data.qvel[dof] - rolling) * robot.wheel_radius_m > SPINS_MPS:
            data.qvel[dof] = rolling
    bare.forward()


def turn_by(yaw_rad: float) -> F64:
    """The quaternion of a turn about the vertical."""
    return np.array([np.cos(yaw_rad / 2), 0.0, 0.0, np.sin(yaw_rad / 2)])


def heading(quaternion: F64) -> float:
    """The turn about the vertical of a quaternion."""
    w, x, y, z = quaternion
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def by_wheels(case: Case, found: Logged) -> Trace:
    """What the hidden drive leaves of the base beyond what a drive without the effect leaves."""
    bare = nothing(World(spec_of(case.robot), found.robot, np.random.default_rng(), case.duration_s))
    other = driven(bare, found.robot, case.references(), case.duration_s)
    base = base_of(case)
    speeds = left_by_base(found.motion, found.robot, base) - left_by_base(other, found.robot, base)
    return Trace(speeds, np.zeros_like(speeds))


def seen_elsewhere(found: Logged, motion: Motion) -> F64:
    """What the logged pose has beyond the axle's, (3, n)."""
    sizes = found.hidden.sizes
    pose = np.zeros((3, len(motion.t_s)))
    if "angle_rad" in sizes:
        pose[2] = sizes["angle_rad"]
    if set(sizes) == {"x_m", "y_m"}:
        arm = (sizes["x_m"] + 1j * sizes["y_m"]) * np.exp(1j * motion.yaw_rad)
        pose[0], pose[1] = arm.real, arm.imag
    return pose - found.hidden.late_s * body_pose(motion)

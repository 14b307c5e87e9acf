"""A case on the project's own simulator, with its own forms of hidden effects and its own sensors."""

import numpy as np

from wmr_schemas.arrays import NS_PER_S
from wmr_synth import Disturbance, Sensors, SimulatedLog, synthesise
from wmr_synth.driving.drivers import ClosedLoop, Gains
from wmr_synth.driving.plan import Plan
from wmr_synth.hidden.world import drawn_world
from wmr_synth.scenarios import Scenario
from worlds.case import RATE_HZ, Case, RanAway, Truth, World, check_stable

LARGEST_ACCELERATION_MPS2 = 3.0
ATTEMPTS = 5
SAME_FORM = frozenset(
    {
        "payload",
        "yaw_inertia",
        "drive_gain",
        "viscous_drag",
        "yaw_damping",
        "wheel_viscous",
        "torque_imbalance",
        "torque_bias_common",
        "torque_bias_differential",
        "input_delay",
        "com_offset",
        "heading_misalignment",
        "pose_lever_arm",
        "cornering_stiffness",
        "yaw_drift",
    }
)
"""Effects that this simulator has as declared, by its documentation."""


def world_of(case: Case) -> World:
    """The case simulated, its effect halved until the robot keeps to sensible speeds. Raises RanAway where
    that takes too long, and where nothing of the library is hidden.
    """
    hide = case.effect
    for _ in range(ATTEMPTS):
        simulated = simulated_with(case, hide)
        effects = simulated.facts["effects"]
        sizes = effects[0]["parameters"] if effects else {}  # type: ignore[index]
        sizes = {key: float(value) for key, value in sizes.items()}
        try:
            check_stable(case, simulated.truth.v_long_mps, simulated.truth.yaw_rate_radps)
        except RanAway:
            if not sizes:
                raise
            hide = f"{case.effect}:" + ",".join(f"{key}={value / 2}" for key, value in sizes.items())
        else:
            return World(case, simulated.log, truth_of(simulated), case.robot(), case.conditions(), sizes)
    raise RanAway(case.key)


def simulated_with(case: Case, hide: str) -> SimulatedLog:
    """The case with an effect as ``--hide`` takes it, or with none."""
    robot, drive, around = case.robot(), case.drive(), case.conditions()
    assert robot.alpha is not None
    gains = Gains(2.0, 0.5, LARGEST_ACCELERATION_MPS2 / (2 * robot.alpha))
    plan = Plan(ClosedLoop(drive.path, gains), drive.modes, *drive.start)
    sensors = Sensors(RATE_HZ, RATE_HZ, *case.noise_sd, jitter_s=around.jitter_s, dropout=around.dropout)
    disturbance = Disturbance(around.disturbance_mps2, around.disturbance_s)
    hidden = [hide] if hide else []
    return synthesise(
        Scenario(case.family, case.family, case.duration_s, lambda *_: plan, sensors, robot),
        seed=case.seed,
        world=drawn_world(hidden, case.seed, robot, case.duration_s, disturbance),
    )


def truth_of(simulated: SimulatedLog) -> Truth:
    """The noise-free motion at the stamps of the poses."""
    motion = simulated.truth
    return Truth(
        motion.t_ns / NS_PER_S,
        motion.x_m,
        motion.y_m,
        motion.yaw_rad,
        motion.v_long_mps,
        motion.v_lat_mps,
        motion.yaw_rate_radps,
        motion.effort_left_nm,
        motion.effort_right_nm,
        motion.mode.astype(np.int8),
    )

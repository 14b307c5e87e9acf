"""A case on the project's own simulator, with its own forms of hidden effects and its own sensors."""

import numpy as np

from wmr_schemas.arrays import NS_PER_S
from wmr_synth import Disturbance, Sensors, synthesise
from wmr_synth.driving.drivers import ClosedLoop, Gains
from wmr_synth.driving.plan import Plan
from wmr_synth.hidden.world import drawn_world
from wmr_synth.scenarios import Scenario
from worlds.case import RATE_HZ, Case, Truth, World, check_stable

LARGEST_ACCELERATION_MPS2 = 3.0


def world_of(case: Case) -> World:
    """The case simulated by ``wmr_synth``. Raises RanAway where the hidden effect makes it unstable."""
    robot, drive, around = case.robot(), case.drive(), case.conditions()
    assert robot.alpha is not None
    gains = Gains(2.0, 0.5, LARGEST_ACCELERATION_MPS2 / (2 * robot.alpha))
    plan = Plan(ClosedLoop(drive.path, gains), drive.modes, *drive.start)
    sensors = Sensors(RATE_HZ, RATE_HZ, *case.noise_sd, jitter_s=around.jitter_s, dropout=around.dropout)
    level = around.disturbance_mps2
    disturbance = Disturbance(level, around.disturbance_s) if level > 0 else Disturbance()
    hide = [case.effect] if case.effect else []
    simulated = synthesise(
        Scenario(case.family, case.family, case.duration_s, lambda *_: plan, sensors, robot),
        seed=case.seed,
        world=drawn_world(hide, case.seed, robot, case.duration_s, disturbance),
    )
    effects = simulated.facts["effects"]
    sizes = effects[0]["parameters"] if case.effect else {}  # type: ignore[index]
    motion = simulated.truth
    check_stable(case, motion.v_long_mps, motion.yaw_rate_radps)
    truth = Truth(
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
    return World(case, simulated.log, truth, robot, around, {k: float(v) for k, v in sizes.items()})

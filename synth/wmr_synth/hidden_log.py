"""Logs with hidden effects in memory, for benchmarks and tests of the gap analysis."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_synth.driving.patrol import SMALL_ROBOT
from wmr_synth.hidden.disturbance import DEFAULT_DISTURBANCE, NO_DISTURBANCE, Disturbance
from wmr_synth.hidden.world import drawn_world
from wmr_synth.sensors import NOISE_LEVELS, Sensors
from wmr_synth.synthesis import find_scenario, synthesise
from wmr_synth.wheel_speed.encoders import EncoderSensors


def hidden_log(
    scenario: str,
    seed: int,
    *,
    hide: Sequence[str] = (),
    noise: str = "mocap",
    disturbance: Disturbance = DEFAULT_DISTURBANCE,
    robot: RobotParameters | None = None,
    duration_s: float | None = None,
    wrong_modes: float = 0.0,
) -> tuple[Log, dict[str, Any]]:
    """The log that ``synth`` would write, and the facts of its truth file; nothing touches a disk.

    ``hide`` as on the command line (``NAME[:param=value,…]``); ``noise`` one of NOISE_LEVELS; 100 Hz;
    ``log.robot`` is the base robot: by itself the patrol's small one, or that of a scenario by wheel speeds,
    which keeps its encoders and has no disturbance unless another than the default one is given. Raises
    InvalidSetting as ``synthesise`` does.
    """
    chosen = find_scenario(scenario)
    length_s = chosen.duration_s if duration_s is None else duration_s
    by_wheels = isinstance(chosen.sensors, EncoderSensors)
    robot = robot or (chosen.robot if by_wheels else SMALL_ROBOT)
    xy_m, yaw_rad = NOISE_LEVELS[noise]
    sensors = chosen.sensors if by_wheels else Sensors(100.0, 100.0)
    sensors = replace(sensors, noise_xy_sd_m=xy_m, noise_yaw_sd_rad=yaw_rad)
    if by_wheels and disturbance == DEFAULT_DISTURBANCE:
        disturbance = NO_DISTURBANCE
    world = drawn_world(hide, seed, robot, length_s, disturbance)
    simulated = synthesise(
        chosen,
        seed=seed,
        duration_s=length_s,
        sensors=sensors,
        robot=robot,
        world=world,
        wrong_modes=wrong_modes,
    )
    return simulated.log, simulated.facts

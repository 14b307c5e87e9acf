"""Logs with hidden effects in memory, for benchmarks and tests of the gap analysis."""

from collections.abc import Sequence
from typing import Any

from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_synth.driving.patrol import SMALL_ROBOT
from wmr_synth.hidden.disturbance import DEFAULT_DISTURBANCE, Disturbance
from wmr_synth.hidden.world import drawn_world
from wmr_synth.sensors import NOISE_LEVELS, Sensors
from wmr_synth.synthesis import find_scenario, synthesise


def hidden_log(
    scenario: str,
    seed: int,
    *,
    hide: Sequence[str] = (),
    noise: str = "mocap",
    disturbance: Disturbance = DEFAULT_DISTURBANCE,
    robot: RobotParameters = SMALL_ROBOT,
    duration_s: float | None = None,
    wrong_modes: float = 0.0,
) -> tuple[Log, dict[str, Any]]:
    """The log that ``synth`` would write, and the facts of its truth file; nothing touches a disk.

    ``hide`` as on the command line (``NAME[:param=value,…]``); ``noise`` one of NOISE_LEVELS; 100 Hz;
    ``log.robot`` is the base robot. Raises InvalidSetting as ``synthesise`` does.
    """
    chosen = find_scenario(scenario)
    length_s = chosen.duration_s if duration_s is None else duration_s
    sensors = Sensors(100.0, 100.0, *NOISE_LEVELS[noise])
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

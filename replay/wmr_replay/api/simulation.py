"""What a synthetic log is made with: the robot, its sensors, and the world beyond the base model."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias, TypedDict

from wmr_replay.api.places import LocalPlace, local_path
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.model_file import Model, NoiseModel, split_sd
from wmr_schemas.robot import RobotParameters
from wmr_schemas.tomlfile import expect_table, read_toml
from wmr_synth import Scenario, Sensors, World
from wmr_synth.hidden.disturbance import parse_disturbance
from wmr_synth.hidden.world import drawn_world, model_world
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.synthesis import default_world
from wmr_synth.wheel_speed.encoders import OF_TORQUES, EncoderSensors

RobotLike: TypeAlias = RobotParameters | LocalPlace
"""Robot parameters, or the path of a TOML file with a ``[robot]`` table."""


class SensorArguments(TypedDict, total=False):
    """The fields of ``wmr_synth.Sensors`` as keyword arguments, and those of ``EncoderSensors`` for robots
    that wheel speeds drive; None: the scenario's.
    """

    rate_hz: float | None
    torque_rate_hz: float | None
    noise_xy_sd_m: float | None
    noise_yaw_sd_rad: float | None
    noise_effort_sd_nm: float | None
    noise_wheel_speed_sd_radps: float | None
    jitter_s: float | None
    dropout: float | None
    clock_offset_s: float | None
    wheel_rate_hz: float | None
    encoder_ticks: float | None
    command_rate_hz: float | None


def robot_of(scenario: Scenario, robot: RobotLike | None, model: Model | None) -> RobotParameters:
    """The scenario's robot or the given one; the model's, of which the given one fills in what it lacks."""
    given = robot if robot is None or isinstance(robot, RobotParameters) else read_robot(local_path(robot))
    if model is None:
        return scenario.robot if given is None else given
    filled_in = {} if given is None else given.known()
    return RobotParameters.from_values(filled_in | model.robot.known(), "--model")


def world_of(
    scenario: Scenario,
    hide: tuple[str, ...],
    disturbance: str | None,
    model: Model | None,
    robot: RobotParameters,
    seed: int,
    length_s: float,
) -> World:
    """Hidden effects or those of the model; the disturbance given, else the model's, else the scenario's."""
    given = None if disturbance is None else parse_disturbance(disturbance)
    if model is not None:
        world = model_world(model)
        return world if given is None else replace(world, disturbance=given)
    acting = default_world(scenario).disturbance if given is None else given
    return drawn_world(hide, seed, robot, length_s, acting)


def sensors_of(
    scenario: Scenario,
    noise: str | None,
    model: Model | None,
    noise_variance: float | None,
    options: Mapping[str, Any],
) -> Sensors:
    """The scenario's sensors with the noise of the model, of ``noise`` and of the single options, in turn."""
    changes = model_noise(None if model is None else model.noise)
    if noise is not None:
        if noise not in NOISE_LEVELS:
            raise InvalidSetting(f"no noise {noise!r}; known are {', '.join(NOISE_LEVELS)}")
        changes["noise_xy_sd_m"], changes["noise_yaw_sd_rad"] = NOISE_LEVELS[noise]
    given = {name: value for name, value in options.items() if value is not None}
    if unknown := set(given) - set(vars(scenario.sensors)):
        known = ", ".join(vars(scenario.sensors))
        raise InvalidSetting(f"no sensor option {', '.join(sorted(unknown))}; known are {known}")
    of_torques = [name for name in OF_TORQUES if name in given]
    if of_torques and isinstance(scenario.sensors, EncoderSensors):
        raise InvalidSetting(f"{scenario.name} records no torques: leave out {', '.join(of_torques)}")
    if noise_variance is not None:
        if noise is not None or {"noise_xy_sd_m", "noise_yaw_sd_rad"} & set(given):
            raise InvalidSetting(
                "noise variance already sets the noise of x, y and yaw; leave out noise and …-sd options"
            )
        changes["noise_xy_sd_m"] = changes["noise_yaw_sd_rad"] = noise_variance**0.5
    return replace(scenario.sensors, **(changes | given))


def model_noise(noise: NoiseModel | None) -> dict[str, float]:
    """The sensors' fields that a model's noise sets."""
    if noise is None:
        return {}
    known = {"noise_xy_sd_m": noise.position_sd_m, "noise_yaw_sd_rad": noise.yaw_sd_rad}
    return {name: value for name, value in known.items() if value is not None}


def read_robot(path: Path) -> RobotParameters:
    """The [robot] table of a robot, model or mapping file, without the standard deviations in it."""
    tables = read_toml(path)
    if "robot" not in tables:
        raise InvalidFile(path, "[robot]", "missing; the simulator needs the robot's parameters")
    values, _ = split_sd(path, "[robot]", expect_table(path, "[robot]", tables["robot"]))
    return RobotParameters.from_values(values, str(path))

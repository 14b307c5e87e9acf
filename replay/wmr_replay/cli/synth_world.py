"""What `synth` takes besides the scenario: the robot, its noise, and what lies beyond the base model."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from wmr_schemas.errors import InvalidFile
from wmr_schemas.model_file import Model, NoiseModel, read_model, split_sd
from wmr_schemas.robot import RobotParameters
from wmr_schemas.tomlfile import expect_table, read_toml

if TYPE_CHECKING:
    from wmr_synth import Scenario, Sensors
    from wmr_synth.hidden import World

NOISE_NAMES = ("mocap", "rtk", "poor")


@dataclass(frozen=True)
class Beyond:
    """The options by which a log's world differs from the base model's."""

    hide: tuple[str, ...]
    model: Path | None
    disturbance: str | None

    def read_model(self) -> Model | None:
        """The model file, if any; not beside hidden effects, whose form is another."""
        if self.model is None:
            return None
        if self.hide:
            raise click.UsageError("--hide and --model each say what the effects are; give one of them")
        return read_model(self.model)


def chosen_robot(scenario: "Scenario", robot: Path | None, model: Model | None) -> RobotParameters:
    """The scenario's robot or that of --robot; the model's, of which --robot fills in what it lacks."""
    if model is None:
        return scenario.robot if robot is None else read_robot(robot)
    filled_in = {} if robot is None else read_robot(robot).known()
    return RobotParameters.from_values(filled_in | model.robot.known(), "--model")


def chosen_world(
    beyond: Beyond,
    model: Model | None,
    scenario: "Scenario",
    robot: RobotParameters,
    seed: int,
    length_s: float,
) -> "World":
    """Effects of --hide or of the model; the disturbance asked for, else the model's, else the scenario's."""
    from wmr_synth.hidden.disturbance import parse_disturbance
    from wmr_synth.hidden.world import drawn_world, model_world
    from wmr_synth.synthesis import default_world

    asked = None if beyond.disturbance is None else parse_disturbance(beyond.disturbance)
    if model is not None:
        world = model_world(model)
        return world if asked is None else replace(world, disturbance=asked)
    disturbance = default_world(scenario).disturbance if asked is None else asked
    return drawn_world(beyond.hide, seed, robot, length_s, disturbance)


def chosen_sensors(
    scenario: "Scenario",
    noise: str | None,
    model: Model | None,
    noise_variance: float | None,
    options: dict[str, float | None],
) -> "Sensors":
    """The scenario's sensors, with the noise of the model, of --noise and of the single options, in turn."""
    from wmr_synth.sensors import NOISE_LEVELS

    changes = model_noise(None if model is None else model.noise)
    if noise is not None:
        changes["noise_xy_sd_m"], changes["noise_yaw_sd_rad"] = NOISE_LEVELS[noise]
    given = {name: value for name, value in options.items() if value is not None}
    if noise_variance is not None:
        if noise is not None or {"noise_xy_sd_m", "noise_yaw_sd_rad"} & set(given):
            raise click.UsageError(
                "--noise-variance already sets the noise of x, y and yaw; leave out --noise and the …-sd ones"
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

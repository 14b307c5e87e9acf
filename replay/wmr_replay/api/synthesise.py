"""Synthetic logs: a scenario simulated and measured, with what only the simulator knows beside it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypedDict, Unpack

import polars as pl

from wmr_replay.api.names import with_mode_names
from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.request import ModelLike, model_of
from wmr_schemas.effects import BEYOND, EFFECTS
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.model_file import Model, NoiseModel, split_sd
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_schemas.tomlfile import expect_table, read_toml
from wmr_synth import SCENARIOS, Scenario, Sensors, SimulatedLog, World, record, truth_frame
from wmr_synth.hidden.disturbance import parse_disturbance
from wmr_synth.hidden.drawing import describe_range
from wmr_synth.hidden.registry import words_of
from wmr_synth.hidden.world import drawn_world, model_world
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.synthesis import default_world, find_scenario
from wmr_synth.synthesis import synthesise as simulate

Encoding: TypeAlias = Literal["ros2", "protobuf", "json"]
Noise: TypeAlias = Literal["mocap", "rtk", "poor"]
RobotLike: TypeAlias = RobotParameters | LocalPlace
"""Robot parameters, or the path of a TOML file with a ``[robot]`` table."""
Progress = Callable[[int, int], None]


class SensorArguments(TypedDict, total=False):
    """The fields of ``wmr_synth.Sensors`` as keyword arguments; None: the scenario's."""

    rate_hz: float | None
    torque_rate_hz: float | None
    noise_xy_sd_m: float | None
    noise_yaw_sd_rad: float | None
    noise_effort_sd_nm: float | None
    noise_wheel_speed_sd_radps: float | None
    jitter_s: float | None
    dropout: float | None
    clock_offset_s: float | None


class Synthetic:
    """The answer of ``synthesise``.

    Attributes:
        log: The signals, as ``replay`` takes them.
        facts: What ``<stem>.truth.json`` states: scenario, seed, options, parameters, hidden effects.
    """

    def __init__(self, scenario: str, seed: int, simulated: SimulatedLog) -> None:
        self.scenario, self.seed, self._simulated = scenario, seed, simulated

    @property
    def log(self) -> Log:
        """The signals."""
        return self._simulated.log

    @property
    def facts(self) -> dict[str, Any]:
        """What only the simulator knows."""
        return dict(self._simulated.facts)

    @property
    def truth(self) -> pl.DataFrame:
        """The noise-free motion at the pose stamps; ``mode`` by name."""
        return with_mode_names(truth_frame(self._simulated), ("mode",))

    @property
    def n_messages(self) -> int:
        """Poses and torques."""
        return len(self.log.pose) + (len(self.log.torque) if self.log.torque else 0)

    def save(
        self,
        path: LocalPlace,
        *,
        encoding: Encoding = "ros2",
        truth: bool = True,
        mode_topic: bool = True,
        progress: Progress | None = None,
    ) -> tuple[Path, ...]:
        """Write the log as MCAP, and with ``truth`` its side files; the files, which appear together.

        Without ``mode_topic`` the true mode stands in the side files alone. Raises InvalidSetting where the
        file cannot be written.
        """
        target = local_path(path)
        home_of(target)
        try:
            return record(
                self._simulated,
                target,
                encoding=encoding,
                truth=truth,
                mode_topic=mode_topic,
                progress=progress,
            )
        except OSError as error:
            raise InvalidSetting(f"{target}: cannot be written ({error.strerror})") from None

    def __repr__(self) -> str:
        return f"<Synthetic log: {self.scenario}, seed {self.seed}, {self.n_messages} messages>"


def synthesise(
    scenario: str,
    out: LocalPlace | None = None,
    *,
    seed: int = 0,
    duration_s: float | None = None,
    hide: Sequence[str] = (),
    model: ModelLike | None = None,
    robot: RobotLike | None = None,
    disturbance: str | None = None,
    noise: Noise | None = None,
    noise_variance: float | None = None,
    wrong_modes: float = 0.0,
    encoding: Encoding = "ros2",
    **sensors: Unpack[SensorArguments],
) -> Synthetic:
    """Simulate a scenario and measure it.

    Args:
        scenario: One of ``scenarios``.
        out: MCAP file to write, with its side files; None: nothing is written.
        seed: One seed gives one log.
        duration_s: Length; None: the scenario's.
        hide: Effects beyond the base model, ``NAME`` or ``NAME:param=value,…``; a bare name draws its size.
        model: Robot, effects and noise of a model or model file; not beside ``hide``.
        robot: Robot parameters or a file of them; fills in what ``model`` lacks.
        disturbance: ``SD:TAU`` in m/s² and s on every channel, or ``none``.
        noise: Pose noise: 1 mm and 2 mrad, 1 cm and 5 mrad, or 5 cm and 20 mrad.
        noise_variance: Variance of the noise on x (m²), y (m²) and yaw (rad²).
        wrong_modes: Share of the pose samples at which the log's mode is wrong.
        encoding: Message encoding of ``out``.
        **sensors: Fields of ``wmr_synth.Sensors``, such as ``rate_hz`` or ``dropout``; None: the scenario's.

    Raises:
        InvalidSetting: An unknown scenario or effect, or options that contradict one another.

    Example:
        >>> import wmr_replay as wr
        >>> made = wr.synthesise("stop-and-go", seed=3, duration_s=4, rate_hz=50, torque_rate_hz=50)
        >>> len(made.log.pose), made.truth["mode"][0]
        (201, 'ideal')
    """
    chosen = find_scenario(scenario)
    target = None if out is None else local_path(out)
    if target is not None:
        home_of(target)
    if hide and model is not None:
        raise InvalidSetting("hide and model each say what the effects are; give one of them")
    read = model_of(model)
    parameters = robot_of(chosen, robot, read)
    length_s = duration_s or chosen.duration_s
    simulated = simulate(
        chosen,
        seed=seed,
        duration_s=duration_s,
        sensors=sensors_of(chosen, noise, read, noise_variance, sensors),
        robot=parameters,
        world=world_of(chosen, tuple(hide), disturbance, read, parameters, seed, length_s),
        wrong_modes=wrong_modes,
    )
    made = Synthetic(chosen.name, seed, simulated)
    if target is not None:
        made.save(target, encoding=encoding)
    return made


def check_scenario(name: str) -> None:
    """Raises InvalidSetting, with the nearest names, unless there is a scenario of this name."""
    find_scenario(name)


def scenarios() -> pl.DataFrame:
    """Name, description, length and pose rate of every scenario."""
    rows = [(s.name, s.description, s.duration_s, s.sensors.rate_hz) for s in SCENARIOS.values()]
    schema = {
        "name": pl.String,
        "description": pl.String,
        "duration_s": pl.Float64,
        "rate_hz": pl.Float64,
    }
    return pl.DataFrame(rows, schema=schema, orient="row")


def hidden_effects() -> list[dict[str, Any]]:
    """Every effect that ``hide`` knows: its forms, parameters with units, and the ranges of a bare name."""
    return [
        {
            "name": name,
            "candidate": form.formula,
            "hidden": words_of(name),
            "parameters": form.units,
            "ranges": {key: describe_range(within) for key, within in form.ranges.items()},
        }
        for name, form in (EFFECTS | BEYOND).items()
    ]


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

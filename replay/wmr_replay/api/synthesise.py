"""Synthetic logs: a scenario simulated and measured, with what only the simulator knows beside it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias, Unpack

import polars as pl

from wmr_replay.api.names import with_mode_names
from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.request import ModelLike, model_of
from wmr_replay.api.simulation import RobotLike, SensorArguments, robot_of, sensors_of, world_of
from wmr_replay.pipeline.memory import wheels_apart
from wmr_schemas.effects import BEYOND, EFFECTS
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.signals import Log
from wmr_synth import SCENARIOS, SimulatedLog, record, truth_frame
from wmr_synth.hidden.drawing import describe_range
from wmr_synth.hidden.registry import words_of
from wmr_synth.synthesis import find_scenario
from wmr_synth.synthesis import synthesise as simulate

Encoding: TypeAlias = Literal["ros2", "protobuf", "json"]
Commands: TypeAlias = Literal["wheels", "twist", "none"]
Torques: TypeAlias = Literal["together", "apart", "none"]
Noise: TypeAlias = Literal["mocap", "rtk", "poor"]
Progress = Callable[[int, int], None]


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
        """Poses, and torques or wheel speeds and commands."""
        wheels = self.log.wheels if self.log.torque is None else wheels_apart(self.log)
        others = (self.log.torque, wheels, self.log.commands)
        return len(self.log.pose) + sum(len(track) for track in others if track is not None)

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
    nominal_error: float | None = None,
    commands: Commands | None = None,
    torques: Torques | None = None,
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
        nominal_error: For a robot that wheel speeds drive: share by which its stated lengths may be wrong.
        commands: For such a robot: commands as wheel speeds, as a twist, or none; None: the scenario's.
        torques: For such a robot: torques of the wheels in the messages of the wheel speeds, in a channel of
            their own (``apart``), or none; None: the scenario's, none.
        encoding: Message encoding of ``out``.
        **sensors: Fields of ``wmr_synth.Sensors``, such as ``rate_hz`` or ``dropout``, and ``wheel_rate_hz``,
            ``encoder_ticks``, ``command_rate_hz`` of a robot that wheel speeds drive; None: the scenario's.

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
        nominal_error=nominal_error,
        commands_as=commands,
        torques_as=torques,
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
            "base_models": list(form.models),
            "candidate": form.formula,
            "hidden": words_of(name, "torque" if "torque" in form.models else "wheel_speed"),
            "parameters": form.units,
            "ranges": {key: describe_range(within) for key, within in form.ranges.items()},
        }
        for name, form in (EFFECTS | BEYOND).items()
    ]

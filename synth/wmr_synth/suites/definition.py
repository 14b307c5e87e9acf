"""The definition of a suite: a name, a version, and for each log a scenario, a seed and parameters."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.robot import RobotParameters
from wmr_synth.hidden.disturbance import parse_disturbance
from wmr_synth.hidden.world import World, drawn_world
from wmr_synth.recorder import CODECS
from wmr_synth.scenarios import Scenario
from wmr_synth.sensors import NOISE_LEVELS, Sensors
from wmr_synth.suites.damage import DAMAGES
from wmr_synth.synthesis import SimulatedLog, default_world, find_scenario, synthesise
from wmr_synth.wheel_speed.encoders import EncoderSensors, rates_hz

SENSOR_NAMES = tuple(f.name for f in fields(EncoderSensors))
"""Those of robots that wheel speeds drive among them."""
NUMBERS = ("duration_s", "noise_variance", "wrong_modes", "nominal_error", *SENSOR_NAMES)
"""Parameters that are numbers, named as in ``<stem>.truth.json``."""
TEXTS = ("encoding", "noise", "disturbance", "commands")
SWITCHES = ("truth", "mode_topic")
PARAMETERS = (*NUMBERS, *TEXTS, *SWITCHES, "hide", "robot", "chunk_bytes")


@dataclass(frozen=True)
class LogSpec:
    """One log of a suite. ``parameters`` change what the scenario says; ``damage`` names how it is broken.

    ``noise_variance`` and ``noise`` (a level's name) stand for both ``noise_…_sd`` of the pose; ``truth``
    (True) for the truth's channel and side files, ``mode_topic`` (True) for the channel alone; ``hide`` is a
    list of effects, ``disturbance`` a text, both as ``synth`` has them; ``robot`` a table of parameters;
    ``chunk_bytes`` the size of the file's chunks.
    """

    name: str
    scenario: str
    seed: int = 0
    parameters: Mapping[str, Any] = field(default_factory=dict)
    damage: str | None = None

    def __post_init__(self) -> None:
        unknown = [key for key in self.parameters if key not in PARAMETERS]
        if unknown:
            raise InvalidSetting(
                f"log {self.name}: no parameter {unknown[0]!r}; known: {', '.join(PARAMETERS)}"
            )
        if self.damage is not None and self.damage not in DAMAGES:
            raise InvalidSetting(f"log {self.name}: no damage {self.damage!r}; known: {', '.join(DAMAGES)}")
        if self.encoding not in CODECS:
            raise InvalidSetting(
                f"log {self.name}: no encoding {self.encoding!r}; known: {', '.join(CODECS)}"
            )
        self.sensors()
        self.world()

    @property
    def plan(self) -> Scenario:
        """The scenario that the log comes from."""
        return find_scenario(self.scenario)

    @property
    def encoding(self) -> str:
        """The encoding of the messages."""
        return str(self.parameters.get("encoding", "ros2"))

    @property
    def duration_s(self) -> float:
        """The length asked for, else the scenario's."""
        return float(self.parameters.get("duration_s", self.plan.duration_s))

    @property
    def has_truth(self) -> bool:
        """Whether the true mode is in the log and side files lie beside it; never beside a damaged log."""
        return bool(self.parameters.get("truth", True)) and self.damage is None

    def sensors(self) -> Sensors:
        """The scenario's sensors, changed as the parameters say."""
        changes: dict[str, float] = {}
        if "noise" in self.parameters:
            changes["noise_xy_sd_m"], changes["noise_yaw_sd_rad"] = noise_level(self.parameters["noise"])
        if "noise_variance" in self.parameters:
            sd = float(self.parameters["noise_variance"]) ** 0.5
            changes |= {"noise_xy_sd_m": sd, "noise_yaw_sd_rad": sd}
        changes |= {name: float(v) for name, v in self.parameters.items() if name in SENSOR_NAMES}
        if unknown := [name for name in changes if not hasattr(self.plan.sensors, name)]:
            raise InvalidSetting(f"log {self.name}: {self.scenario} has no {unknown[0]}")
        return replace(self.plan.sensors, **changes)

    def robot(self) -> RobotParameters:
        """The robot given, else the scenario's."""
        given = self.parameters.get("robot")
        return self.plan.robot if given is None else RobotParameters.from_values(given, self.name)

    def world(self) -> World:
        """Hidden effects, open parameters drawn by the seed; the given disturbance, else the scenario's."""
        asked = self.parameters.get("disturbance")
        disturbance = default_world(self.plan).disturbance if asked is None else parse_disturbance(asked)
        hide = self.parameters.get("hide", ())
        return drawn_world(hide, self.seed, self.robot(), self.duration_s, disturbance)

    def simulated(self) -> SimulatedLog:
        """The log and its truth, in memory."""
        return synthesise(
            self.plan,
            seed=self.seed,
            duration_s=self.duration_s,
            sensors=self.sensors(),
            robot=self.robot(),
            world=self.world(),
            wrong_modes=float(self.parameters.get("wrong_modes", 0.0)),
            nominal_error=self.parameters.get("nominal_error"),
            commands_as=self.parameters.get("commands"),
        )

    @property
    def n_messages(self) -> int:
        """About how many messages the log holds."""
        sensors = self.sensors()
        return round(self.duration_s * sum(rates_hz(sensors)))


def noise_level(name: str) -> tuple[float, float]:
    """Standard deviations of position in m and yaw in rad of a named level."""
    if name not in NOISE_LEVELS:
        raise InvalidSetting(f"no noise {name!r}; known are {', '.join(NOISE_LEVELS)}")
    return NOISE_LEVELS[name]


@dataclass(frozen=True)
class Suite:
    """A named, versioned set of logs. The version changes whenever any log would."""

    name: str
    version: int
    description: str
    logs: tuple[LogSpec, ...]

    def __post_init__(self) -> None:
        twice = [name for name, n in Counter(log.name for log in self.logs).items() if n > 1]
        if twice:
            raise InvalidSetting(f"suite {self.name}: two logs are called {twice[0]!r}")
        if not self.logs:
            raise InvalidSetting(f"suite {self.name}: it has no log")

    def seeded(self, seed: int) -> "Suite":
        """The same suite with ``seed`` added to every log's seed."""
        return replace(self, logs=tuple(replace(log, seed=log.seed + seed) for log in self.logs))

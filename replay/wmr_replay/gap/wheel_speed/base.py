"""The base model of a robot that wheel speeds drive."""

from dataclasses import dataclass, field

from wmr_replay.gap.wheel_speed.between_logs import misfit_sd
from wmr_replay.gap.wheel_speed.candidates import SLIP
from wmr_replay.gap.wheel_speed.drive import Chassis, Values
from wmr_replay.gap.wheel_speed.predict import DECLARED, FACTORS
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.slip_terms import is_slip_term


@dataclass(frozen=True)
class Base:
    """The nominal robot, known effects, where they come from, and effects that this source rules out."""

    robot: RobotParameters
    effects: tuple[Effect, ...]
    source: str
    unnameable: tuple[str, ...] = ()
    robot_sd: dict[str, float] = field(default_factory=dict)
    misfit: dict[str, float] = field(default_factory=dict)

    @property
    def chassis(self) -> Chassis:
        """Radius and half-track."""
        return Chassis(self.robot.wheel_radius_m or 1.0, self.robot.half_track_m or 1.0)

    @property
    def values(self) -> Values:
        """The effects that act on this base."""
        return {
            e.name: dict(e.parameters) for e in self.effects if e.name in DECLARED or is_slip_term(e.name)
        }

    @property
    def slips_to(self) -> float:
        """The largest loss of a slip on the calibration logs; all of it where the robot is not calibrated."""
        return self.misfit.get(SLIP, 0.0) if self.values_sd else 1.0

    @property
    def values_sd(self) -> Values:
        """Their standard deviations, of those that the source says, and what calibration logs show beside."""
        held: Values = {e.name: relative_sd(e) for e in self.effects if e.name in DECLARED and e.sd}
        return {**misfit_sd(self.misfit), **held}


def relative_sd(effect: Effect) -> dict[str, float]:
    """An effect's standard deviations, as those of another one of its name beside it: of a ratio that changes
    a factor of the model, sd/(1 + ratio).
    """
    factor = 1 + effect.parameters["ratio"] if effect.name in FACTORS else 1.0
    return {key: sd / factor for key, sd in effect.sd.items()}


def base_of(robot: RobotParameters, model: Model | None) -> Base:
    """The base of a model file, else of the log's own parameters. Raises InvalidSignal without lengths."""
    given = (
        robot if model is None else RobotParameters.from_values(robot.known() | model.robot.known(), "model")
    )
    lacking = [key for key in ("wheel_radius_m", "half_track_m") if getattr(given, key) is None]
    if lacking:
        raise InvalidSignal(
            "robot",
            f"{' and '.join(lacking)} needed for a model that wheel speeds drive; "
            "give nominal values in [robot] of --map or --model",
        )
    source = "metadata record" if model is None else "model file"
    if model is None:
        return Base(given, (), source)
    return Base(given, model.effects, source, robot_sd=model.robot_sd, misfit=model.misfit)

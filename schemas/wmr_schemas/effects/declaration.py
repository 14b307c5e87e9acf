"""The declaration of an effect: one record, from which every other list of effects is made.

Terms after ISO 8855. In formulas ``v`` is the longitudinal speed and ``u`` an effort, in robot conventions.
A declaration holds text and numbers only. The analysis has the formula as code in ``wmr_replay.effects``, the
simulator has a form of its own in ``wmr_synth.hidden``; neither imports the other.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from wmr_schemas.effects.manoeuvres import Manoeuvre
from wmr_schemas.modes import ContactMode

INFINITE = float("inf")
Channel = Literal["longitudinal", "lateral", "yaw", "both", "input", "measurement"]
BaseModel = Literal["torque", "wheel_speed"]
"""What drives the base model: wheel torques, or measured (or commanded) wheel speeds."""
DrivenBy = Literal["torque", "wheel_speed", "command"]
"""What drives a model, where measured and commanded wheel speeds make a difference."""
BOTH: tuple[BaseModel, ...] = ("torque", "wheel_speed")
WHEEL_SPEED: tuple[BaseModel, ...] = ("wheel_speed",)
EVERY_INPUT: tuple[DrivenBy, ...] = ("torque", "wheel_speed", "command")
ActsOn = Literal[
    "robot", "acceleration", "wheel", "efforts", "pose", "tyre", "traction", "rolling", "commands"
]
"""The robot's parameters; dv_long/dt or l·yaw_acc; the torque at a wheel; the commanded inputs; the measured
pose; lateral tyre force; traction in a stretch of time or a region; the motion that follows from wheel
speeds; the wheel speeds that follow from commands.
"""
Extent = Literal["always", "time", "space"]
Role = Literal["size", "time", "place"]
Scale = Literal["", "both_wheels", "turning", "wheel_speed", "duration"]
GridUnit = Literal["", "typical_effort", "largest_effort"]


class Domain(Enum):
    """Values with which an effect's equations make sense: (least, least is allowed, end, in words)."""

    ANY = (-INFINITE, True, INFINITE, "be a number")
    NOT_NEGATIVE = (0.0, True, INFINITE, "not be negative")
    ABOVE_ZERO = (0.0, False, INFINITE, "be above 0")
    ABOVE_MINUS_ONE = (-1.0, False, INFINITE, "be above −1")
    SHARE = (0.0, True, 1.0, "lie in [0, 1)")
    SIGNED_SHARE = (-1.0, False, 1.0, "lie in (−1, 1)")

    def holds(self, value: float) -> bool:
        """Whether ``value`` lies in the domain; NaN, a value still to be decided, does."""
        least, allowed, end, _ = self.value
        return not (value < least or (value == least and not allowed) or value >= end)

    @property
    def words(self) -> str:
        """The rule, behind "must"."""
        return self.value[3]


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect.

    ``step`` is a change that alters the prediction little (used for difference quotients); the fit keeps to
    [``least``, ``most``], and ``why`` gives the reason for these bounds. ``role`` tells a size from a time or
    a place at which the effect acts. A ``start`` is a value that the scan of a user's effect holds while it
    solves for the parameters without one, in which the effect is linear; a fit then frees it. A value for
    ``absent`` says that the parameter need not be: a file may leave it out, and it makes no effect alone.
    ``most_times`` (other, k) keeps a fit to k times another parameter. ``models`` are the base models that
    have it.
    """

    unit: str
    step: float
    least: float = -INFINITE
    most: float = INFINITE
    why: str = "either sign occurs; no size is impossible"
    role: Role = "size"
    domain: Domain = Domain.ANY
    start: float | None = None
    absent: float | None = None
    most_times: tuple[str, float] | None = None
    models: tuple[BaseModel, ...] = BOTH

    def __post_init__(self) -> None:
        if not (self.step > 0 and self.least < self.most):
            raise ValueError(f"a parameter needs a step above 0 and ordered bounds, not {self}")


@dataclass(frozen=True)
class Search:
    """How a scan looks for an effect.

    Without a ``grid`` the effect is scanned by its slope at size 0. With one it is tried at each value, in
    units of ``grid_unit``. ``starts`` are further values at which a fit may begin. ``clipped`` says that a
    size beyond the bounds, extrapolated from the slope, is moved to the bound and not refused.
    """

    grid: tuple[float, ...] = ()
    grid_unit: GridUnit = ""
    starts: tuple[float, ...] = ()
    clipped: bool = False


@dataclass(frozen=True)
class Range:
    """A hidden parameter is uniform between ``low`` and ``high``, with either sign where ``signed``.

    ``scale`` gives the unit of the drawn number: an acceleration in m/s², from which the torque at a wheel
    follows by 2α (``both_wheels``) or 2α_yaw (``turning``); an acceleration at 1 m/s (``wheel_speed``); a
    share of the log's duration. With ``after`` the number is a length that begins at that parameter.
    """

    low: float
    high: float
    signed: bool = False
    scale: Scale = ""
    after: str = ""


@dataclass(frozen=True)
class Exact:
    """Effects that give the same poses whatever is driven, while the model also has those of ``beside``.

    ``same_as`` holds names of effects, and of quantities that no effect of the catalogue describes;
    ``driven_by`` holds the inputs with which they are the same.
    """

    same_as: tuple[str, ...]
    beside: tuple[str, ...] = ()
    driven_by: tuple[DrivenBy, ...] = EVERY_INPUT


@dataclass(frozen=True)
class Separable:
    """Effects that a log may not tell apart, and the manoeuvre that separates them; a user's effect may name
    one in words of its own.
    """

    others: tuple[str, ...]
    by: Manoeuvre | str


@dataclass(frozen=True)
class EffectDeclaration:
    """Everything that is declared of one effect; see the fields' comments.

    Raises ValueError where parts of the declaration do not fit together.
    """

    name: str
    channel: Channel
    formula: str
    parameters: Mapping[str, Parameter]
    acts_on: ActsOn
    number: int = -1
    """Place in tables and number of the random stream of ``--hide``; given once, never used again."""
    models: tuple[BaseModel, ...] = ("torque",)
    extent: Extent = "always"
    """``time``: acts in a stretch of this log's time; ``space``: acts in a region of the world."""
    followed: bool = False
    """A replay leaves the effect to the identifier, which sees a change of α, slipping or skidding."""
    taken_for: ContactMode | None = None
    """The contact mode that an identifier may call the effect."""
    search: Search = Search()
    ranges: Mapping[str, Range] = field(default_factory=dict)
    """Sizes that ``--hide`` draws; a parameter without a range is a place, which the path decides."""
    vector: tuple[str, str] | None = None
    """Two parameters drawn as a magnitude (the first one's range) and a uniform direction."""
    exact: tuple[Exact, ...] = ()
    separable: tuple[Separable, ...] = ()
    other_forms: tuple[str, ...] = ()
    """Other forms of one physical cause: a real cause lies between them."""
    relevant: float | None = None
    """A size of the first parameter that matters in practice: a log that would not show it cannot say that
    nothing is missing.
    """
    held_only: bool = False
    """A calibrated base model may hold the effect, and no analysis names it: on each drive it is another rest
    of what the robot always has.
    """
    zero_is_absent: bool = True
    """Whether the effect is absent where its size is 0, so that the size can be tested against 0."""
    needs_excitation: bool = True
    """Whether the torques must vary for the effect to be seen."""
    needs_commands: bool = False
    """Whether the wheel-speed base has the effect only where commands drive the model."""
    wheel_speed_formula: str = ""
    """The formula on the wheel-speed base, where it is another one."""

    def __post_init__(self) -> None:
        unknown = [key for key in (*self.ranges, *(self.vector or ())) if key not in self.parameters]
        if unknown:
            raise ValueError(f"{self.name} draws {', '.join(unknown)}, which it does not have")
        if not self.name or not self.parameters or not self.models:
            raise ValueError(f"{self.name!r} needs a name, a parameter and a base model")

    def formula_of(self, base: BaseModel) -> str:
        """The formula on a base model."""
        return (
            self.wheel_speed_formula if base == "wheel_speed" and self.wheel_speed_formula else self.formula
        )

    @property
    def units(self) -> dict[str, str]:
        """Unit of each parameter."""
        return {key: parameter.unit for key, parameter in self.parameters.items()}

    @property
    def absent(self) -> dict[str, float]:
        """The parameters that need not be, with their values where they are not."""
        return {key: p.absent for key, p in self.parameters.items() if p.absent is not None}

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Bounds of each parameter in a fit."""
        return {key: (p.least, p.most) for key, p in self.parameters.items()}

    @property
    def most_times(self) -> dict[str, tuple[str, float]]:
        """The parameters that a fit keeps to so many times another one."""
        return {key: p.most_times for key, p in self.parameters.items() if p.most_times is not None}

    @property
    def steps(self) -> dict[str, float]:
        """Step of each parameter in a difference quotient."""
        return {key: parameter.step for key, parameter in self.parameters.items()}

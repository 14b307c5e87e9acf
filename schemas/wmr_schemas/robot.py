"""Nominal parameters of a robot: the model that a user believes in.

A missing value means "unknown": it is estimated, or the quantities that need it are left out, with a note.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Literal

from wmr_schemas.errors import InvalidFile

AUTO: Literal["auto"] = "auto"
ASSUMED_RADIUS_M = 0.15
"""Where no wheel radius is stated, the scale of wheel speeds is learnt relative to it: wheels between 3.5 and
60 cm lie within a factor of 4.
"""
AverageSpeed = float | Literal["auto"] | None


def described(unit: str, meaning: str) -> dict[str, str]:
    """A field's metadata: its unit and meaning, from which the documentation's tables are made."""
    return {"unit": unit, "meaning": meaning}


@dataclass(frozen=True)
class RobotParameters:
    """The keys of the ``wmr_replay`` metadata record and of ``[robot]`` in model and mapping files.

    All are finite and positive, or None where unknown; the fields' metadata say what each means. Raises
    InvalidFile naming the key at fault.
    """

    alpha: float | None = field(
        default=None,
        metadata=described(
            "(m/s²)/(N·m)", "dv_long/dt = alpha·(effort_left + effort_right) in ideal rolling"
        ),
    )
    alpha_yaw: float | None = field(
        default=None,
        metadata=described(
            "(m/s²)/(N·m)",
            "half_track_m·d(yaw_rate)/dt = alpha_yaw·(effort_right − effort_left); as `alpha` when absent",
        ),
    )
    half_track_m: float | None = field(
        default=None, metadata=described("m", "l, half the distance between the two driven wheels")
    )
    wheel_radius_m: float | None = field(default=None, metadata=described("m", "r, of the driven wheels"))
    mass_kg: float | None = field(default=None, metadata=described("kg", "m, of the whole robot"))
    wheel_inertia_kgm2: float | None = field(
        default=None,
        metadata=described("kg·m²", "I_φ, of one driven wheel with its drive, about the wheel's axis"),
    )
    yaw_inertia_kgm2: float | None = field(
        default=None, metadata=described("kg·m²", "I_θ, of the robot about the vertical")
    )
    cornering_stiffness_over_epsilon: float | None = field(
        default=None, metadata=described("–", "G_x/ε: how fast lateral velocity dies out while skidding")
    )
    longitudinal_stiffness_over_epsilon: float | None = field(
        default=None, metadata=described("–", "G_y/ε: how fast slip velocity dies out")
    )
    average_speed_mps: AverageSpeed = field(
        default=None,
        metadata=described(
            "m/s",
            'v in the stiffness terms: a number, or "auto" for the paper\'s assumption 4, '
            "√(ẋ² + ẏ² + l²θ̇²) with a floor of 0.3",
        ),
    )

    def __post_init__(self) -> None:
        for name, value in self.known().items():
            check_value("robot", name, value)

    def known(self) -> dict[str, float | str]:
        """The parameters that are known, in their documented order."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if value is not None}

    def overridden_by(self, given: "RobotParameters | None") -> "RobotParameters":
        """These parameters, with the known ones of ``given`` in their place."""
        return self if given is None else RobotParameters(**(self.known() | given.known()))  # type: ignore[arg-type]

    @property
    def alpha_yaw_or_alpha(self) -> float | None:
        """``alpha_yaw``, or ``alpha`` where that is all that is known."""
        return self.alpha if self.alpha_yaw is None else self.alpha_yaw

    @property
    def skid_decay_mps2(self) -> float | None:
        """2 G_x/(ε m), which over the speed is the decay rate of v_lat while skidding; None where unknown."""
        if self.cornering_stiffness_over_epsilon is None or self.mass_kg is None:
            return None
        return 2 * self.cornering_stiffness_over_epsilon / self.mass_kg

    @property
    def slip_shares(self) -> tuple[float, float] | None:
        """Traction left by quasi-steady slipping, ahead and in yaw; None where a parameter is unknown.

        (3/m)/(r²/I_φ + 2/m) and (3l²/I_θ)/(r²/I_φ + 2l²/I_θ), by the paper's (1) once σ has settled, which
        takes milliseconds; the slip stiffness cancels.
        """
        m, inertia, yaw = self.mass_kg, self.wheel_inertia_kgm2, self.yaw_inertia_kgm2
        radius, half_track = self.wheel_radius_m, self.half_track_m
        if m is None or inertia is None or yaw is None or radius is None or half_track is None:
            return None
        wheel, turn = radius**2 / inertia, half_track**2 / yaw
        return 3 / m / (wheel + 2 / m), 3 * turn / (wheel + 2 * turn)

    def to_metadata(self) -> dict[str, str]:
        """As the metadata record holds them: strings, numbers in their shortest exact form."""
        return {
            name: value if isinstance(value, str) else repr(float(value))
            for name, value in self.known().items()
        }

    @classmethod
    def from_metadata(
        cls, record: Mapping[str, str], source: str = "metadata record wmr_replay"
    ) -> "RobotParameters":
        """From strings; unknown keys are left alone (other tools may write theirs beside ours)."""
        parsed: dict[str, object] = {}
        for name in (f.name for f in fields(cls)):
            text = record.get(name)
            if text is not None:
                parsed[name] = text if text == AUTO else parse_number(source, name, text)
        for name, value in parsed.items():
            check_value(source, name, value)
        return cls(**parsed)  # type: ignore[arg-type]

    @classmethod
    def from_values(
        cls, table: Mapping[str, object], source: str, place: str = "[robot] "
    ) -> "RobotParameters":
        """From a table of numbers (``[robot]`` of a file), each within :data:`SENSIBLE`.

        Raises InvalidFile naming the key at fault.
        """
        names = [f.name for f in fields(cls)]
        for key, value in table.items():
            if key not in names:
                raise InvalidFile(source, f"{place}{key}", f"unknown key; known are {', '.join(names)}")
            check_value(source, f"{place}{key}", value)
            if problem := out_of_sense(key, value):
                raise InvalidFile(source, f"{place}{key}", problem)
        return cls(**{key: value if isinstance(value, str) else float(value) for key, value in table.items()})  # type: ignore[arg-type]


SENSIBLE: dict[str, tuple[float, float]] = {
    "alpha": (1e-7, 1e6),
    "alpha_yaw": (1e-7, 1e6),
    "half_track_m": (1e-3, 20.0),
    "wheel_radius_m": (1e-3, 5.0),
    "mass_kg": (1e-3, 1e6),
    "wheel_inertia_kgm2": (1e-12, 1e6),
    "yaw_inertia_kgm2": (1e-12, 1e9),
    "cornering_stiffness_over_epsilon": (1e-6, 1e12),
    "longitudinal_stiffness_over_epsilon": (1e-6, 1e12),
    "average_speed_mps": (1e-3, 100.0),
}
"""What a parameter in its unit lies between, from a robot of a gram to a dump truck of 600 t; beyond, it is
in another unit, or no measurement.
"""


def out_of_sense(key: str, value: object) -> str:
    """Why a number makes no sense as that parameter; empty where it does, and for ``auto``."""
    low, high = SENSIBLE[key]
    if isinstance(value, str) or low <= value <= high:  # type: ignore[operator]
        return ""
    return f"{value:g} makes no sense; expected {low:g} to {high:g} {unit_of(key)}".rstrip(" –")


def unit_of(key: str) -> str:
    """The unit of a parameter."""
    return next(str(f.metadata["unit"]) for f in fields(RobotParameters) if f.name == key)


def parse_number(source: str, key: str, text: str) -> float:
    """A number out of a metadata string."""
    try:
        return float(text)
    except ValueError:
        raise InvalidFile(source, key, f"{text!r} is not a number") from None


def check_value(source: str, key: str, value: object) -> None:
    """Every parameter is a finite positive number; the average speed may be ``auto``."""
    may_be_auto = key.endswith("average_speed_mps")
    if value == AUTO and may_be_auto:
        return
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or value <= 0:  # type: ignore[arg-type,operator]
        expected = "a number above 0" + (' or "auto"' if may_be_auto else "")
        raise InvalidFile(source, key, f"expected {expected}, found {value!r}")


PAPER_ROBOT = RobotParameters(
    alpha=0.35**2 / (3 * 1.6),
    half_track_m=1.0,
    wheel_radius_m=0.35,
    mass_kg=1000.0,
    wheel_inertia_kgm2=1.6,
    yaw_inertia_kgm2=500.0,
    cornering_stiffness_over_epsilon=0.4 / 1e-4,
    longitudinal_stiffness_over_epsilon=1.0 / 1e-4,
    average_speed_mps=AUTO,
)
"""The published parameter set (§5). Its mass breaks m = I_φ/r²: slipping leaves 3.8 % of the traction."""

"""Terms of a dictionary, and how an effect that only such a term describes is named.

    name    = "unnamed:" channel ":" term
    channel = "longitudinal" | "lateral" | "yaw"
    term    = factor { "*" factor }                  up to 6 factors, blanks allowed about "*"
    factor  = one of FACTORS, or one with numbers of its own (placed_factors, shape_factors)

A term is a product of named quantities and nothing else: it is looked up, never evaluated as code. Its one
parameter is ``coefficient``, and coefficient · term is added to

    longitudinal   dv_long/dt                                                  m/s²
    lateral        dv_lat/dt + v_long·yaw_rate, while the robot skids          m/s²
    yaw            half_track_m · d(yaw_rate)/dt                               m/s²

For example ``unnamed:longitudinal:v*abs(yaw_rate)``. Quantities are in SI units and robot conventions; ``v``
is the longitudinal speed, efforts are ``right + left`` and ``right − left`` in N·m.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.errors import InvalidTerm
from wmr_schemas.placed_factors import FORMS, PlacedFactor, placed_factor
from wmr_schemas.shape_factors import SHAPE_FORMS, is_odd, is_one_sided, shape_factor
from wmr_schemas.slip_terms import unit_of

TermChannel = Literal["longitudinal", "lateral", "yaw"]
CHANNELS: tuple[TermChannel, ...] = get_args(TermChannel)
COEFFICIENT = "coefficient"
MOST_FACTORS = 6
SOFT_SIGN = 0.02
"""sgn(z) is taken as tanh(z/0.02), z in m/s or rad/s: friction changes its sign over this speed."""

COLUMNS = ("v", "v_lat", "yaw", "yaw_rate", "effort_sum", "effort_diff")
"""The columns out of which every factor is made."""
FACTORS: dict[str, tuple[str, Callable[[F64], F64]]] = {
    "1": ("v", np.ones_like),
    "v": ("v", np.positive),
    "abs(v)": ("v", np.abs),
    "sgn(v)": ("v", lambda v: np.tanh(v / SOFT_SIGN)),
    "v_lat": ("v_lat", np.positive),
    "abs(v_lat)": ("v_lat", np.abs),
    "yaw_rate": ("yaw_rate", np.positive),
    "abs(yaw_rate)": ("yaw_rate", np.abs),
    "sgn(yaw_rate)": ("yaw_rate", lambda w: np.tanh(w / SOFT_SIGN)),
    "cos(yaw)": ("yaw", np.cos),
    "sin(yaw)": ("yaw", np.sin),
    "effort_sum": ("effort_sum", np.positive),
    "abs(effort_sum)": ("effort_sum", np.abs),
    "effort_diff": ("effort_diff", np.positive),
    "abs(effort_diff)": ("effort_diff", np.abs),
}
"""Each factor by its name: the column that it reads, and the function of it."""
UNITS: dict[str, tuple[int, int, int]] = {
    "v": (1, -1, 0),
    "v_lat": (1, -1, 0),
    "yaw_rate": (0, -1, 0),
    "effort_sum": (0, 0, 1),
    "effort_diff": (0, 0, 1),
}
"""Powers of metre, second and newton metre of a column; a factor without a unit is not here."""
WITHOUT_UNIT = ("1", "sgn(v)", "sgn(yaw_rate)", "cos(yaw)", "sin(yaw)")
EVEN = ("abs(v)", "abs(v_lat)", "abs(yaw_rate)", "abs(effort_sum)", "abs(effort_diff)", "1")
PLACES = ("t", "x", "y", "s")
"""Columns that are time or place."""
SIGNED = ("v", "v_lat", "yaw_rate", "effort_sum", "effort_diff")
"""Columns in which a term is odd or even; in the others it has no parity."""


@dataclass(frozen=True)
class Term:
    """A product of factors that acts on a channel."""

    channel: TermChannel
    factors: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.channel not in CHANNELS:
            raise InvalidTerm(self.name, f"no channel {self.channel!r}; known are {', '.join(CHANNELS)}")
        if not 1 <= len(self.factors) <= MOST_FACTORS:
            raise InvalidTerm(self.name, f"has {len(self.factors)} factors; 1 to {MOST_FACTORS} are allowed")
        unknown = [f for f in self.factors if f not in FACTORS and other_factor(f) is None]
        if unknown:
            known = f"{', '.join(FACTORS)}, and {FORMS}, {SHAPE_FORMS}"
            raise InvalidTerm(self.name, f"no factor {unknown[0]!r}; known are {known}")

    @property
    def name(self) -> str:
        """The effect's name; :func:`parse_term` gives the term back."""
        return f"{UNNAMED_PREFIX}{self.channel}:{'*'.join(self.factors)}"

    @property
    def formula(self) -> str:
        """The term with its coefficient, in words."""
        return "·".join((COEFFICIENT, *self.factors))

    @property
    def is_placed(self) -> bool:
        """Whether it reads time or place."""
        return any(column in PLACES for column in self.columns)

    @property
    def is_listed(self) -> bool:
        """Whether all of its factors are of :data:`FACTORS`, so that :attr:`powers` are the term."""
        return all(factor in FACTORS for factor in self.factors)

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that it reads, each once."""
        return tuple(dict.fromkeys(column for factor in self.factors for column in columns_of(factor)))

    @property
    def unit(self) -> str:
        """Unit of the coefficient, so that the product is an acceleration in m/s²."""
        metres, seconds, torque = np.array([1, -2, 0]) - np.sum([powers_of(f) for f in self.factors], axis=0)
        return unit_of({"m": int(metres), "s": int(seconds), "N·m": int(torque)})

    @property
    def parity(self) -> dict[str, str]:
        """Odd, even or mixed in each of the signed columns that it reads."""
        odd = {c: 0 for c in self.columns if c in SIGNED}
        for factor in self.factors:
            listed = factor in FACTORS and factor not in EVEN
            if listed or is_odd(factor):
                for column in odd.keys() & columns_of(factor):
                    odd[column] += 1
        mixed = {column for factor in self.factors if is_one_sided(factor) for column in columns_of(factor)}
        return {c: "mixed" if c in mixed else "odd" if times % 2 else "even" for c, times in odd.items()}

    @property
    def powers(self) -> tuple[int, ...]:
        """How often each of :data:`FACTORS` occurs, in their order; others count nowhere."""
        return tuple(self.factors.count(factor) for factor in FACTORS)

    def evaluate(self, columns: Mapping[str, F64]) -> F64:
        """The product at each row, (n,), of ``columns`` by the names in :data:`COLUMNS` and ``t``, ``x``,
        ``y``, ``s``; those not needed may be missing.
        """
        return np.asarray(np.prod([evaluate_factor(factor, columns) for factor in self.factors], axis=0))


def evaluate_factor(factor: str, columns: Mapping[str, F64]) -> F64:
    """One factor at each row, (n,)."""
    if factor in FACTORS:
        column, of = FACTORS[factor]
        return of(columns[column])
    other = other_factor(factor)
    assert other is not None
    return other.of(columns)


def other_factor(text: str) -> PlacedFactor | None:
    """A factor that is none of :data:`FACTORS`; None where there is no such one."""
    return placed_factor(text) or shape_factor(text)


def columns_of(factor: str) -> tuple[str, ...]:
    """The columns that a factor reads; 1 reads none."""
    if factor in FACTORS:
        return () if factor == "1" else (FACTORS[factor][0],)
    other = other_factor(factor)
    return other.columns if other else ()


def powers_of(factor: str) -> tuple[int, int, int]:
    """Powers of metre, second and newton metre in a factor's unit."""
    if factor in FACTORS:
        return (0, 0, 0) if factor in WITHOUT_UNIT else UNITS[FACTORS[factor][0]]
    other = other_factor(factor)
    return (*other.unit, 0) if other else (0, 0, 0)


def parse_term(name: str) -> Term:
    """The term of an effect's name. Raises InvalidTerm naming the part at fault."""
    channel, colon, product = name.removeprefix(UNNAMED_PREFIX).partition(":")
    if not name.startswith(UNNAMED_PREFIX) or not colon:
        raise InvalidTerm(name, f"expected {UNNAMED_PREFIX}<channel>:<factor>*<factor>…")
    return Term(channel, tuple(factor.strip() for factor in product.split("*")))  # type: ignore[arg-type]

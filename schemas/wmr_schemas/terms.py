"""Terms of a dictionary, and how an effect that only such a term describes is named.

    name    = "unnamed:" channel ":" term
    channel = "longitudinal" | "lateral" | "yaw"
    term    = factor { "*" factor }                  up to 6 factors, blanks allowed about "*"
    factor  = one of FACTORS

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
        unknown = [factor for factor in self.factors if factor not in FACTORS]
        if unknown:
            raise InvalidTerm(self.name, f"no factor {unknown[0]!r}; known are {', '.join(FACTORS)}")

    @property
    def name(self) -> str:
        """The effect's name; :func:`parse_term` gives the term back."""
        return f"{UNNAMED_PREFIX}{self.channel}:{'*'.join(self.factors)}"

    @property
    def formula(self) -> str:
        """The term with its coefficient, in words."""
        return "·".join((COEFFICIENT, *self.factors))

    @property
    def powers(self) -> tuple[int, ...]:
        """How often each of :data:`FACTORS` occurs, in their order."""
        return tuple(self.factors.count(factor) for factor in FACTORS)

    def evaluate(self, columns: Mapping[str, F64]) -> F64:
        """The product at each row, (n,), of ``columns`` by the names in :data:`COLUMNS`; those not needed may
        be missing.
        """
        values = (FACTORS[factor] for factor in self.factors)
        return np.asarray(np.prod([of(columns[column]) for column, of in values], axis=0))


def parse_term(name: str) -> Term:
    """The term of an effect's name. Raises InvalidTerm naming the part at fault."""
    channel, colon, product = name.removeprefix(UNNAMED_PREFIX).partition(":")
    if not name.startswith(UNNAMED_PREFIX) or not colon:
        raise InvalidTerm(name, f"expected {UNNAMED_PREFIX}<channel>:<factor>*<factor>…")
    return Term(channel, tuple(factor.strip() for factor in product.split("*")))  # type: ignore[arg-type]

"""Terms of the wheel-speed base's dictionary: products of named speeds that are added to a velocity.

    name    = "unnamed:" channel ":" term
    channel = "v_long" | "v_lat" | "yaw_rate"
    term    = factor { "*" factor }                  up to 6 factors

coefficient · term is added to the velocity that the channel names: v_long or v_lat in m/s, yaw_rate in rad/s.
``v`` and ``yaw_rate`` as factors are those that follow from the wheel speeds, ``a`` is dv/dt, ``yaw`` the
measured heading, ``t`` the time from the log's start. For example ``unnamed:v_long:v*abs(v)``, a wheel whose
scale droops with speed. Terms of the torque base act on accelerations: :mod:`wmr_schemas.terms`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.errors import InvalidTerm

SLIP_CHANNELS = {"v_long": (1, -1), "v_lat": (1, -1), "yaw_rate": (0, -1)}
"""Each channel with the powers of metre and second of its unit; a radian is 1."""
MOST_FACTORS = 6
Powers = tuple[int, int]
SLIP_FACTORS: dict[str, tuple[str, Callable[[F64], F64], Powers]] = {
    "v": ("v", np.positive, (1, -1)),
    "abs(v)": ("v", np.abs, (1, -1)),
    "a": ("a", np.positive, (1, -2)),
    "abs(a)": ("a", np.abs, (1, -2)),
    "yaw_rate": ("yaw_rate", np.positive, (0, -1)),
    "abs(yaw_rate)": ("yaw_rate", np.abs, (0, -1)),
    "cos(yaw)": ("yaw", np.cos, (0, 0)),
    "sin(yaw)": ("yaw", np.sin, (0, 0)),
    "t": ("t", np.positive, (0, 1)),
}
"""Each factor by its name: the column that it reads, the function of it, the powers of metre and second."""
SUPERSCRIPT = str.maketrans("23456789", "²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class SlipTerm:
    """A product of factors that is added to the velocity of a channel."""

    channel: str
    factors: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.channel not in SLIP_CHANNELS:
            known = ", ".join(SLIP_CHANNELS)
            raise InvalidTerm(self.name, f"no channel {self.channel!r}; on wheel speeds these are {known}")
        if not 1 <= len(self.factors) <= MOST_FACTORS:
            raise InvalidTerm(self.name, f"has {len(self.factors)} factors; 1 to {MOST_FACTORS} are allowed")
        unknown = [factor for factor in self.factors if factor not in SLIP_FACTORS]
        if unknown:
            raise InvalidTerm(self.name, f"no factor {unknown[0]!r}; known are {', '.join(SLIP_FACTORS)}")

    @property
    def name(self) -> str:
        """The effect's name; :func:`parse_slip_term` gives the term back."""
        return f"{UNNAMED_PREFIX}{self.channel}:{'*'.join(self.factors)}"

    @property
    def formula(self) -> str:
        """What it adds, in words."""
        return f"{self.channel} += " + "·".join(("coefficient", *self.factors))

    @property
    def unit(self) -> str:
        """Unit of the coefficient."""
        own = np.array(SLIP_CHANNELS[self.channel])
        metres, seconds = own - np.sum([SLIP_FACTORS[f][2] for f in self.factors], axis=0)
        return unit_of({"m": int(metres), "s": int(seconds)})

    def evaluate(self, columns: Mapping[str, F64]) -> F64:
        """The product at each row (n,) of columns ``v``, ``a``, ``yaw_rate``, ``yaw``, ``t``."""
        values = (SLIP_FACTORS[factor] for factor in self.factors)
        return np.asarray(np.prod([of(columns[column]) for column, of, _ in values], axis=0))


def unit_of(powers: Mapping[str, int]) -> str:
    """A unit by its powers, such as ``s²/m``; ``1`` without any."""
    above = [f"{unit}{power if power > 1 else ''}" for unit, power in powers.items() if power > 0]
    below = [f"{unit}{-power if power < -1 else ''}" for unit, power in powers.items() if power < 0]
    under = "·".join(below) if len(below) < 2 else f"({'·'.join(below)})"
    text = "·".join(above) or "1"
    return (f"{text}/{under}" if below else text).translate(SUPERSCRIPT)


def is_slip_term(name: str) -> bool:
    """Whether an effect's name is that of a term of this dictionary."""
    return name.startswith(UNNAMED_PREFIX) and name.split(":")[1] in SLIP_CHANNELS


def parse_slip_term(name: str) -> SlipTerm:
    """The term of an effect's name. Raises InvalidTerm naming the part at fault."""
    channel, colon, product = name.removeprefix(UNNAMED_PREFIX).partition(":")
    if not name.startswith(UNNAMED_PREFIX) or not colon:
        raise InvalidTerm(name, f"expected {UNNAMED_PREFIX}<channel>:<factor>*<factor>…")
    return SlipTerm(channel, tuple(factor.strip() for factor in product.split("*")))

"""Factors of a term that shape it by one quantity, or by time, with numbers of their own.

    fall(z,K)     1/(1 + |z|/K)               falls to a half at |z| = K: z·fall(z,K) saturates
    over(z,K)     max(1 − K/|z|, 0)           0 up to K: z·over(z,K) is what z exceeds K by
    bell(z,K)     exp(−z²/2K²)                acts where z is small
    ring(z,C,W)   exp(−(|z| − C)²/2W²)        acts where |z| is about C
    rise(z,K)     tanh(|z|/K)                 acts where z is not small
    soft(z,K)     tanh(z/K)                   changes its sign over K: a friction of a soft contact
    beyond(z,C,W) ½(1 + tanh((|z| − C)/W))    sets in at |z| = C
    above(z,C,W)  ½(1 + tanh((z − C)/W))      acts on one side of C alone
    gust(T,W)     exp(−(t − T)²/2W²)          acts about the time T, for some W seconds
    pulse(T,W)    1/(1 + ((t − T)/W)⁸)        acts from T − W to T + W, with short edges
    after(T)      1 from t = T on, 0 before
    decay(T)      exp(−t/T)
    saw(T,P)      rises evenly from 0 at the time T to 1, P seconds later, and drops, again and again

z is v, yaw_rate, effort_sum, effort_diff, or one of the products

    a_lat         v·yaw_rate, the lateral acceleration in a curve, m/s²
    power         v·effort_sum, what the wheels give ahead, N·m·m/s

and its shapes are even in it, but for soft, which is odd, and above, which is neither; fall takes t, too.
Numbers are in the unit of z, or in seconds; the factors have none.
"""

import re
from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.placed_factors import NUMBER, PlacedFactor

SHAPED = ("v", "yaw_rate", "effort_sum", "effort_diff")
"""The quantities that a factor may shape a term by."""
PRODUCTS = {"a_lat": ("v", "yaw_rate"), "power": ("v", "effort_sum")}
"""Products of two of them that it may be shaped by as well."""
DROP = 0.05
"""Share of a saw's period in which it drops."""
SHAPE = re.compile(rf"(fall|over|bell|ring|rise|soft|beyond|above)\((\w+),{NUMBER}(?:,{NUMBER})?\)")
TIMED = re.compile(rf"(gust|pulse|after|decay|saw)\({NUMBER}(?:,{NUMBER})?\)")
SHAPE_FORMS = (
    "fall(z,K), over(z,K), bell(z,K), ring(z,C,W), rise(z,K), soft(z,K), beyond(z,C,W), above(z,C,W), "
    "gust(T,W), pulse(T,W), after(T), decay(T), saw(T,P)"
)
LEAST = 1e-12


def quantity(columns: Mapping[str, F64], name: str) -> F64:
    """A quantity that shapes, one of the columns or a product of two of them."""
    product = [columns[column] for column in PRODUCTS.get(name, (name,))]
    return np.asarray(np.prod(product, axis=0)) if len(product) > 1 else product[0]


def fall(z: F64, k: float) -> F64:
    """A half at |z| = K."""
    return np.asarray(1 / (1 + np.abs(z) / k))


def over(z: F64, k: float) -> F64:
    """The share of z beyond K."""
    return np.maximum(1 - k / np.maximum(np.abs(z), LEAST), 0.0)


def bell(z: F64, k: float) -> F64:
    """A bell about 0."""
    return np.asarray(np.exp(-((z / k) ** 2) / 2))


def ring(z: F64, c: float, w: float) -> F64:
    """A bell about |z| = C."""
    return np.asarray(np.exp(-(((np.abs(z) - c) / w) ** 2) / 2))


def rise(z: F64, k: float) -> F64:
    """From 0 at 0 to 1, over K."""
    return np.tanh(np.abs(z) / k)


def soft(z: F64, k: float) -> F64:
    """The sign, which changes over K."""
    return np.tanh(z / k)


def beyond(z: F64, c: float, w: float) -> F64:
    """From 0 to 1 as |z| exceeds C, over W."""
    return above(np.abs(z), c, w)


def above(z: F64, c: float, w: float) -> F64:
    """From 0 to 1 as z exceeds C, over W."""
    return np.asarray((1 + np.tanh((z - c) / w)) / 2)


def gust(t: F64, middle: float, w: float) -> F64:
    """A bell about a time."""
    return np.asarray(np.exp(-(((t - middle) / w) ** 2) / 2))


def pulse(t: F64, middle: float, w: float) -> F64:
    """What comes at a time and goes at another."""
    return np.asarray(1 / (1 + ((t - middle) / w) ** 8))


def after(t: F64, begins: float) -> F64:
    """A step up at a time."""
    return np.asarray(t >= begins, dtype=np.float64)


def decay(t: F64, time: float) -> F64:
    """What dies away from the start on."""
    return np.asarray(np.exp(-t / time))


def saw(t: F64, begins: float, period: float) -> F64:
    """What rises evenly and drops at even intervals."""
    phase = np.mod((t - begins) / period, 1.0)
    return np.minimum(phase / (1 - DROP), (1 - phase) / DROP)


OF_SHAPE: dict[str, tuple[Callable[..., F64], int]] = {
    "fall": (fall, 1),
    "over": (over, 1),
    "bell": (bell, 1),
    "ring": (ring, 2),
    "rise": (rise, 1),
    "soft": (soft, 1),
    "beyond": (beyond, 2),
    "above": (above, 2),
    "gust": (gust, 2),
    "pulse": (pulse, 2),
    "after": (after, 1),
    "decay": (decay, 1),
    "saw": (saw, 2),
}
"""Each shape's function, and how many numbers it has; all but a middle and a beginning are above 0."""
FREE = ("gust", "pulse", "after", "saw", "above")
"""Shapes whose first number may be 0 or below: a time, or a side."""


TIMES = ("gust", "pulse", "after", "decay", "saw")
"""Shapes of the time alone."""


def is_odd(text: str) -> bool:
    """Whether a shape is odd in what it shapes a term by."""
    return text.startswith("soft(")


def is_one_sided(text: str) -> bool:
    """Whether a shape is neither odd nor even in what it shapes a term by."""
    return text.startswith("above(")


@lru_cache(maxsize=4096)
def shape_factor(text: str) -> PlacedFactor | None:
    """The factor of that text; None where it is none of these."""
    if found := SHAPE.fullmatch(text):
        kind, column, numbers = found[1], found[2], found.groups()[2:]
        if column not in (*SHAPED, *PRODUCTS) and (kind, column) != ("fall", "t"):
            return None
    elif found := TIMED.fullmatch(text):
        kind, column, numbers = found[1], "t", found.groups()[1:]
    else:
        return None
    function, n = OF_SHAPE[kind]
    values = [float(number) for number in numbers if number is not None]
    if len(values) != n or min(values[kind in FREE :], default=1.0) <= 0:
        return None
    return PlacedFactor(PRODUCTS.get(column, (column,)), lambda c: function(quantity(c, column), *values))


def shape_text(kind: str, along: str, *numbers: float) -> str:
    """The text of a shape over ``along``, its numbers to four digits."""
    timed = () if kind in TIMES else (along,)
    return f"{kind}({','.join([*timed, *map(digits, numbers)])})"


def digits(value: float) -> str:
    """A number of four digits, without an exponent's plus."""
    return f"{float(f'{value:.4g}'):.10g}".replace("e+", "e")

"""Encoder noise that is not white: what a log's wheel speeds become with it.

``ripple`` is for developing, ``eccentric`` only for reporting. Both are bounded errors of the wheels' angles,
as encoders have them, so that the mean speed stays the true one.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import Log

Colour = Callable[[F64, F64, np.random.Generator], F64]
"""Stamps in s and the angle of a wheel in rad to the angle that is read, (n,) each."""
RIPPLE_RAD, RIPPLE_S = 0.003, 0.3
ECCENTRIC_RAD, JITTER_S = (0.004, 0.015), 4e-4


def ripple(t_s: F64, angle_rad: F64, rng: np.random.Generator) -> F64:
    """The play of a gear: a slow wandering of some milliradians while the wheel turns."""
    n = len(t_s)
    keep = np.exp(-np.diff(t_s, prepend=t_s[0]) / RIPPLE_S)
    fresh, play = rng.normal(size=n), np.zeros(n)
    for k in range(1, n):
        turns = abs(angle_rad[k] - angle_rad[k - 1]) > 0.0
        play[k] = keep[k] * play[k - 1] + np.sqrt(1 - keep[k] ** 2) * fresh[k] if turns else play[k - 1]
    return angle_rad + RIPPLE_RAD * play


def eccentric(t_s: F64, angle_rad: F64, rng: np.random.Generator) -> F64:
    """A disc off its centre, e sin(φ − φ₀), read .4 ms early or late (root mean square)."""
    size, phase = rng.uniform(*ECCENTRIC_RAD), rng.uniform(0.0, 2 * np.pi)
    seen = angle_rad + size * np.sin(angle_rad - phase)
    return seen + np.gradient(seen, t_s) * JITTER_S * rng.normal(size=len(t_s))


COLOURS: dict[str, Colour] = {"ripple": ripple, "eccentric": eccentric}


def coloured(log: Log, colour: str, seed: int) -> Log:
    """The log with its wheel speeds as encoders with this noise say them."""
    wheels = log.wheels
    assert wheels is not None
    rng, t_s = np.random.default_rng([seed, 7]), (wheels.t_ns - wheels.t_ns[0]) / NS_PER_S
    steps = np.diff(t_s, prepend=2 * t_s[0] - t_s[1])
    read = {}
    for side in ("left_radps", "right_radps"):
        angle = np.cumsum(getattr(wheels, side) * steps)
        seen = COLOURS[colour](t_s, angle, rng)
        read[side] = np.diff(seen, prepend=seen[0]) / steps
    return replace(log, wheels=replace(wheels, **read))

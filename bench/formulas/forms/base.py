"""What every set of forms is made of: the motion, a form, and what several sets share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64

Sizes = Mapping[str, float]
Rng = np.random.Generator
WAVE = {"size": (0.15, 0.4), "length": (3.0, 10.0), "phase": (0.0, 6.28)}
"""Sizes of a wave over the ground: m/s², m, rad."""


class At(NamedTuple):
    """The motion at which a form is taken, numbers or (n,): time, pose, speeds, half track · yaw rate, and
    the accelerations that the torques ask for, α·(right + left) and α_yaw·(right − left).
    """

    t: F64
    x: F64
    y: F64
    yaw: F64
    v: F64
    yaw_rate: F64
    w: F64
    pull: F64
    turn: F64


@dataclass(frozen=True)
class Form:
    """One hidden form; ``parity`` of the variables that have one, ``draws`` uniform ranges of the sizes."""

    channel: str
    variables: frozenset[str]
    parity: Mapping[str, str]
    draws: Mapping[str, tuple[float, float]]
    acceleration: Callable[[At, Sizes], F64]

    def drawn(self, rng: Rng) -> dict[str, float]:
        """Sizes for one log."""
        return {key: float(rng.uniform(*span)) for key, span in self.draws.items()}


def form(
    channel: str, variables: str, parity: str, function: Callable[..., F64], **draws: tuple[float, float]
) -> Form:
    """A form from text: ``variables`` by blanks, ``parity`` as ``v:odd yaw_rate:even``."""
    signs = dict(pair.split(":") for pair in parity.split())
    return Form(channel, frozenset(variables.split()), signs, draws, lambda at, p: function(at, **p))


def aslant(angle: float, quarter: float) -> float:
    """A direction in any of the four quarters, clear of the axes where ``angle`` is clear of 0 and π/2."""
    return angle + 0.5 * np.pi * np.floor(quarter)

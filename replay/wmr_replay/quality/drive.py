"""Robots that move sideways on purpose, by their motion alone.

A skid is fed by forward speed or by a turn, and decays. A mecanum base starts sideways from rest.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_replay.quality.path_steps import Steps
from wmr_schemas.arrays import F64, Bool


@dataclass(frozen=True)
class StartRules:
    """When a start from rest is one sideways."""

    rest_s: float = 0.2
    """A robot that stood still so long has no speed left that could slide on."""
    sideways_rad: float = np.radians(60.0)
    """Course against heading: no wheel that rolls gets there from rest."""
    ahead_rad: float = np.radians(30.0)
    """Below it the start is one ahead or back."""
    turned_rad: float = 0.1
    """Of a start sideways, over a step of .2 m: a point off the axle that swings round turns further, up to
    an arm of 2 m."""


RULES = StartRules()


class Starts(NamedTuple):
    """Counts (k,) of starts from rest up to each step: sideways, and ahead or back."""

    sideways: F64
    ahead: F64


class StartsFromRest:
    """Stage: steps → :class:`Starts` at each of them."""

    def __init__(self) -> None:
        self._rested = False
        self._counts = np.zeros((2, 1))

    def push(self, steps: Steps) -> Starts:
        """The next k steps. The step after one with a rest counts: its whole length follows the rest."""
        rested = np.concatenate([[self._rested], steps.rest_s >= RULES.rest_s])
        self._rested = bool(rested[-1])
        start: Bool = rested[:-1] & ~rested[1:]
        sideslip = np.abs(steps.sideslip_rad)
        sideways = start & (sideslip >= RULES.sideways_rad) & (np.abs(steps.turned_rad) <= RULES.turned_rad)
        ahead = start & (sideslip <= RULES.ahead_rad)
        counts = np.cumsum(np.concatenate([self._counts, [sideways, ahead]], axis=1), axis=1)
        self._counts = counts[:, -1:]
        return Starts(counts[0, 1:], counts[1, 1:])

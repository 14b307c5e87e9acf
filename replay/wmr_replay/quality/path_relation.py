"""How the path's direction and the yaw turn together, over the last steps of the path.

A robot on wheels turns its path by turning itself: over a short way the path's direction χ and the yaw ψ turn
by nearly the same angle, and their difference, the sideslip β = χ − ψ, hardly turns. That holds in a steady
drift too. A yaw that belongs to something else leaves β turning as much as χ. All angles count modulo π: a
robot that reverses has no sideslip.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.path_steps import Steps
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.running_sums import LastEntries, RunningSums

N_LAST = 50
"""Steps looked back on: 13 m at .5 m/s, 27 m at 2 m/s. A single change from one drift to the
other is short of it."""
LAG = 2
"""Turns are compared over two steps: .5 m at .5 m/s. Longer ways turn by more than half a turn."""
STRAIGHT_MPS2, STRAIGHT_PER_M = 0.3, 0.2
"""Straight: so little centripetal acceleration that no tyre slides for it, and a radius of 5 m at least, so
that a pose .4 m off the axle shows 5° of sideslip at most."""


class Part(NamedTuple):
    """Sideslip over some of the last steps: how many (k,), how concentrated 0 to 1 (k,), its mean (k,)."""

    n: F64
    concentration: F64
    mean_rad: F64


class Relation(NamedTuple):
    """At each of k steps, over the last 50 of them.

    ``n`` (k,) pairs of steps; ``sideslip_turn2``, ``path_turn2`` and ``yaw_turn2`` (k,) are mean squares in
    rad² of the turn from one to the other, what noise explains taken off the first two. ``every``,
    ``straight``, ``left`` and ``right`` describe the sideslip; ``eighths`` (k,) is how concentrated it is on
    multiples of 45°.
    """

    n: F64
    sideslip_turn2: F64
    path_turn2: F64
    yaw_turn2: F64
    every: Part
    straight: Part
    left: Part
    right: Part
    eighths: F64


class PathRelation:
    """Stage: steps → :class:`Relation` at each of them."""

    def __init__(self) -> None:
        self._before = LastEntries(3, LAG)
        self._pairs = RunningSums(5, N_LAST)
        self._parts = [RunningSums(3, N_LAST) for _ in range(4)]
        self._eighths = RunningSums(2, N_LAST)

    def push(self, steps: Steps) -> Relation:
        """The next k steps."""
        sideslip = steps.sideslip_rad
        n, *sums = self._pairs.push(self._turns(steps, sideslip))
        sideslip2, path2, yaw2, noise2 = np.stack(sums) / np.maximum(n, 1.0)
        lateral, turned = steps.lateral_mps2, np.abs(steps.turned_rad)
        straight = (np.abs(lateral) <= STRAIGHT_MPS2) & (turned <= STRAIGHT_PER_M * steps.length_m)
        left, right = ~straight & (lateral > 0), ~straight & (lateral < 0)
        every = np.ones(len(sideslip), bool)
        whole, *parts = (
            part_of(sums_, mask, sideslip)
            for sums_, mask in zip(self._parts, (every, straight, left, right), strict=True)
        )
        cos, sin = self._eighths.push(np.stack([np.cos(8 * sideslip), np.sin(8 * sideslip)]))
        eighths = np.hypot(cos, sin) / np.maximum(whole.n, 1.0)
        return Relation(
            n, sideslip2 - noise2, path2 - noise2, yaw2, whole, parts[0], parts[1], parts[2], eighths
        )

    def _turns(self, steps: Steps, sideslip: F64) -> F64:
        """Squares (5, k) of the turns since ``LAG`` steps before: a one, sideslip, path, yaw, noise."""
        now = np.stack([sideslip, steps.yaw_rad, steps.variance])
        before = self._before.push(now)
        turn = now[:2] - before[:2]
        squares = np.stack([
            np.ones(len(sideslip)),
            half_turn(turn[0]) ** 2,
            half_turn(turn[0] + turn[1]) ** 2,
            half_turn(turn[1]) ** 2,
            now[2] + before[2],
        ])  # fmt: skip
        return np.where(np.isfinite(turn[0]), squares, 0.0)


def half_turn(angle_rad: F64) -> F64:
    """The angle modulo π, within ± π/2."""
    return np.asarray((angle_rad + np.pi / 2) % np.pi - np.pi / 2)


def part_of(sums: RunningSums, mask: Bool, sideslip: F64) -> Part:
    """The sideslip of the masked steps among the last ones."""
    double = np.stack([np.ones_like(sideslip), np.cos(2 * sideslip), np.sin(2 * sideslip)])
    n, cos, sin = sums.push(np.where(mask, double, 0.0))
    return Part(n, np.hypot(cos, sin) / np.maximum(n, 1.0), np.arctan2(sin, cos) / 2)

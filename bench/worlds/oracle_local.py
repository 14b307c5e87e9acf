"""Losses of traction in a time as rivals of one in a place, and the other way round, without a grid's error.

A patch that is crossed once is an interval, and an interval in which the robot does not come back is nearly a
patch. On a grid of half seconds or of five radii, ends are off by a quarter of a second, which a precise log
sees; a tool that moves the ends is not held by that grid.
"""

from itertools import product

import numpy as np

from wmr_schemas.arrays import F64, Bool
from worlds.oracle_filter import Steps, whitened
from worlds.oracle_forms import STEP_S, Signals, losing, trace

STEPS_M = (0.4, 0.2, 0.1, 0.05)
"""How far a patch's centre and radius are moved, in turn."""
LEAST_RADIUS_M = 0.1
END_S = 0.02
ABOUT_S = 0.5
"""The ends of an interval are moved in pieces of ``END_S`` up to so far beyond the hidden loss."""


def blocks_of(acts: Bool) -> list[tuple[int, int]]:
    """Samples [a, b) of each contiguous part of a loss (n,), with what lies about it."""
    reach = round(ABOUT_S / STEP_S)
    edges = np.flatnonzero(np.diff(acts, prepend=False, append=False)).reshape(-1, 2)
    return [(max(int(a) - reach, 0), min(int(b) + reach, len(acts))) for a, b in edges]


def fine_pieces(s: Signals, block: tuple[int, int]) -> list[Bool]:
    """Pieces of .02 s of a block, in their order."""
    width, rows = round(END_S / STEP_S), np.arange(len(s.t_s))
    return [(rows >= a) & (rows < min(a + width, block[1])) for a in range(*block, width)]


def pieces_by_block(s: Signals, steps: Steps, acts: Bool) -> list[F64]:
    """Of each crossing of a patch, all traction lost in pieces of .02 s, whitened."""
    found = []
    for block in blocks_of(acts):
        traces = [losing(s, piece.astype(float)) for piece in fine_pieces(s, block)]
        found.append(whitened(steps, traces))
    return found


def left_of_patch(s: Signals, steps: Steps, g: F64, place: dict[str, float]) -> float:
    """What the nearest patch leaves of ``g``, its centre and radius moved from ``place``."""
    best, least = place, left_by(g, whitened(steps, [trace("low_friction_patch", place, s)]))[0]
    for step in STEPS_M:
        moves = [np.array(move) * step for move in product((-1, 0, 1), repeat=3) if any(move)]
        tried = [moved(best, move) for move in moves]
        left = left_by(g, whitened(steps, [trace("low_friction_patch", p, s) for p in tried]))
        k = int(np.argmin(left))
        if left[k] < least:
            best, least = tried[k], float(left[k])
    return float(least)


def moved(place: dict[str, float], by: F64) -> dict[str, float]:
    """A patch with centre and radius changed."""
    x, y, radius = (
        place[key] + float(change) for key, change in zip(("x_m", "y_m", "radius_m"), by, strict=True)
    )
    return place | {"x_m": x, "y_m": y, "radius_m": max(radius, LEAST_RADIUS_M)}


def left_by(g: F64, columns: F64) -> F64:
    """What each column leaves of ``g`` at its best loss in [0, 1]."""
    power = np.maximum((columns**2).sum(axis=0), 1e-12)
    along = columns.T @ g
    loss = np.clip(along / power, 0.0, 1.0)
    return np.asarray(g @ g - 2 * loss * along + loss**2 * power)

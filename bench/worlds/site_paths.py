"""Paths of the driver families of the ninth report: bump and turn, a forklift, two saws, a survey."""

import numpy as np

from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng, in_parts


def bump_and_turn(duration_s: float, rng: Rng) -> Waypoints:
    """Straight until something is in the way, a little back, a turn on the spot by any angle, on again."""
    parts, pace = [], rng.uniform(0.35, 1.0)
    while sum(length for length, *_ in parts) < duration_s:
        rate, angle = rng.uniform(0.5, 1.0), rng.uniform(0.5, 3.0) * rng.choice((-1.0, 1.0))
        drift = rng.uniform(-0.06, 0.06)
        parts += [
            (rng.uniform(2.0, 9.0), pace, drift),
            (rng.uniform(0.6, 1.4), -rng.uniform(0.15, 0.4), 0.0),
            (abs(angle) / rate + 0.3, 0.0, float(np.sign(angle)) * rate),
        ]
    return in_parts(parts, rng)


def forklift(duration_s: float, rng: Rng) -> Waypoints:
    """Up to a pallet ever more slowly, a wait with the load, out backwards round a bend, and away."""
    parts: list[tuple[float, float, float]] = []
    while sum(length for length, *_ in parts) < duration_s:
        pace, rate = rng.uniform(0.6, 1.4), rng.uniform(0.25, 0.6) * rng.choice((-1.0, 1.0))
        creep = rng.uniform(0.08, 0.2)
        parts += [
            (rng.uniform(3.0, 8.0), pace, 0.0),
            (rng.uniform(2.0, 4.0), 0.6 * pace, rate),
            (rng.uniform(1.5, 3.0), 0.3 * pace, -0.3 * rate),
            (rng.uniform(2.0, 5.0), creep, rng.uniform(-0.05, 0.05)),
            (rng.uniform(1.5, 5.0), 0.0, 0.0),
            (rng.uniform(2.0, 4.0), -0.4 * pace, 0.0),
            (rng.uniform(2.0, 4.5), -0.5 * pace, rate),
            (rng.uniform(0.5, 1.5), 0.0, 0.0),
        ]
    return in_parts(parts, rng)


def saws(duration_s: float, rng: Rng) -> Waypoints:
    """Speed rises and falls in a saw, curvature in one of another period; never back, never at rest."""
    step_s = 0.1
    t_s = step_s * np.arange(int(duration_s / step_s) + 2)
    low, high = rng.uniform(0.15, 0.4), rng.uniform(0.9, 1.7)
    rise = rng.uniform(0.3, 0.7)
    speed = low + (high - low) * triangle(t_s / rng.uniform(6.0, 16.0) + rng.uniform(), rise)
    bend = rng.uniform(0.3, 0.7) * (2 * triangle(t_s / rng.uniform(9.0, 23.0) + rng.uniform(), 0.5) - 1)
    return Waypoints(tuple(t_s.tolist()), tuple(speed.tolist()), tuple((bend * speed).tolist()))


def triangle(phase: F64, rise: float) -> F64:
    """From 0 to 1 in the share ``rise`` of each period, and back in the rest."""
    part = phase % 1.0
    return np.minimum(part / rise, (1 - part) / (1 - rise))


def survey(duration_s: float, rng: Rng) -> Waypoints:
    """A surveyor's hops: a few metres, a wait to measure; every few hops to the next row of a grid."""
    parts, way = [], float(rng.choice((-1.0, 1.0)))
    while sum(length for length, *_ in parts) < duration_s:
        pace, hop_m, rate = rng.uniform(0.4, 1.1), rng.uniform(0.8, 2.5), rng.uniform(0.5, 0.9)
        for _ in range(int(rng.integers(2, 5))):
            parts += [(hop_m / pace + 0.4, pace, rng.uniform(-0.1, 0.1)), (rng.uniform(0.8, 2.0), 0.0, 0.0)]
        corner = (0.5 * np.pi / rate + 0.3, 0.0, way * rate)
        parts += [corner, (hop_m / pace + 0.4, pace, 0.0), corner]
        way = -way
    return in_parts(parts, rng)

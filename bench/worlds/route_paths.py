"""Paths of the driver families that the tenth report held out: an orchard, a ferry, a pacer, a rink."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng, in_parts


def orchard(duration_s: float, rng: Rng) -> Waypoints:
    """Between rows of trees: slow, small corrections, halts; at the end a U, at times in two moves."""
    parts, way = [], float(rng.choice((-1.0, 1.0)))
    while sum(length for length, *_ in parts) < duration_s:
        pace, rate = rng.uniform(0.3, 0.9), rng.uniform(0.3, 0.6)
        for _ in range(int(rng.integers(3, 7))):
            parts.append((rng.uniform(1.5, 4.0), pace * rng.uniform(0.7, 1.1), rng.uniform(-0.1, 0.1)))
            if rng.uniform() < 0.3:
                parts.append((rng.uniform(0.8, 2.5), 0.0, 0.0))
        half = 0.5 * np.pi / rate
        parts.append((half, 0.8 * pace, way * rate))
        if rng.uniform() < 0.4:
            parts += [(1.0, 0.0, 0.0), (rng.uniform(1.0, 2.0), -0.4 * pace, 0.0), (0.6, 0.0, 0.0)]
        parts.append((half, 0.8 * pace, way * rate))
        way = -way
    return in_parts(parts, rng, (0.3, 0.8), (0.5, 1.5))


def ferry(duration_s: float, rng: Rng) -> Waypoints:
    """To a far end forwards and back again in reverse along the same curves, with a wait at both."""
    parts: list[tuple[float, float, float]] = []
    out_mps, back_mps = rng.uniform(0.7, 1.6), rng.uniform(0.4, 1.0)
    while sum(length for length, *_ in parts) < duration_s:
        legs = [(rng.uniform(2.0, 6.0), rng.uniform(-0.35, 0.35)) for _ in range(int(rng.integers(2, 5)))]
        parts += [(length_m / out_mps + 0.3, out_mps, bend * out_mps) for length_m, bend in legs]
        parts.append((rng.uniform(1.0, 5.0), 0.0, 0.0))
        parts += [(length_m / back_mps + 0.3, -back_mps, -bend * back_mps) for length_m, bend in legs[::-1]]
        parts.append((rng.uniform(1.0, 5.0), 0.0, 0.0))
    return in_parts(parts, rng, (0.4, 1.1))


def pacer(duration_s: float, rng: Rng) -> Waypoints:
    """Intervals as a runner trains: hard and easy speeds that alternate by the clock, on one long oval."""
    step_s = 0.1
    t_s = step_s * np.arange(int(duration_s / step_s) + 2)
    easy, hard = rng.uniform(0.2, 0.6), rng.uniform(0.9, 1.7)
    period_s, share, sharp_s = rng.uniform(5.0, 18.0), rng.uniform(0.3, 0.7), rng.uniform(0.8, 2.0)
    phase = (t_s / period_s + rng.uniform()) % 1.0
    inside, outside = np.minimum(phase, share - phase), np.maximum(share - phase, phase - 1)
    since_s = period_s * np.where(phase < share, inside, outside)
    speed = easy + (hard - easy) / (1 + np.exp(-3 * since_s / sharp_s))
    along_m = step_s * np.cumsum(speed)
    oval_m, bend = rng.uniform(12.0, 30.0), rng.uniform(0.2, 0.6) * rng.choice((-1.0, 1.0))
    curvature = bend / (1 + np.exp(-6 * np.sin(4 * np.pi * along_m / oval_m)))
    return Waypoints(tuple(t_s.tolist()), tuple(speed.tolist()), tuple((curvature * speed).tolist()))


def rink(duration_s: float, rng: Rng) -> Waypoints:
    """As on ice: glides that slow down along ever tighter arcs to alternate sides; a spin now and then."""
    step_s, speed, turning = 0.1, [], []
    side = float(rng.choice((-1.0, 1.0)))
    while step_s * len(speed) < duration_s:
        top, lasts_s = rng.uniform(0.7, 1.6), rng.uniform(3.0, 8.0)
        share = np.linspace(0.0, 1.0, round(lasts_s / step_s))
        glide = top * (1 - rng.uniform(0.3, 0.8) * share) * np.minimum(1.0, 8 * share + 0.1)
        speed += glide.tolist()
        turning += (side * rng.uniform(0.3, 0.9) * share**2 * np.minimum(1.0, 12 * (1 - share))).tolist()
        if rng.uniform() < 0.25:
            n = round(rng.uniform(1.5, 4.0) / step_s)
            speed += [0.0] * n
            turning += (side * rng.uniform(0.5, 1.0) * np.sin(np.linspace(0, np.pi, n))).tolist()
        side = -side
    t_s = step_s * np.arange(len(speed))
    speed, turning = (
        np.convolve(np.pad(x, 4, mode="edge"), np.full(9, 1 / 9), mode="valid").tolist()
        for x in (speed, turning)
    )
    return Waypoints(tuple(t_s.tolist()), tuple(speed), tuple(turning))

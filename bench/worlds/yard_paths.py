"""Paths of the driver families that the eleventh report held out: plough, museum guide, skid pad, search."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng, in_parts


def plough(duration_s: float, rng: Rng) -> Waypoints:
    """Clears a yard: a push that gathers speed, a hard stop, back along an S to the lane beside it."""
    side, parts = float(rng.choice((-1.0, 1.0))), []
    while sum(length for length, *_ in parts) < duration_s:
        push, back = rng.uniform(0.6, 1.5), rng.uniform(0.4, 0.9)
        steps = np.linspace(0.4, 1.0, int(rng.integers(2, 5)))
        parts += [(rng.uniform(1.2, 2.5), push * step, rng.uniform(-0.06, 0.06)) for step in steps]
        parts.append((rng.uniform(0.8, 2.0), 0.0, 0.0))
        swerve, half = side * rng.uniform(0.15, 0.45), rng.uniform(1.5, 3.0)
        parts += [(half, -back, swerve), (half, -back, -swerve), (rng.uniform(0.8, 2.0), 0.0, 0.0)]
        if rng.uniform() < 0.2:
            side = -side
    return in_parts(parts, rng, (0.6, 1.4), (0.8, 1.8))


def museum(duration_s: float, rng: Rng) -> Waypoints:
    """A guide: slow curves from one exhibit to the next, a turn towards it, a long stand, a turn away."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        walk = rng.uniform(0.4, 1.0)
        parts += [
            (rng.uniform(1.5, 4.0), walk * rng.uniform(0.8, 1.1), rng.uniform(-0.35, 0.35))
            for _ in range(int(rng.integers(1, 4)))
        ]
        rate, angle = float(rng.choice((-1.0, 1.0))) * rng.uniform(0.3, 0.7), rng.uniform(0.5, 1.8)
        turn_s = angle / abs(rate) + 0.4
        stand = (rng.uniform(2.0, 6.0), 0.0, 0.0)
        parts += [(0.8, 0.0, 0.0), (turn_s, 0.0, rate), stand, (turn_s, 0.0, -rate * rng.uniform(0.6, 1.2))]
    return in_parts(parts, rng, (0.3, 0.7), (0.5, 1.2))


def skidpad(duration_s: float, rng: Rng) -> Waypoints:
    """Circles of one radius, quicker and quicker, then the other way; a straight brake test between."""
    way, radius, parts = float(rng.choice((-1.0, 1.0))), rng.uniform(1.2, 3.0), []
    while sum(length for length, *_ in parts) < duration_s:
        top = min(rng.uniform(0.9, 1.8), 1.0 * radius)
        ladder = np.linspace(0.4 * top, top, int(rng.integers(3, 6)))
        parts += [(rng.uniform(3.0, 6.0), speed, way * speed / radius) for speed in ladder]
        parts += [(2.0, rng.uniform(1.0, 1.7), 0.0), (rng.uniform(1.5, 3.0), 0.0, 0.0)]
        way = -way
    return in_parts(parts, rng, (0.5, 1.5), (0.8, 2.0))


def search(duration_s: float, rng: Rng) -> Waypoints:
    """An expanding square: growing legs, rounded corners, the nose sways to scan; at times in reverse."""
    step_s, speed, turning = 0.1, [], []
    while step_s * len(speed) < duration_s:
        way = -1.0 if rng.uniform() < 0.3 else 1.0
        pace, side = rng.uniform(0.4, 1.2), float(rng.choice((-1.0, 1.0)))
        sway, period_s, grows = rng.uniform(0.1, 0.4), rng.uniform(1.5, 3.5), rng.uniform(0.5, 1.2)
        for leg in range(int(rng.integers(4, 8))):
            t_s = np.arange(0.0, (1.0 + grows * leg) / pace + 1.0, step_s)
            speed += [way * pace] * len(t_s)
            turning += (sway * np.sin(2 * np.pi * t_s / period_s)).tolist()
            n = round(0.5 * np.pi / 0.7 / step_s)
            speed += [0.5 * way * pace] * n
            turning += [side * 0.7] * n
        speed += [0.0] * round(rng.uniform(2.0, 4.0) / step_s)
        turning += [0.0] * (len(speed) - len(turning))
    t_s = step_s * np.arange(len(speed))
    speed, turning = (
        np.convolve(np.pad(x, 7, mode="edge"), np.full(15, 1 / 15), mode="valid").tolist()
        for x in (speed, turning)
    )
    return Waypoints(tuple(t_s.tolist()), tuple(speed), tuple(turning))

"""Paths of the families that the twelfth report held out: bed mover, walker, ball collector, goalkeeper."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng, in_parts

STEP_S = 0.1


def rounded(speed: list[float], turning: list[float], over_s: float) -> Waypoints:
    """Knots every ``STEP_S``, averaged under a cosine bell of that length, so that ramps begin softly."""
    half = max(1, round(0.5 * over_s / STEP_S))
    bell = np.hanning(2 * half + 3)[1:-1]
    t_s = STEP_S * np.arange(len(speed))
    ahead, around = (
        np.convolve(np.pad(x, half, mode="edge"), bell / bell.sum(), mode="valid") for x in (speed, turning)
    )
    return Waypoints(tuple(t_s.tolist()), tuple(ahead.tolist()), tuple(around.tolist()))


def bed(duration_s: float, rng: Rng) -> Waypoints:
    """A patient's bed: soft ramps along corridors, slowly past doors, a wait in a lift, out backwards."""
    parts: list[tuple[float, float, float]] = []
    while sum(length for length, *_ in parts) < duration_s:
        pace, side = rng.uniform(0.7, 1.4), float(rng.choice((-1.0, 1.0)))
        for _ in range(int(rng.integers(1, 4))):
            parts.append((rng.uniform(3.0, 7.0), pace * rng.uniform(0.85, 1.1), rng.uniform(-0.04, 0.04)))
            if rng.uniform() < 0.5:
                parts.append((rng.uniform(1.5, 3.0), pace * rng.uniform(0.3, 0.6), 0.0))
            round_m, angle = rng.uniform(1.5, 3.0), rng.uniform(0.7, 1.7)
            bend = pace * rng.uniform(0.5, 0.8)
            parts.append((angle * round_m / bend, bend, float(rng.choice((-1.0, 1.0))) * bend / round_m))
        slow, back = rng.uniform(0.2, 0.35), rng.uniform(0.25, 0.5)
        parts += [(rng.uniform(2.0, 3.5), slow, 0.0), (rng.uniform(3.0, 7.0), 0.0, 0.0)]
        parts += [(rng.uniform(1.5, 3.0), -back, 0.0), (rng.uniform(2.5, 4.5), -back, side * back / 1.5)]
        parts.append((rng.uniform(1.2, 2.5), 0.0, 0.0))
    path = in_parts(parts, rng, (0.3, 0.7), (0.3, 0.8))
    speed, turning = path(np.arange(0.0, duration_s + 2 * STEP_S, STEP_S))
    return rounded(speed.tolist(), turning.tolist(), rng.uniform(0.8, 2.0))


def walker(duration_s: float, rng: Rng) -> Waypoints:
    """A walking frame: each step of who holds it ripples in the speed; rests, half turns in small steps."""
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s:
        steps_hz, pace = rng.uniform(0.6, 1.4), rng.uniform(0.4, 1.1)
        ripple = min(rng.uniform(0.3, 0.9) / (2 * np.pi * steps_hz), 0.5 * pace)
        t_s = np.arange(0.0, rng.uniform(6.0, 16.0), STEP_S)
        tired = 1 - rng.uniform(0.0, 0.4) * t_s / t_s[-1]
        sway = rng.uniform(0.05, 0.3) * np.sin(2 * np.pi * t_s / rng.uniform(4.0, 9.0) + rng.uniform(0, 6.28))
        step = np.sin(2 * np.pi * steps_hz * t_s)
        under_way = np.clip(np.minimum(t_s, t_s[-1] - t_s) / 1.3, 0.0, 1.0)
        speed += (under_way * (pace * tired + ripple * step)).tolist()
        turning += (sway + 0.06 * np.sin(np.pi * steps_hz * t_s)).tolist()
        n = round(rng.uniform(2.5, 5.0) / STEP_S)
        if rng.uniform() < 0.5:
            shuffle = np.sin(2 * np.pi * steps_hz * STEP_S * np.arange(n))
            speed += (0.15 + 0.08 * shuffle).tolist()
            turning += (float(rng.choice((-1.0, 1.0))) * (0.6 + 0.15 * shuffle)).tolist()
        else:
            speed += [0.0] * n
            turning += [0.0] * n
    return rounded(speed, turning, 0.6)


def collector(duration_s: float, rng: Rng) -> Waypoints:
    """Tennis balls: from one to the next about a court, slowly over each; at the basket a stop, then back."""
    speed: list[float] = []
    turning: list[float] = []
    place, heading, v, w = rng.uniform(0.0, 8.0, 2), rng.uniform(0.0, 6.28), 0.0, 0.0
    pace, by_mps2, near_m = rng.uniform(0.8, 1.7), rng.uniform(0.6, 1.4), rng.uniform(0.8, 1.6)
    ball, left = rng.uniform(0.0, 1.0, 2) * (8.0, 14.0), int(rng.integers(3, 7))
    stands = backs = 0
    while STEP_S * len(speed) < duration_s:
        to = ball - place
        away, off = float(np.hypot(*to)), (np.arctan2(to[1], to[0]) - heading + np.pi) % (2 * np.pi) - np.pi
        if stands > 0 or backs > 0:
            wanted, around = (0.0, 0.0) if stands > 0 else (-0.4, 0.3)
            stands, backs = max(stands - 1, 0), backs - (stands == 0)
        elif away < 0.25 or (away < 0.7 and abs(off) > 1.2):
            ball, left = rng.uniform(0.0, 1.0, 2) * (8.0, 14.0), left - 1
            if left == 0:
                stands, backs = round(rng.uniform(2.0, 4.5) / STEP_S), round(rng.uniform(1.0, 2.5) / STEP_S)
                left = int(rng.integers(3, 7))
            continue
        else:
            wanted = pace * max(0.1, float(np.cos(off))) * min(1.0, 0.3 + 0.7 * away / (2 * near_m))
            around = float(np.clip(1.3 * off, -1.0, 1.0))
        v += float(np.clip(wanted - v, -by_mps2 * STEP_S, by_mps2 * STEP_S))
        w += float(np.clip(around - w, -0.2, 0.2))
        heading += w * STEP_S
        place = place + v * STEP_S * np.array([np.cos(heading), np.sin(heading)])
        speed.append(v)
        turning.append(w)
    speed += [speed[-1]] * 2
    turning += [turning[-1]] * 2
    return rounded(speed, turning, 0.4)


def goalkeeper(duration_s: float, rng: Rng) -> Waypoints:
    """To and fro on the arc before a goal: waits, sudden saves to either end, at times out ahead and back."""
    parts: list[tuple[float, float, float]] = []
    curve, where = float(rng.choice((-1.0, 1.0))) * rng.uniform(0.1, 0.35), 0.0
    while sum(length for length, *_ in parts) < duration_s:
        save = rng.uniform() < 0.6
        speed = rng.uniform(0.8, 1.6) if save else rng.uniform(0.2, 0.6)
        aim = rng.uniform(0.5, 2.0) * (-1.0 if where > 0 else 1.0) + rng.uniform(-0.3, 0.3)
        way, reach = float(np.sign(aim - where)), abs(aim - where)
        where = aim
        parts += [(reach / speed + 0.5, way * speed, way * speed * curve), (0.9, 0.0, 0.0)]
        parts.append((rng.uniform(0.1, 2.5), 0.0, 0.0))
        if rng.uniform() < 0.2:
            side, rush = float(rng.choice((-1.0, 1.0))), rng.uniform(0.8, 1.6)
            turn, out = (1.6, 0.0, side * 0.8), rng.uniform(1.5, 3.0)
            parts += [turn, (0.6, 0.0, 0.0), (out, rush, 0.0), (rng.uniform(1.0, 2.0), 0.0, 0.0)]
            parts += [(2 * out, -0.5 * rush, 0.0), (0.9, 0.0, 0.0), (1.6, 0.0, -side * 0.8), (0.6, 0.0, 0.0)]
    return in_parts(parts, rng, (1.0, 2.0), (1.2, 2.5))

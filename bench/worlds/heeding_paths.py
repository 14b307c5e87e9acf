"""Paths of driver families that heed something else: the wind, a flock, a trailer behind, soup on a tray."""

import numpy as np

from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Waypoints
from worlds.duty_paths import STEP_S, rounded
from worlds.parts import Rng

MOST_RADPS = 0.95


def wrapped(angle: float) -> float:
    """The same angle between −π and π."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def yacht(duration_s: float, rng: Rng) -> Waypoints:
    """As under sail: its heading to the wind sets its speed; up in tacks, down in gybes; gusts, a swell."""
    speed: list[float] = []
    turning: list[float] = []
    best, lag_s, rate = rng.uniform(1.0, 1.7), rng.uniform(0.7, 2.2), rng.uniform(0.45, MOST_RADPS - 0.1)
    gusty, swell, swell_s = rng.uniform(0.05, 0.2), rng.uniform(0.0, 0.15), rng.uniform(1.6, 4.0)
    upwind, side, legs, left, gust, w = bool(rng.uniform() < 0.5), 1.0, 0, 0, 0.0, 0.0
    off, aim, v = rng.uniform(-np.pi, np.pi), 1.0, 0.5 * best
    while STEP_S * len(speed) < duration_s:
        if left == 0:
            if legs == 0:
                upwind, legs = not upwind, int(rng.integers(2, 6))
            aim = rng.uniform(0.6, 1.0) if upwind else rng.uniform(1.9, 2.8)
            side, legs, left = -side, legs - 1, round(rng.uniform(3.0, 9.0) / STEP_S)
        left -= 1
        gust = float(np.clip(gust - STEP_S * gust / 2 + gusty * np.sqrt(STEP_S) * rng.normal(), -0.4, 0.2))
        wanted = float(np.clip(1.5 * wrapped(side * (aim - gust) - off), -rate, rate))
        w += float(np.clip(wanted - w, -0.15, 0.15))
        off = wrapped(off + STEP_S * w)
        v += STEP_S / lag_s * (best * (1 + gust) * (0.2 + 0.8 * np.sin(0.72 * abs(off))) - v)
        speed.append(float(v))
        turning.append(w + swell * float(np.sin(2 * np.pi * STEP_S * len(speed) / swell_s)))
    return rounded(speed, turning, 0.4)


def sheepdog(duration_s: float, rng: Rng) -> Waypoints:
    """To calls: round the flock one way or the other, up to it at a walk, lie down; the flock gives way."""
    speed: list[float] = []
    turning: list[float] = []
    run, walk, by_mps = rng.uniform(1.0, 1.8), rng.uniform(0.3, 0.7), STEP_S * rng.uniform(0.8, 1.8)
    ring_m, shy_m = rng.uniform(2.2, 4.5), rng.uniform(1.3, 2.2)
    dog, flock, heading, v, w = np.zeros(2), np.array([ring_m, 0.0]), rng.uniform(0.0, 6.28), 0.0, 0.0
    calls = ((1.0, run, 2.5, 7.0), (-1.0, run, 2.5, 7.0), (0.0, walk, 2.0, 6.0), (0.0, 0.0, 1.5, 3.5))
    call, left, side, pace = 3, 0, 0.0, 0.0
    while STEP_S * len(speed) < duration_s:
        if left == 0:
            call = (call + int(rng.integers(1, 4))) % 4
            side, pace = calls[call][0], calls[call][1] * rng.uniform(0.8, 1.1)
            left = round(rng.uniform(*calls[call][2:]) / STEP_S)
        left -= 1
        to = flock - dog
        away = float(np.hypot(*to))
        inwards = float(np.clip(0.7 * (away - ring_m), -1.2, 1.2))
        off = wrapped(np.arctan2(to[1], to[0]) - side * (0.5 * np.pi - inwards) - heading)
        v += float(np.clip(pace * max(0.15, np.cos(off)) - v, -by_mps, by_mps))
        w += float(np.clip((pace > 0) * np.clip(1.5 * off, -MOST_RADPS, MOST_RADPS) - w, -0.2, 0.2))
        heading += STEP_S * w
        dog = dog + STEP_S * v * np.array([np.cos(heading), np.sin(heading)])
        flock = flock + STEP_S * 0.8 * min(max(shy_m - away, 0.0), 1.0) * to / max(away, 0.1)
        speed.append(v)
        turning.append(w)
    return rounded(speed, turning, 0.4)


def trailer(duration_s: float, rng: Rng) -> Waypoints:
    """Pushes a trailer backwards, with a look now and then, a late correction; pulls ahead where it folds."""
    speed: list[float] = []
    turning: list[float] = []
    long_m, back, ahead = rng.uniform(0.7, 1.6), rng.uniform(0.3, 0.8), rng.uniform(0.5, 1.3)
    looks, firm, blind = int(rng.integers(4, 12)), rng.uniform(0.7, 1.6), rng.uniform(0.05, 0.25)
    by_mps, fold = STEP_S * rng.uniform(0.4, 1.0), rng.uniform(-0.2, 0.2)
    bend = v = w = steer = 0.0
    legs = ((-back, 7.0, 18.0), (0.0, 2.0, 5.0), (ahead, 2.5, 6.0), (0.0, 1.2, 2.5))
    leg, left, pace, pulls, folded = 3, 0, 0.0, False, rng.uniform(0.5, 0.8)
    while STEP_S * len(speed) < duration_s:
        if left == 0:
            leg = (leg + 1) % len(legs)
            pace, bend = legs[leg][0] * rng.uniform(0.7, 1.1), rng.uniform(-0.35, 0.35)
            left = round(rng.uniform(*legs[leg][1:]) / STEP_S)
        left -= 1
        pulls = leg == 0 and abs(fold) > (0.2 if pulls else folded)
        v += float(np.clip((0.7 * ahead if pulls else pace) - v, -by_mps, by_mps))
        if len(speed) % looks == 0:
            wrong = bend + rng.normal(0.0, 0.06) - fold
            steer = firm * wrong if abs(wrong) > blind else 0.0
        pushed = float(np.clip(steer, -0.8, 0.8)) if v < 0 else 0.7 * bend
        w += float(np.clip(pushed * min(1.0, abs(v) / 0.2) - w, -0.15, 0.15))
        fold += STEP_S * (w - v / long_m * float(np.sin(fold)))
        speed.append(v)
        turning.append(w)
    return rounded(speed, turning, 0.5)


def waiter(duration_s: float, rng: Rng) -> Waypoints:
    """Soup on a tray: changes in two steps half a slosh apart; stands, a step back; briskly home without."""
    speed: list[float] = []
    turning: list[float] = []
    ramp = np.full(round(rng.uniform(0.5, 0.9) / STEP_S), 1.0)
    slosh = np.zeros(len(ramp) + round(rng.uniform(0.6, 1.4) / STEP_S))
    slosh[: len(ramp)] += 0.5
    slosh[-len(ramp) :] += 0.5
    soft = np.hanning(round(rng.uniform(1.6, 2.6) / STEP_S))
    while STEP_S * len(speed) < duration_s:
        pace, side = rng.uniform(0.45, 1.0), float(rng.choice((-1.0, 1.0)))
        out: list[tuple[float, float, float]] = []
        for _ in range(int(rng.integers(2, 5))):
            out.append((rng.uniform(2.0, 5.0), pace * rng.uniform(0.75, 1.1), rng.uniform(-0.4, 0.4)))
            if rng.uniform() < 0.25:
                out.append((rng.uniform(1.0, 2.5), 0.0, 0.0))
        out += [
            (rng.uniform(1.5, 3.0), 0.4 * pace, side * rng.uniform(0.2, 0.5)),
            (rng.uniform(1, 4), 0.0, 0.0),
        ]
        around = side * rng.uniform(0.5, 0.9)
        home = [(rng.uniform(1.2, 2.5), -rng.uniform(0.2, 0.45), 0.0), (0.8, 0.0, 0.0)]
        home += [(rng.uniform(1.5, 3.0) / abs(around), 0.0, around)]
        for _ in range(int(rng.integers(1, 4))):
            home.append((rng.uniform(1.5, 4.0), pace * rng.uniform(1.2, 1.7), rng.uniform(-0.5, 0.5)))
        home.append((rng.uniform(1.0, 4.0), 0.0, 0.0))
        for parts, by in ((out, slosh), (home, soft)):
            ahead, turns = stepped(parts, by)
            speed += ahead.tolist()
            turning += turns.tolist()
    return rounded(speed, turning, 0.3)


def stepped(parts: list[tuple[float, float, float]], by: F64) -> tuple[F64, F64]:
    """Speeds and yaw rates of lengths in s, from rest to rest, every step drawn out as the weights say."""
    lengths, speed, turning = np.array(parts).T
    n = np.rint(lengths / STEP_S).astype(np.int64)
    ahead, turns = (np.convolve(np.repeat(x, n), by / by.sum()) for x in (speed, turning))
    return ahead, turns

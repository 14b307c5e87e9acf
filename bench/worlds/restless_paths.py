"""Paths of four more driver families: a coaster, a tumbleweed, a typewriter and a spinning top."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.parts import Rng

STEP_S = 0.1
FENCE_M = 5.0
"""Farther from the start than this, the tumbleweed's wind blows it back."""


def coaster(duration_s: float, rng: Rng) -> Waypoints:
    """A roller coaster: quick in dips, slow over crests, back tail first off one too high; then hauled on."""
    speed: list[float] = []
    turning: list[float] = []
    hill_m, hop_m = rng.uniform(3.0, 5.0), rng.uniform(1.4, 2.4)
    high, low, rub = rng.uniform(0.08, 0.16), rng.uniform(0.01, 0.04), rng.uniform(0.04, 0.1)
    lap = rng.choice((-1.0, 1.0)) * rng.uniform(0.25, 0.5)
    bend_m, bend = rng.uniform(2.0, 4.5), rng.uniform(0.5, 1.0)
    phase, haul = rng.uniform(0.0, 2 * np.pi, 3), rng.uniform(0.2, 0.45)
    s, v, hauled, rocking, patience = 0.0, 0.2, True, 0.0, rng.uniform(2.0, 7.0)
    while STEP_S * len(speed) < duration_s + 1.0:
        steep = high * 2 * np.pi / hill_m * np.cos(2 * np.pi * s / hill_m + phase[0])
        steep += low * 2 * np.pi / hop_m * np.cos(2 * np.pi * s / hop_m + phase[1])
        if hauled:
            push = 1.5 * (haul - v)
            hauled = steep > 0 or v < 0.8 * haul
        else:
            push = -1.6 * steep - rub * v
        v = float(np.clip(v + STEP_S * np.clip(push, -0.9, 0.9), -0.8, 0.97))
        s += STEP_S * v
        rocking = rocking + STEP_S if v < 0.15 else max(rocking - 0.3 * STEP_S, 0.0)
        if rocking > patience:
            hauled, rocking, patience = True, 0.0, rng.uniform(2.0, 7.0)
        speed.append(v)
        turning.append(v * (lap + bend * np.sin(2 * np.pi * s / bend_m + phase[2])))
    return softened(speed, turning, 0.6)


def tumbleweed(duration_s: float, rng: Rng) -> Waypoints:
    """A tumbleweed: off with each gust, its nose swung to a veering wind, hops askew, lies still in lulls."""
    speed: list[float] = []
    turning: list[float] = []
    x, y, yaw, v, rate = 0.0, 0.0, 0.0, 0.0, 0.0
    wind, veer = rng.uniform(-1.0, 1.0), rng.choice((-1.0, 1.0)) * rng.uniform(0.08, 0.2)
    gust, hop, left, heavy = 0.5, 0.0, 0, rng.uniform(0.8, 2.0)
    while STEP_S * len(speed) < duration_s + 1.0:
        if left <= 0:
            left = round(rng.uniform(1.5, 6.0) / STEP_S)
            gust = 0.0 if rng.uniform() < 0.2 else rng.uniform(0.25, 0.97)
            wind += rng.normal() * 0.5
            hop = rng.uniform(-0.6, 0.6)
        left -= 1
        wind += STEP_S * veer
        if np.hypot(x, y) > FENCE_M:
            home = np.arctan2(-y, -x) - wind
            wind += 0.15 * np.arctan2(np.sin(home), np.cos(home))
        v += STEP_S * float(np.clip((gust - v) / heavy, -0.6, 0.8))
        off = np.arctan2(np.sin(wind - yaw), np.cos(wind - yaw))
        if rng.uniform() < 0.04:
            hop = rng.uniform(-0.9, 0.9)
        hop *= 0.95
        aim = float(np.clip(0.9 * off + hop, -1.05, 1.05)) * min(v / 0.3, 1.0)
        rate += float(np.clip(aim - rate, -0.2, 0.2))
        yaw += STEP_S * rate
        x += STEP_S * v * np.cos(yaw)
        y += STEP_S * v * np.sin(yaw)
        speed.append(v)
        turning.append(rate)
    return softened(speed, turning, 0.6)


def typewriter(duration_s: float, rng: Rng) -> Waypoints:
    """A typewriter's carriage: hop by hop along a line, a space now and then, swiftly back for the next."""
    speed: list[float] = []
    turning: list[float] = []
    side, key_s = float(rng.choice((-1.0, 1.0))), rng.uniform(1.4, 2.2)
    while STEP_S * len(speed) < duration_s + 1.0:
        line, reach = rng.uniform(1.8, 4.5), 0.0
        bow = rng.uniform(-0.25, 0.25)
        while reach < line:
            word = rng.uniform(0.0, 1.0)
            u = steps(key_s * rng.uniform(0.85, 1.3))
            hop = (-0.5 if word < 0.08 else 1.0) * rng.uniform(0.07, 0.17) * (len(u) * STEP_S) ** 2
            rise = np.sin(np.pi * u) ** 2
            speed += (2.0 * hop / (STEP_S * len(u)) * rise).tolist()
            turning += ((bow + rng.normal() * 0.15) * 2.0 * rise).tolist()
            reach += hop
            if word > 0.8:
                gap = round(rng.uniform(0.4, 1.5) / STEP_S)
                speed += [0.0] * gap
                turning += [0.0] * gap
        pace, shift = rng.uniform(0.6, 0.9), rng.uniform(0.3, 0.9)
        u = steps(1.5 + reach / pace)
        lift = np.minimum(1.0, 4.0 * np.minimum(u, 1.0 - u))
        speed += (-pace * lift).tolist()
        turning += (side * shift * np.sin(2 * np.pi * u) - bow * lift).tolist()
        if rng.uniform() < 0.4:
            u = steps(rng.uniform(2.5, 4.5))
            speed += (rng.uniform(0.0, 0.6) * np.sin(np.pi * u)).tolist()
            turning += (side * rng.uniform(0.5, 1.0) * np.sin(np.pi * u)).tolist()
            side = -side
    return softened(speed, turning, 0.4)


def spinning_top(duration_s: float, rng: Rng) -> Waypoints:
    """A spinning top: rounds with nods that grow to cusps and loops, a roll on its side; spun anew."""
    speed: list[float] = []
    turning: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    while STEP_S * len(speed) < duration_s + 1.0:
        pace, round_rate = rng.uniform(0.25, 0.36), side * rng.uniform(0.15, 0.4)
        spin_s, nod_s, tall = rng.uniform(15.0, 35.0), rng.uniform(2.4, 3.5), rng.uniform(1.2, 1.7)
        u = steps(spin_s)
        beat = 2 * np.pi * spin_s / nod_s * (u - 0.2 * u**2)
        nod = (0.25 + 0.75 * u) * np.minimum(1.0, 6.0 * (1.0 - u))
        start = np.minimum(1.0, 8.0 * u)
        speed += (pace * start * (1.0 + tall * nod * np.cos(beat))).tolist()
        turning += (start * (round_rate + 0.6 * nod * np.sin(beat + 0.5 * side))).tolist()
        u = steps(rng.uniform(2.5, 5.0))
        speed += (pace + rng.uniform(0.2, 0.5) * np.sin(np.pi * u) - pace * u).tolist()
        turning += (round_rate * (1.0 - u) + side * rng.uniform(0.3, 0.6) * np.sin(np.pi * u)).tolist()
        rest = round(rng.uniform(0.8, 2.5) / STEP_S)
        speed += [0.0] * rest
        turning += [0.0] * rest
        side = -side if rng.uniform() < 0.5 else side
    return softened(speed, turning, 0.7)

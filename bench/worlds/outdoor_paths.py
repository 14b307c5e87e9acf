"""Paths of driver families that are mostly outdoors: a pram, a hound, a road of hairpins, a sprayer."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.duty_paths import STEP_S, rounded
from worlds.parts import Rng, in_parts

MOST_RADPS = 0.95
STEP_M = 0.05


def pram(duration_s: float, rng: Rng) -> Waypoints:
    """A pram: a walk along a bend, then rocked to and fro by a sine that fades as the child falls asleep."""
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s:
        pace, bend, wave = rng.uniform(0.5, 1.3), rng.uniform(-0.4, 0.4), rng.uniform(-0.2, 0.2)
        t_s = np.arange(0.0, rng.uniform(4.0, 11.0), STEP_S)
        share = t_s / t_s[-1]
        speed += (pace * np.clip(np.minimum(t_s, t_s[-1] - t_s) / 1.5, 0.0, 1.0)).tolist()
        turning += (bend * np.sin(np.pi * share) + wave * np.sin(2 * np.pi * share)).tolist()
        period_s = rng.uniform(2.0, 4.5)
        swing = min(rng.uniform(0.25, 0.7), 1.1 * period_s / (2 * np.pi))
        t_s = np.arange(0.0, period_s * int(rng.integers(3, 8)), STEP_S)
        fades = 1 - rng.uniform(0.0, 0.7) * t_s / t_s[-1]
        speed += (swing * fades * np.sin(2 * np.pi * t_s / period_s)).tolist()
        turning += (rng.uniform(-0.4, 0.4) * np.sin(np.pi * t_s / period_s)).tolist()
        if rng.uniform() < 0.3:
            n = round(rng.uniform(1.0, 3.0) / STEP_S)
            speed += [0.0] * n
            turning += [0.0] * n
    return rounded(speed, turning, 0.4)


def hound(duration_s: float, rng: Rng) -> Waypoints:
    """On a trail, nose to and fro; where it is lost, ever wider casts, then at times a stand to sniff."""
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s:
        pace, beat_s, side = rng.uniform(0.6, 1.6), rng.uniform(1.2, 2.6), float(rng.choice((-1.0, 1.0)))
        t_s = np.arange(0.0, rng.uniform(3.0, 9.0), STEP_S)
        keen = np.clip(t_s / rng.uniform(1.5, 3.0), 0.3, 1.0)
        speed += (pace * keen).tolist()
        turning += (
            rng.uniform(-0.2, 0.2) + rng.uniform(0.15, 0.4) * np.sin(2 * np.pi * t_s / beat_s)
        ).tolist()
        wide = rng.uniform(0.2, 0.4)
        for cast in range(int(rng.integers(2, 6))):
            n = round(rng.uniform(0.9, 1.3) * (1 + wide * cast) / STEP_S)
            swing = np.sin(np.linspace(0.0, np.pi, n))
            speed += (pace * rng.uniform(0.25, 0.4) * (1 + 0.7 * swing)).tolist()
            turning += (side * rng.uniform(0.5, MOST_RADPS) * swing).tolist()
            side = -side
        if rng.uniform() < 0.5:
            n = round(rng.uniform(1.5, 3.5) / STEP_S)
            speed += [0.0] * n
            turning += [0.0] * n
    return rounded(speed, turning, 1.0)


def hairpins(duration_s: float, rng: Rng) -> Waypoints:
    """A mountain road: as quick as the side force lets it, brakes on before each hairpin, power on after."""
    bends: list[float] = []
    tops: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    while STEP_M * len(bends) < 2.2 * duration_s:
        top = rng.uniform(0.9, 1.9)
        straight = round(rng.uniform(1.5, 7.0) / STEP_M)
        hairpin = rng.uniform() < 0.6
        radius_m = rng.uniform(0.8, 1.8) if hairpin else rng.uniform(2.0, 6.0)
        bend = round(radius_m * (rng.uniform(2.2, 3.2) if hairpin else rng.uniform(0.3, 1.0)) / STEP_M)
        bends += [0.0] * straight + [side / radius_m] * bend
        tops += [top] * (straight + bend)
        side = -side if rng.uniform() < 0.8 else side
    bell = np.hanning(19)[1:-1]
    curvature = np.convolve(np.pad(bends, 8, mode="edge"), bell / bell.sum(), mode="valid")
    tight = np.abs(curvature) + 1e-3
    fast2 = np.minimum.reduce([np.square(tops), rng.uniform(0.4, 0.9) / tight, np.square(MOST_RADPS / tight)])
    fast2[0] = min(fast2[0], 0.1)
    power, brakes = 2 * STEP_M * rng.uniform(0.4, 1.0), 2 * STEP_M * rng.uniform(0.6, 1.3)
    for k in range(1, len(fast2)):
        fast2[k] = min(fast2[k], fast2[k - 1] + power)
    for k in range(len(fast2) - 1, 0, -1):
        fast2[k - 1] = min(fast2[k - 1], fast2[k] + brakes)
    fast = np.sqrt(fast2)
    when_s = np.concatenate([[0.0], np.cumsum(2 * STEP_M / (fast[1:] + fast[:-1]))])
    at_m = np.interp(np.arange(0.0, duration_s + 2 * STEP_S, STEP_S), when_s, STEP_M * np.arange(len(fast)))
    speed = np.interp(at_m, STEP_M * np.arange(len(fast)), fast)
    bend_at = np.interp(at_m, STEP_M * np.arange(len(fast)), curvature)
    return rounded(speed.tolist(), (speed * bend_at).tolist(), 0.3)


def sprayer(duration_s: float, rng: Rng) -> Waypoints:
    """A boom sprayer: straight passes, pear-shaped turns at the headland, nearly one speed all the time."""
    parts: list[tuple[float, float, float]] = []
    pace, side = rng.uniform(0.6, 1.2), float(rng.choice((-1.0, 1.0)))
    while sum(length for length, *_ in parts) < duration_s:
        for _ in range(int(rng.integers(2, 5))):
            speed, drift = pace * rng.uniform(0.96, 1.04), rng.uniform(-0.04, 0.04)
            parts.append((rng.uniform(2.0, 4.0), speed, drift))
        rate, out = rng.uniform(0.4, 0.8), rng.uniform(0.4, 1.0)
        parts.append((out / rate, pace, -side * rate))
        parts.append(((np.pi + 2 * out) / rate, pace * rng.uniform(0.9, 1.0), side * rate))
        parts.append((out / rate, pace, -side * rate))
        side = -side
    return in_parts(parts, rng, (0.3, 0.8), (0.8, 1.8))

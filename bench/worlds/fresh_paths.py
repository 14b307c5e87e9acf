"""Paths of four more driver families: a vacuum cleaner, a bee, statues and a rower."""

import numpy as np

from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng

STEP_S = 0.1
MOST_RADPS = 1.1
HOME_M = 4.5
"""Farther from the start than this, statues turn back."""


def softened(speed: list[float], turning: list[float], over_s: float) -> Waypoints:
    """References at steps of ``STEP_S``, averaged under a bell of this length."""
    bell = np.hanning(2 * max(round(0.5 * over_s / STEP_S), 1) + 3)[1:-1]
    most = np.clip(turning, -MOST_RADPS, MOST_RADPS)
    smooth = [
        np.convolve(np.pad(u, len(bell) // 2, mode="edge"), bell / bell.sum(), mode="valid")
        for u in (np.asarray(speed), most)
    ]
    t_s = STEP_S * np.arange(len(speed))
    return Waypoints(tuple(t_s.tolist()), tuple(smooth[0].tolist()), tuple(smooth[1].tolist()))


def steps(length_s: float) -> F64:
    """Shares 0 to 1 of a part of this length, one a step."""
    return np.linspace(0.0, 1.0, max(round(length_s / STEP_S), 2))


def vacuum(duration_s: float, rng: Rng) -> Waypoints:
    """Vacuuming a carpet: long strokes to and fro in a fan, the heading shifted a little on each way back."""
    speed: list[float] = []
    turning: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    while STEP_S * len(speed) < duration_s + 1.0:
        reach = rng.uniform(0.8, 2.2)
        for _ in range(int(rng.integers(4, 9))):
            ahead_s, back_s = 1.0 + reach / rng.uniform(0.5, 1.2), 1.0 + reach / rng.uniform(0.4, 0.8)
            shift, wrist = side * rng.uniform(0.15, 0.5), rng.uniform(-0.15, 0.15)
            for way, length_s, swing in ((1.0, ahead_s, wrist), (-1.0, back_s, shift)):
                hump = np.sin(np.pi * steps(length_s))
                speed += (way * 0.5 * np.pi * reach / length_s * hump).tolist()
                turning += (0.5 * np.pi * swing / length_s * hump).tolist()
        u, go = steps(rng.uniform(2.0, 4.0)), rng.uniform(0.3, 0.8)
        side = -side
        speed += (go * np.sin(np.pi * u)).tolist()
        turning += (side * rng.uniform(0.4, 0.9) * np.sin(np.pi * u)).tolist()
    return softened(speed, turning, 0.4)


def bee(duration_s: float, rng: Rng) -> Waypoints:
    """A bee's dance: a run with quick waggles, then round to its start again, by turns to either side."""
    speed: list[float] = []
    turning: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    beat_s, waggle = rng.uniform(1.0, 2.0), rng.uniform(0.4, 0.9)
    while STEP_S * len(speed) < duration_s + 1.0:
        pace, run_s = rng.uniform(0.3, 0.7), rng.uniform(2.0, 5.0)
        t_s = run_s * steps(run_s)
        speed += [pace] * len(t_s)
        turning += (waggle * np.cos(2 * np.pi * t_s / beat_s)).tolist()
        rate, bow = rng.uniform(0.5, 0.95), rng.uniform(0.0, 0.5)
        half = steps((np.pi - 0.5 * bow) / rate)
        back = steps(run_s * rng.uniform(0.7, 1.0))
        home = pace * run_s / (STEP_S * len(back))
        tight = half, 0.6 * pace, np.pi - 0.5 * bow
        for part, now, turn in (tight, (back, home, bow), tight):
            speed += [now] * len(part)
            turning += [side * turn / (STEP_S * len(part))] * len(part)
        side = -side if rng.uniform() < 0.85 else side
    return softened(speed, turning, 0.8)


def statues(duration_s: float, rng: Rng) -> Waypoints:
    """Grandmother's footsteps: stealing on in a curve, frozen when looked at, homewards when far."""
    speed: list[float] = []
    turning: list[float] = []
    x, y, yaw = 0.0, 0.0, 0.0
    while STEP_S * len(speed) < duration_s + 1.0:
        bold, bend = rng.uniform(0.3, 1.3), rng.uniform(-0.6, 0.6)
        quick = rng.uniform(0.4, 1.0)
        for k in range(round(rng.uniform(1.5, 6.0) / STEP_S)):
            if np.hypot(x, y) > HOME_M:
                off = np.arctan2(-y, -x) - yaw
                bend = float(np.clip(1.2 * np.arctan2(np.sin(off), np.cos(off)), -0.9, 0.9))
            speed.append(min(bold, quick * STEP_S * (k + 1)))
            turning.append(bend * speed[-1] / bold)
            yaw += STEP_S * turning[-1]
            x += STEP_S * speed[-1] * np.cos(yaw)
            y += STEP_S * speed[-1] * np.sin(yaw)
        frozen = round(rng.uniform(0.7, 3.5) / STEP_S)
        speed += [0.0] * frozen
        turning += [0.0] * frozen
    return softened(speed, turning, 1.0)


def rower(duration_s: float, rng: Rng) -> Waypoints:
    """A rowing boat round a small lake: a surge with each stroke, then a glide, one oar often stronger."""
    speed: list[float] = []
    turning: list[float] = []
    side, radius = float(rng.choice((-1.0, 1.0))), rng.uniform(1.6, 3.0)
    pace, stroke_s, surge = rng.uniform(0.5, 0.95), rng.uniform(1.8, 3.5), rng.uniform(0.2, 0.45)
    while STEP_S * len(speed) < duration_s + 1.0:
        rests = rng.uniform() < 0.07
        u = steps(stroke_s * rng.uniform(0.85, 1.2))
        drive = rng.uniform(0.3, 0.45)
        surging = np.interp(u, [0.0, drive, 1.0], [-1.0, 1.0, -1.0])
        now = (0.4 if rests else 1.0) * pace * (1 + surge * surging)
        speed += now.tolist()
        oar = rng.normal() * 0.3 * np.sin(np.pi * np.clip(u / drive, 0.0, 1.0))
        turning += (side * now / radius + oar).tolist()
        if rng.uniform() < 0.03:
            side, radius = -side, rng.uniform(1.6, 3.0)
    return softened(speed, turning, 0.6)

"""Paths of driver families that practise something: a dance, babbling wheels, a novice, a camera dolly."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.duty_paths import STEP_S, rounded
from worlds.parts import Rng

MOST_RADPS = 0.95


def dance(duration_s: float, rng: Rng) -> Waypoints:
    """To a beat: a routine of steps ahead and back, turns, promenades and poses; then mirrored, and again."""
    beat_s, in_bar, side = rng.uniform(0.7, 1.2), int(rng.choice((3, 4))), float(rng.choice((-1.0, 1.0)))
    pace, swing = rng.uniform(0.5, 1.0), rng.uniform(0.2, 0.5) * beat_s / (2 * np.pi)
    routine: list[tuple[int, float, float]] = []
    for figure in rng.permutation([0, 1, 2, *rng.integers(0, 4, int(rng.integers(1, 4)))]):
        sway, spin = rng.uniform(-0.25, 0.25), float(rng.choice((-1.0, 1.0))) * rng.uniform(0.5, 0.9)
        steps = [(1, 0.7 * pace, sway), (1, -0.7 * pace, sway)]
        promenade = (int(rng.integers(2, 4)), pace * rng.uniform(0.9, 1.3), 0.6 * spin)
        routine += [steps, [(1, 0.0, spin)], [promenade], [(1, 0.0, 0.0)]][figure]
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s:
        for bars, ahead, around in routine:
            length_s, lively = bars * in_bar * beat_s, rng.uniform(0.85, 1.1)
            t_s = np.arange(0.0, length_s, STEP_S)
            under_way = np.clip(np.minimum(t_s, length_s - t_s) / 1.2, 0.0, 1.0)
            pulse = np.sin(2 * np.pi * t_s / beat_s)
            speed += (under_way * (lively * ahead + float(np.sign(ahead)) * swing * pulse)).tolist()
            turning += (side * under_way * around * (1 + 0.15 * pulse)).tolist()
        side = -side
    return rounded(speed, turning, 0.4)


def babble(duration_s: float, rng: Rng) -> Waypoints:
    """Learning by trying: each wheel at a speed of its own, act after act; kept with changes, or all new."""
    speed: list[float] = []
    turning: list[float] = []
    top, by_mps2, bold = rng.uniform(0.8, 1.7), rng.uniform(0.7, 1.4), rng.uniform(0.1, 0.3)
    wheels, acts, held_s = np.zeros(2), np.zeros((0, 2)), np.zeros(0)
    while STEP_S * len(speed) < duration_s:
        if len(acts) == 0 or rng.uniform() < 0.4:
            n = int(rng.integers(3, 8))
            both = rng.uniform(-0.5, 0.9, (n, 1))
            acts, held_s = both + rng.uniform(-0.8, 0.8, (n, 2)), rng.uniform(0.6, 2.6, n)
        acts = np.clip(acts + rng.normal(0.0, bold, acts.shape), -0.7, 1.0)
        rest_s = rng.uniform(1.2, 2.8)
        for wanted, for_s in zip((*acts, np.zeros(2)), (*held_s, rest_s), strict=True):
            for _ in range(round(for_s / STEP_S)):
                wheels = wheels + np.clip(wanted - wheels, -STEP_S * by_mps2 / top, STEP_S * by_mps2 / top)
                speed.append(top * float(wheels.mean()))
                turning.append(0.65 * float(wheels[1] - wheels[0]))
    return rounded(speed, turning, 0.3)


def novice(duration_s: float, rng: Rng) -> Waypoints:
    """Over a slow link: every new speed and heading is overshot, set right too late, then overshot less."""
    speed: list[float] = []
    turning: list[float] = []
    late = int(rng.integers(4, 11))
    gains = rng.uniform(0.6, 1.1, 2) / (STEP_S * late)
    most, now, wanted = np.array([rng.uniform(0.6, 1.2), MOST_RADPS]), np.zeros(2), np.zeros(2)
    seen, left = [np.zeros(2)] * late, [0, 0]
    while STEP_S * len(speed) < duration_s + 2 * STEP_S:
        if left[0] == 0:
            wanted[0] = 0.0 if rng.uniform() < 0.25 and wanted[0] > 0 else rng.uniform(0.3, 1.4)
            left[0] = round(rng.uniform(3.0, 9.0) / STEP_S)
        if left[1] == 0:
            wanted[1] += float(rng.choice((-1.0, 1.0))) * rng.uniform(0.3, 1.8)
            left[1] = round(rng.uniform(2.5, 8.0) / STEP_S)
        left = [steps - 1 for steps in left]
        seen.append(wanted - now)
        rate = np.clip(gains * seen[-1 - late], -most, most)
        now = now + STEP_S * rate
        speed.append(float(now[0]))
        turning.append(float(rate[1]))
    return rounded(speed, turning, 0.9)


def dolly(duration_s: float, rng: Rng) -> Waypoints:
    """A film camera: push in, pull out, orbit or pan, each of least jerk; a hold; often back again."""
    speed: list[float] = []
    turning: list[float] = []
    shot, ahead, around, length_s = "", 0.0, 0.0, 0.0
    while STEP_S * len(speed) < duration_s:
        if length_s > 0 and rng.uniform() < 0.35:
            ahead, around, length_s = -ahead, -around, length_s * rng.uniform(1.0, 1.5)
            ahead, around = ahead * rng.uniform(0.7, 1.0), around * rng.uniform(0.7, 1.0)
        else:
            shot = rng.choice(("push", "push", "pan")) if shot == "orbit" else "orbit"
            way = rng.choice((-1.0, 1.0), 2)
            peak, far_m, near_m = rng.uniform(0.5, 1.1), rng.uniform(1.5, 4.5), rng.uniform(1.3, 3.5)
            ahead, around = way[0] * peak, way[1] * min(peak / near_m, MOST_RADPS)
            if shot == "push":
                around *= rng.uniform(0.0, 0.3)
            if shot == "pan":
                ahead, around, far_m = 0.0, way[1] * rng.uniform(0.4, 0.9), 0.5 * far_m
            length_s = max(15 / 8 * far_m / peak, 2.5)
        share = np.arange(0.0, 1.0, STEP_S / length_s)
        least_jerk = 16 * share**2 * (1 - share) ** 2
        hold = [0.0] * round(rng.uniform(0.3, 1.8) / STEP_S)
        speed += [*(ahead * least_jerk).tolist(), *hold]
        turning += [*(around * least_jerk).tolist(), *hold]
    return rounded(speed, turning, 0.3)

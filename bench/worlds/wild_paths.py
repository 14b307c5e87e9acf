"""Paths of four more driver families: a moth, a bull, a curler and a scribe."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.parts import Rng

STEP_S = 0.1
MOST = 0.85
"""Steepest change of a hump, m/s² or rad/s²."""
REACH_M = 2.5
"""Farther from the middle of the page than this, the scribe ends a word."""
Pose = tuple[float, float, float]
LETTERS = ((6.28,), (1.5, -1.5), (-1.1, 2.2, -1.1), (-0.8, 6.6, 0.5), (2.3, -0.6, -1.7), (-6.28,))
"""Cursive letters as the angles through which the stroke bends, rad."""


def moved(pose: Pose, speed: list[float], turning: list[float]) -> Pose:
    """Where these steps lead from ``pose``."""
    yaw = pose[2] + STEP_S * np.cumsum(turning)
    x, y = STEP_S * np.dot(speed, np.cos(yaw)), STEP_S * np.dot(speed, np.sin(yaw))
    return pose[0] + float(x), pose[1] + float(y), float(yaw[-1])


def bearing(pose: Pose, x: float, y: float) -> float:
    """Angle from the heading to a point, -π to π."""
    off = np.arctan2(y - pose[1], x - pose[0]) - pose[2]
    return float(np.arctan2(np.sin(off), np.cos(off)))


def hump(amount: float, peak: float) -> list[float]:
    """A half wave of this signed integral: its top about ``peak``, its slope below ``MOST``."""
    top = min(peak, np.sqrt(0.5 * MOST * abs(amount)) + 1e-3)
    u = steps(max(0.5 * np.pi * abs(amount) / top, 0.6))
    return (0.5 * np.pi * amount / (STEP_S * len(u)) * np.sin(np.pi * u)).tolist()


def moth(duration_s: float, rng: Rng) -> Waypoints:
    """A moth about a lamp: fluttering in on it aslant, dazzled off when close, drawn back when far."""
    speed: list[float] = []
    turning: list[float] = []
    pose, lamp = (0.0, 0.0, 0.0), (rng.uniform(1.2, 2.5), rng.uniform(-1.0, 1.0))
    side, flutter, lift = float(rng.choice((-1.0, 1.0))), 0.0, 0.0
    while STEP_S * len(speed) < duration_s + 1.0:
        near = np.hypot(lamp[0] - pose[0], lamp[1] - pose[1])
        aslant = rng.uniform(1.0, 1.5)
        if near < 0.9:
            aslant, side = rng.uniform(2.0, 2.9), float(rng.choice((-1.0, 1.0)))
        if near > 2.8:
            aslant = rng.uniform(0.0, 0.5)
        pace = rng.uniform(0.4, 1.1)
        for _ in range(round(rng.uniform(1.5, 4.5) / STEP_S)):
            flutter = 0.85 * flutter + 0.16 * rng.normal()
            lift = 0.9 * lift + 0.05 * rng.normal()
            off = bearing(pose, *lamp) - side * aslant
            rate = float(np.clip(1.4 * np.arctan2(np.sin(off), np.cos(off)) + flutter, -1.1, 1.1))
            speed.append(float(np.clip(pace * (1.15 - 0.5 * abs(rate)) + lift, 0.05, 1.4)))
            turning.append(rate)
            pose = moved(pose, speed[-1:], turning[-1:])
    return softened(speed, turning, 1.4)


def bull(duration_s: float, rng: Rng) -> Waypoints:
    """A bull in a ring: pawing backwards, a charge past the cape with a hook at its end, a trot about."""
    speed: list[float] = []
    turning: list[float] = []
    pose, ring = (0.0, 0.0, 0.0), rng.uniform(1.5, 3.0)
    while STEP_S * len(speed) < duration_s + 1.0:
        first, way = len(speed), rng.uniform(-np.pi, np.pi)
        cape = ring * np.cos(way), ring * np.sin(way)
        turning += hump(bearing(pose, *cape), rng.uniform(0.6, 1.0))
        speed += [rng.uniform(0.0, 0.1)] * (len(turning) - first)
        for _ in range(int(rng.integers(0, 4))):
            paw = hump(-rng.uniform(0.2, 0.6), rng.uniform(0.3, 0.6)) + hump(rng.uniform(0.05, 0.2), 0.3)
            speed += paw
            turning += (rng.uniform(-0.4, 0.4) * np.sin(2 * np.pi * steps(STEP_S * len(paw)))).tolist()
        far = np.hypot(cape[0] - pose[0], cape[1] - pose[1]) + rng.uniform(0.3, 1.0)
        charge = hump(far, rng.uniform(0.9, 1.45))
        hook = np.clip((np.linspace(0.0, 1.0, len(charge)) - 0.6) / 0.4, 0.0, 1.0)
        speed += charge
        turning += (rng.uniform(-1.0, 1.0) * np.sin(np.pi * hook)).tolist()
        pose = moved(pose, speed[first:], turning[first:])
        u, bend = steps(rng.uniform(2.5, 6.0)), np.sign(bearing(pose, 0.0, 0.0)) * rng.uniform(0.3, 0.8)
        trot = rng.uniform(0.35, 0.7) * np.sin(np.pi * u) * (1 + 0.15 * np.sin(12 * np.pi * u))
        speed += trot.tolist()
        turning += (bend * np.sin(np.pi * u)).tolist()
        pose = moved(pose, trot.tolist(), turning[-len(u) :])
    return softened(speed, turning, 0.7)


def curler(duration_s: float, rng: Rng) -> Waypoints:
    """Curling: a stone drawn back, pushed off, gliding slower and bending more, then fetched home."""
    speed: list[float] = []
    turning: list[float] = []
    pose, rink = (0.0, 0.0, 0.0), rng.uniform(3.0, 6.0)
    while STEP_S * len(speed) < duration_s + 1.0:
        first, pace = len(speed), rng.uniform(0.8, 1.4)
        speed += hump(-rng.uniform(0.15, 0.5), 0.35)
        push, glide = steps(pace / rng.uniform(0.5, 0.7)), steps(2.0 * rink * rng.uniform(0.7, 1.1) / pace)
        speed += (pace * push).tolist() + (pace * (1.0 - glide) ** rng.uniform(0.8, 1.4)).tolist()
        turning += [0.0] * (len(speed) - first - len(glide))
        curl = float(rng.choice((-1.0, 1.0))) * rng.uniform(0.05, 0.35)
        turning += (curl * np.sin(np.pi * glide**2)).tolist()
        rest = round(rng.uniform(0.5, 2.0) / STEP_S)
        speed += [0.0] * rest
        turning += [0.0] * rest
        pose = moved(pose, speed[first:], turning[first:])
        for home, about in ((True, 0.0), (False, rng.uniform(-0.4, 0.4))):
            back = len(speed)
            off = about - pose[2]
            swing = bearing(pose, 0.0, 0.0) if home else float(np.arctan2(np.sin(off), np.cos(off)))
            turning += hump(swing, 0.9)
            speed += [0.0] * (len(turning) - back)
            if home:
                speed += hump(float(np.hypot(pose[0], pose[1])), rng.uniform(0.7, 1.2))
                turning += [0.0] * (len(speed) - len(turning))
            pose = moved(pose, speed[back:], turning[back:])
    return softened(speed, turning, 0.8)


def scribe(duration_s: float, rng: Rng) -> Waypoints:
    """Cursive writing: loops and garlands, slowed where the stroke bends, then a move to the next line."""
    speed: list[float] = []
    turning: list[float] = []
    pose, spread, ink = (0.0, 0.0, 0.0), rng.uniform(0.6, 1.4), rng.uniform(0.3, 0.55)
    while STEP_S * len(speed) < duration_s + 1.0:
        for letter in rng.integers(0, len(LETTERS), int(rng.integers(2, 6))):
            first, tall = len(speed), rng.uniform(0.8, 1.2)
            for bend in LETTERS[letter]:
                stroke = np.array(hump(bend, rng.uniform(0.7, 1.05)))
                turning += stroke.tolist()
                speed += np.clip(tall * ink / np.sqrt(np.abs(stroke) + 0.25), 0.1, 1.1).tolist()
            pose = moved(pose, speed[first:], turning[first:])
            if np.hypot(pose[0], pose[1]) > REACH_M:
                break
        first, lifted = len(speed), round(rng.uniform(0.2, 1.2) / STEP_S)
        start = rng.uniform(-1.0, 1.0) * spread, rng.uniform(-1.2, 1.2) * spread
        turning += [0.0] * lifted + hump(bearing(pose, *start), 0.9)
        speed += [0.0] * (len(turning) - len(speed))
        speed += hump(float(np.hypot(start[0] - pose[0], start[1] - pose[1])), rng.uniform(0.6, 1.1))
        turning += [0.0] * (len(speed) - len(turning))
        pose = moved(pose, speed[first:], turning[first:])
    return softened(speed, turning, 1.8)

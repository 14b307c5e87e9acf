"""Paths of four more driver families: a fencer, a lighthouse, a rally car and a swing."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.parts import Rng

STEP_S = 0.1
HOME_M = 3.5
"""Farther from the start than this, each of them turns for home when it next can."""


def homewards(speed: list[float], turning: list[float]) -> tuple[float, float]:
    """How far the start is after these steps, and by what angle to the left of the nose it lies."""
    yaw = STEP_S * np.cumsum(turning)
    x, y = (STEP_S * float(np.sum(np.asarray(speed) * u)) for u in (np.cos(yaw), np.sin(yaw)))
    off = np.arctan2(-y, -x) - (yaw[-1] if len(yaw) else 0.0)
    return float(np.hypot(x, y)), float(np.arctan2(np.sin(off), np.cos(off)))


def fencer(duration_s: float, rng: Rng) -> Waypoints:
    """A fencer: on guard, small steps to and fro, a sudden lunge, springing back, circling round."""
    speed: list[float] = []
    turning: list[float] = []
    quick = rng.uniform(0.8, 1.2)

    def move(reach: float, length_s: float, swing: float) -> None:
        """One step, lunge or retreat over a reach (m, back if negative) with a swing of the heading."""
        hump = 0.5 * np.pi * np.sin(np.pi * steps(length_s)) / length_s
        speed.extend((reach * hump).tolist())
        turning.extend((swing * hump).tolist())

    while STEP_S * len(speed) < duration_s + 1.0:
        for _ in range(int(rng.integers(2, 6))):
            ahead = 1.0 if rng.uniform() < 0.6 else -1.0
            move(ahead * rng.uniform(0.25, 0.5), rng.uniform(1.1, 1.7) / quick, rng.uniform(-0.5, 0.5))
        guard = round(rng.uniform(0.3, 1.5) / STEP_S)
        speed += [0.0] * guard
        turning += [0.0] * guard
        lunge = rng.uniform(0.8, 1.6)
        move(lunge, lunge / rng.uniform(0.6, 0.8), rng.uniform(-0.3, 0.3))
        move(-lunge * rng.uniform(0.6, 1.2), lunge / rng.uniform(0.4, 0.6), rng.uniform(-0.9, 0.9))
        far, off = homewards(speed, turning)
        swing = off if far > HOME_M else float(rng.choice((-1.0, 1.0))) * rng.uniform(0.8, 2.6)
        move(rng.uniform(0.3, 1.2), max(0.6 + abs(swing) / rng.uniform(0.45, 0.65), 1.6), swing)
    return softened(speed, turning, 0.3)


def lighthouse(duration_s: float, rng: Rng) -> Waypoints:
    """A lamp that sweeps its beam round nearly on the spot, blinks, and sails straight to the next rock."""
    speed: list[float] = []
    turning: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    while STEP_S * len(speed) < duration_s + 1.0:
        creep, beam = rng.uniform(0.0, 0.2), rng.uniform(0.4, 1.05)
        for _ in range(int(rng.integers(1, 4))):
            lit, dark = round(rng.uniform(1.2, 3.5) / STEP_S), round(rng.uniform(0.2, 1.0) / STEP_S)
            speed += [creep] * lit + [0.0] * dark
            turning += [side * beam] * lit + [0.0] * dark
            side = -side if rng.uniform() < 0.3 else side
        far, off = homewards(speed, turning)
        if far > HOME_M:
            last = round(abs(off) / (0.9 * STEP_S))
            speed += [creep] * last
            turning += [0.9 * float(np.sign(off))] * last
        sail = steps(rng.uniform(3.0, 5.5))
        speed += (rng.uniform(0.5, 1.3) * np.clip(3 * np.sin(np.pi * sail), 0.0, 1.0)).tolist()
        turning += (rng.uniform(-0.2, 0.2) * np.sin(2 * np.pi * sail)).tolist()
    return softened(speed, turning, 0.8)


def rally(duration_s: float, rng: Rng) -> Waypoints:
    """A rally car: flat out, hard on the brakes, a flick to the wrong side, round the bend, flat out."""
    speed: list[float] = []
    turning: list[float] = []
    now, bold = 0.3, rng.uniform(1.1, 1.45)
    while STEP_S * len(speed) < duration_s + 1.0:
        top, slow = bold * rng.uniform(0.75, 1.0), rng.uniform(0.35, 0.75)
        straight, brake = steps(rng.uniform(1.5, 3.5)), steps(rng.uniform(0.6, 1.1))
        speed += np.minimum(now + (top - now) * 1.6 * straight, top).tolist()
        turning += (rng.normal() * 0.12 * np.sin(2 * np.pi * straight)).tolist()
        speed += (speed[-1] + (slow - speed[-1]) * brake).tolist()
        turning += [0.0] * len(brake)
        far, off = homewards(speed, turning)
        bend = off if far > HOME_M else float(rng.choice((-1.0, 1.0))) * rng.uniform(0.7, 2.6)
        side, rate = float(np.sign(bend)), rng.uniform(0.6, 1.0)
        flick = round(rng.uniform(0.3, 0.7) / STEP_S)
        apex = round((abs(bend) + 0.6 * STEP_S * flick) / (rate * STEP_S))
        speed += [slow] * (flick + apex)
        turning += [-0.6 * side] * flick + [rate * side] * apex
        now = slow
    return softened(speed, turning, 0.5)


def swing(duration_s: float, rng: Rng) -> Waypoints:
    """A swing: to and fro on an arc, higher with each push, then dying away; a stroll to the next one."""
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s + 1.0:
        beat_s, height = rng.uniform(3.5, 6.5), rng.uniform(0.7, 1.4)
        beats, top = int(rng.integers(3, 6)), rng.uniform(0.4, 0.7)
        u = steps(beat_s * beats)
        high = height * np.interp(u, [0.0, top, 1.0], [0.15, 1.0, 0.1])
        angle = 2 * np.pi * beats * u
        side, arc = float(rng.choice((-1.0, 1.0))), rng.uniform(0.2, 0.7)
        twist = rng.uniform(-0.5, 0.5)
        speed += (high * np.sin(angle)).tolist()
        turning += (side * arc * high * np.sin(angle) + twist * np.cos(angle) ** 2).tolist()
        far, off = homewards(speed, turning)
        bend = off if far > HOME_M else -side * rng.uniform(0.8, 2.6)
        round_s, go = 0.6 + abs(bend) / rng.uniform(0.4, 0.65), rng.uniform(0.4, 0.9)
        stroll = round(rng.uniform(1.5, 4.0) / STEP_S)
        turn = 0.5 * np.pi * bend / round_s * np.sin(np.pi * steps(round_s))
        speed += [0.5 * go] * len(turn) + [go] * stroll
        turning += turn.tolist() + [0.0] * stroll
    return softened(speed, turning, 0.6)

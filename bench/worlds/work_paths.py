"""Paths of the driver families that the eighth report held out: mail, a polisher, squares, a painted line."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng, in_parts


def mail(duration_s: float, rng: Rng) -> Waypoints:
    """A push, then coasting: the speed decays along a bend until the next push; now and then a stop."""
    step_s, speed, turning, now = 0.1, [], [], 0.0
    while step_s * len(speed) < duration_s:
        top, decay_s, push_mps2 = rng.uniform(0.8, 1.8), rng.uniform(3.0, 9.0), rng.uniform(0.4, 1.2)
        floor = 0.0 if rng.uniform() < 0.3 else rng.uniform(0.25, 0.6) * top
        bend = rng.uniform(-0.45, 0.45)
        push = np.arange(now, max(top, now + 0.1), step_s * push_mps2)
        coast = push[-1] * np.exp(-np.arange(0.0, rng.uniform(0.4, 1.2) * decay_s, step_s) / decay_s)
        brake = np.arange(coast[-1], floor, -step_s * 0.8)
        stand = np.zeros(round(rng.uniform(1.0, 4.0) / step_s) if floor == 0.0 else 0)
        leg = np.concatenate([push, coast, brake, stand])
        speed += leg.tolist()
        turning += (bend * leg).tolist()
        now = float(leg[-1])
    smooth = np.convolve(np.pad(turning, 4, mode="edge"), np.full(9, 1 / 9), mode="valid")
    t_s = step_s * np.arange(len(speed))
    return Waypoints(tuple(t_s.tolist()), tuple(map(float, speed)), tuple(smooth.tolist()))


def polisher(duration_s: float, rng: Rng) -> Waypoints:
    """Orbit after orbit of a drifting circle, quicker on one side of it; the other way about at each wall."""
    step_s, speed, turning = 0.1, [], []
    side = float(rng.choice((-1.0, 1.0)))
    while step_s * len(speed) < duration_s:
        rate, pace, uneven = rng.uniform(0.35, 0.9), rng.uniform(0.4, 1.0), rng.uniform(0.1, 0.45)
        phase = np.arange(0.0, 2 * np.pi * rng.uniform(1.5, 4.0), step_s * rate)
        into = np.minimum(1.0, np.minimum(np.arange(len(phase)), np.arange(len(phase))[::-1]) * step_s / 1.2)
        speed += (pace * (1 + uneven * np.sin(phase)) * (0.25 + 0.75 * into)).tolist()
        turning += (side * rate * into).tolist()
        side = -side
    t_s = step_s * np.arange(len(speed))
    smooth = np.convolve(np.pad(speed, 4, mode="edge"), np.full(9, 1 / 9), mode="valid")
    return Waypoints(tuple(t_s.tolist()), tuple(smooth.tolist()), tuple(map(float, turning)))


def squares(duration_s: float, rng: Rng) -> Waypoints:
    """A calibration drive: a square one way, then the other way; corners on the spot or rounded."""
    way, parts = float(rng.choice((-1.0, 1.0))), []
    while sum(length for length, *_ in parts) < duration_s:
        pace, side_m, rate = rng.uniform(0.4, 1.3), rng.uniform(1.5, 4.0), rng.uniform(0.4, 0.9)
        stops = rng.uniform() < 0.6
        wait = (rng.uniform(0.6, 1.5), 0.0, 0.0)
        corner = (0.5 * np.pi / rate + 0.3, 0.0 if stops else 0.4 * pace, way * rate)
        for _ in range(4):
            parts.append((side_m / pace + 0.5, pace, 0.0))
            parts += [wait, corner, wait] if stops else [corner]
        parts.append((rng.uniform(1.5, 4.0), 0.0, 0.0))
        way = -way
    return in_parts(parts, rng)


def line(duration_s: float, rng: Rng) -> Waypoints:
    """Along a painted line with bends by a two-point sensor: the yaw rate ripples; slower while it bends."""
    step_s, n = 0.05, int(duration_s / 0.05) + 2
    pace, slows, ripple = rng.uniform(0.5, 1.4), rng.uniform(0.2, 0.6), rng.uniform(0.06, 0.3)
    period_s, lag_s = rng.uniform(0.7, 2.0), rng.uniform(0.15, 0.4)
    bend, lasts_s, side = 0.0, 0.0, 1.0
    speed, turning = np.full(n, pace), np.zeros(n)
    for k in range(1, n):
        lasts_s -= step_s
        if lasts_s <= 0:
            bend = rng.uniform(0.15, 0.6) * rng.choice((-1.0, 0.0, 0.0, 1.0))
            lasts_s = rng.uniform(2.0, 7.0)
        if rng.uniform() < 2 * step_s / period_s:
            side = -side
        wanted = pace * (1 - slows * min(1.0, abs(bend) / 0.4))
        speed[k] = speed[k - 1] + np.clip(wanted - speed[k - 1], -0.8 * step_s, 0.5 * step_s)
        turning[k] = turning[k - 1] + step_s / lag_s * (bend + ripple * side - turning[k - 1])
    t_s = step_s * np.arange(n)
    return Waypoints(tuple(t_s.tolist()), tuple(speed.tolist()), tuple(turning.tolist()))

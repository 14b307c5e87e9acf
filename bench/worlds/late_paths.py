"""Paths of the driver families that the fifth, the sixth and the seventh report held out."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.parts import Rng, in_parts

MOST_RADPS = 0.9
"""What a figure's tightest bends come near."""


def sweeper(duration_s: float, rng: Rng) -> Waypoints:
    """Slowly along edges with small corrections, corners on the spot; at times a tight spiral outwards."""
    side, parts = float(rng.choice((-1.0, 1.0))), []
    while sum(length for length, *_ in parts) < duration_s:
        pace, rate = rng.uniform(0.3, 0.7), rng.uniform(0.5, 1.0)
        sways = rng.uniform(-0.12, 0.12, int(rng.integers(3, 7)))
        parts += [(rng.uniform(1.0, 2.5), pace, sway) for sway in sways]
        if rng.uniform() < 0.3:
            parts += [(1.5, 0.7 * pace, side * turning) for turning in np.linspace(1.0, 0.3, 8)]
        parts += [(0.6, 0.0, 0.0), (0.5 * np.pi / rate + 0.4, 0.0, side * rate)]
    return in_parts(parts, rng)


def tug(duration_s: float, rng: Rng) -> Waypoints:
    """A train in tow: slow ramps to a high speed, long wide curves both ways, gentle stops, a little back."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        top = rng.uniform(1.1, 1.8)
        for _ in range(int(rng.integers(2, 5))):
            speed, radius = top * rng.uniform(0.85, 1.0), rng.uniform(4.0, 15.0)
            parts.append((rng.uniform(4.0, 9.0), speed, float(rng.choice((-1.0, 1.0))) * speed / radius))
        parts.append((rng.uniform(5.0, 8.0), 0.0, 0.0))
        if rng.uniform() < 0.7:
            parts.append((rng.uniform(2.0, 4.0), -rng.uniform(0.15, 0.35), 0.0))
            parts.append((rng.uniform(1.5, 3.0), 0.0, 0.0))
    return in_parts(parts, rng, (0.2, 0.45), (0.1, 0.3))


def guard(duration_s: float, rng: Rng) -> Waypoints:
    """Long straight beats, each at a constant speed of its own; a stop, a full or a half turn, a wait."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        rate = rng.uniform(0.6, 1.0)
        turn = rng.choice((np.pi, 2 * np.pi)) + rng.uniform(-0.3, 0.3)
        parts += [
            (rng.uniform(5.0, 12.0), rng.uniform(0.5, 1.5), 0.0),
            (rng.uniform(1.0, 2.5), 0.0, 0.0),
            (turn / rate, 0.0, float(rng.choice((-1.0, 1.0))) * rate),
            (rng.uniform(0.8, 4.0), 0.0, 0.0),
        ]
    return in_parts(parts, rng)


def chase(duration_s: float, rng: Rng) -> Waypoints:
    """Sprints in a zig-zag of hard turns to alternating sides, sudden stops, at times a short reversal."""
    side, parts = float(rng.choice((-1.0, 1.0))), []
    while sum(length for length, *_ in parts) < duration_s:
        sprint = rng.uniform(1.0, 1.8)
        for _ in range(int(rng.integers(2, 7))):
            speed, turning = sprint * rng.uniform(0.8, 1.0), side * rng.uniform(0.4, 1.0)
            parts.append((rng.uniform(0.8, 2.2), speed, turning))
            side = -side
        parts.append((rng.uniform(0.9, 2.0), 0.0, 0.0))
        if rng.uniform() < 0.5:
            parts.append((rng.uniform(0.8, 1.8), -rng.uniform(0.4, 0.9), rng.uniform(-0.4, 0.4)))
    return in_parts(parts, rng, (1.2, 2.0), (1.5, 3.0))


def convoy(duration_s: float, rng: Rng) -> Waypoints:
    """In a queue: at walking pace, creeping, standing; clear stretches with a change of lane or a bend."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        for _ in range(int(rng.integers(2, 6))):
            pace = rng.choice((0.1, 0.3, 0.5)) * rng.uniform(0.8, 1.3)
            parts.append((rng.uniform(1.0, 4.0), pace, rng.uniform(-0.05, 0.05)))
            if rng.uniform() < 0.5:
                parts.append((rng.uniform(0.8, 3.0), 0.0, 0.0))
        clear, side, swerve = rng.uniform(0.9, 1.7), float(rng.choice((-1.0, 1.0))), rng.uniform(0.2, 0.5)
        parts.append((rng.uniform(2.0, 6.0), clear, 0.0))
        if rng.uniform() < 0.5:
            parts += [(1.2, clear, side * swerve), (1.2, clear, -side * swerve)]
        else:
            parts.append((rng.uniform(2.0, 4.0), 0.6 * clear, side * swerve))
    return in_parts(parts, rng)


def sweeps(duration_s: float, rng: Rng) -> Waypoints:
    """A tester's drive: sines of rising frequency in the speed, then in the yaw rate, and holds between."""
    step_s, speed, turning = 0.1, [], []
    while step_s * len(speed) < duration_s:
        t_s = np.arange(0.0, rng.uniform(10.0, 18.0), step_s)
        phase = 2 * np.pi * np.cumsum(step_s * np.linspace(0.06, rng.uniform(0.25, 0.6), len(t_s)))
        mean, swing = rng.uniform(0.5, 1.2), rng.uniform(0.2, 0.6)
        ahead = rng.uniform() < 0.5
        speed += list(mean + swing * np.sin(phase) * ahead)
        turning += list(rng.uniform(-0.15, 0.15) + rng.uniform(0.3, 0.7) * np.sin(phase) * (not ahead))
        held = round(rng.uniform(1.0, 3.0) / step_s)
        speed += [mean] * held
        turning += [0.0] * held
    t_s = step_s * np.arange(len(speed))
    return Waypoints(tuple(t_s.tolist()), tuple(map(float, speed)), tuple(map(float, turning)))


def backwards(duration_s: float, rng: Rng) -> Waypoints:
    """Mostly in reverse along long bends; a little ahead to straighten, a stop before each change of way."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        pace = rng.uniform(0.4, 1.1)
        for _ in range(int(rng.integers(1, 4))):
            speed = -pace * rng.uniform(0.8, 1.0)
            parts.append((rng.uniform(3.0, 8.0), speed, rng.uniform(-0.4, 0.4)))
        stop = (rng.uniform(0.6, 1.5), 0.0, 0.0)
        parts += [stop, (rng.uniform(1.0, 3.0), 0.7 * pace, rng.uniform(-0.5, 0.5)), stop]
    return in_parts(parts, rng)


def stations(duration_s: float, rng: Rng) -> Waypoints:
    """Round a machine at a constant radius with a stop at each station; at times the other way about."""
    radius, pace, side, parts = rng.uniform(1.5, 3.5), rng.uniform(0.5, 1.3), 1.0, []
    while sum(length for length, *_ in parts) < duration_s:
        for _ in range(int(rng.integers(2, 5))):
            speed = pace * rng.uniform(0.7, 1.1)
            parts.append((rng.uniform(2.0, 6.0), speed, side * speed / radius))
            parts.append((rng.uniform(1.0, 4.0), 0.0, 0.0))
        if rng.uniform() < 0.5:
            turn = rng.uniform(0.5, 0.9)
            parts += [(np.pi / turn, 0.0, side * turn), (0.8, 0.0, 0.0)]
            side = -side
    return in_parts(parts, rng)


def crowd(duration_s: float, rng: Rng) -> Waypoints:
    """Through people: Ornstein-Uhlenbeck speed reflected at zero, swerves that come back, short halts."""
    step_s, mean, spread = 0.2, rng.uniform(0.5, 0.9), rng.uniform(0.25, 0.4)
    keep = np.exp(-step_s / rng.uniform(1.5, 4.0))
    n = int(duration_s / step_s) + 2
    wish, heading, halt_s, pace, turning = mean, 0.0, 0.0, np.zeros(n), np.zeros(n)
    for k in range(1, n):
        wish = abs(mean + keep * (wish - mean) + spread * np.sqrt(1 - keep**2) * rng.normal())
        halt_s = rng.uniform(0.6, 2.0) if rng.uniform() < step_s / 9.0 else halt_s - step_s
        heading = rng.uniform(-1.5, 1.5) if rng.uniform() < step_s / 12.0 else heading
        walks = halt_s <= 0
        pace[k] = pace[k - 1] + np.clip(walks * wish - pace[k - 1], -0.24, 0.2)
        turning[k] = 0.85 * turning[k - 1] + walks * (0.13 * rng.normal() - 0.08 * heading)
        heading += step_s * turning[k]
    t_s = step_s * np.arange(n)
    return Waypoints(tuple(t_s.tolist()), tuple(pace.tolist()), tuple(turning.tolist()))


def figures(duration_s: float, rng: Rng) -> Waypoints:
    """Round a Lissajous curve without a cusp, slower where it bends; its pace swells, it never stops."""
    a, b = ((1, 2), (2, 1), (2, 3), (3, 2))[int(rng.integers(4))]
    phase = 0.5 * np.pi / b * (b - a + 1 + rng.uniform(-0.25, 0.25))
    width, aspect, way = rng.uniform(2.5, 5.0), rng.uniform(0.75, 1.33), float(rng.choice((-1.0, 1.0)))
    height, pace, swell_s = width * aspect, rng.uniform(0.6, 1.3), rng.uniform(15.0, 40.0)
    step_s, u, speed, turning = 0.05, rng.uniform(0.0, 2 * np.pi), [], []
    while step_s * len(speed) <= duration_s:
        on, up = a * u + phase, b * u
        dx, dy = width * a * np.cos(on), height * b * np.cos(up)
        ddx, ddy = -width * a**2 * np.sin(on), -height * b**2 * np.sin(up)
        along, curvature = np.hypot(dx, dy), (dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3
        now = pace * (1 + 0.25 * np.sin(2 * np.pi * step_s * len(speed) / swell_s))
        speed.append(now / np.hypot(1.0, curvature * now / MOST_RADPS))
        turning.append(way * curvature * speed[-1])
        u += step_s * speed[-1] / along
    t_s = step_s * np.arange(len(speed))
    return Waypoints(tuple(t_s.tolist()), tuple(map(float, speed)), tuple(map(float, turning)))


def shunting(duration_s: float, rng: Rng) -> Waypoints:
    """Back and forth, nearly straight, at any speed, with long pauses; at times over to another track."""
    way, parts = 1.0, []
    while sum(length for length, *_ in parts) < duration_s:
        for _ in range(int(rng.integers(2, 6))):
            speed = way * rng.uniform(0.25, 1.4)
            parts.append((rng.uniform(2.0, 6.0), speed, rng.uniform(-0.03, 0.03)))
            parts.append((rng.uniform(1.5, 5.0), 0.0, 0.0))
            way = -way
        points, side = rng.uniform(0.4, 0.8), float(rng.choice((-1.0, 1.0))) * rng.uniform(0.2, 0.5)
        parts += [(2.0, way * points, side), (2.0, way * points, -side), (rng.uniform(1.5, 5.0), 0.0, 0.0)]
        way = -way
    return in_parts(parts, rng, (0.3, 0.9))


def ladder(duration_s: float, rng: Rng) -> Waypoints:
    """A tester's speeds in steps, up and down again, each held along a long gentle curve; some in reverse."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        way, top = (-1.0, rng.uniform(0.5, 1.0)) if rng.uniform() < 0.35 else (1.0, rng.uniform(0.9, 1.8))
        up = np.linspace(rng.uniform(0.1, 0.3), top, int(rng.integers(3, 6)))
        radius, held_s = float(rng.choice((-1.0, 1.0))) * rng.uniform(4.0, 15.0), rng.uniform(2.5, 5.0)
        parts += [(held_s, way * speed, way * speed / radius) for speed in (*up, *up[-2::-1])]
        parts.append((1.0, 0.0, 0.0))
    return in_parts(parts, rng, (0.3, 0.8))

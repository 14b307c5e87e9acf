"""Paths of four more driver families: a barrel racer, a half-pipe, a trout and a comet."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.parts import Rng

STEP_S = 0.1
GATE_AND_BARRELS = np.array(((0.0, 0.0), (1.0, -0.8), (1.0, 0.8), (1.9, 0.0)))
"""Where a barrel racer turns, before it is scaled, and to which hand it rounds each."""
HANDS = (1.0, 1.0, -1.0, -1.0)


def wrapped(angle: float) -> float:
    """The same direction within ±π."""
    return float(np.angle(np.exp(1j * angle)))


def barrel_racer(duration_s: float, rng: Rng) -> Waypoints:
    """Barrel racing: sprints between three barrels and a gate, reined in to go tightly round each."""
    speed: list[float] = []
    turning: list[float] = []
    marks = rng.uniform(2.2, 3.6) * (GATE_AND_BARRELS + rng.uniform(-0.12, 0.12, (4, 2)))
    side, top, rein = float(rng.choice((-1.0, 1.0))), rng.uniform(1.0, 1.45), rng.uniform(0.3, 0.55)
    radius, now, yaw, k, turned, least = rng.uniform(0.6, 0.85), 0.0, rng.uniform(-3.0, 3.0), 1, 0.0, 2.0
    x, y = marks[0]
    while STEP_S * len(speed) < duration_s + 1.0:
        goal, hand = marks[(k + (turned > 0.0)) % 4], side * HANDS[(k + (turned > 0.0)) % 4]
        far = float(np.hypot(goal[0] - x, goal[1] - y))
        passing = hand * np.arcsin(min(radius / max(far, radius), 1.0))
        off = wrapped(np.arctan2(goal[1] - y, goal[0] - x) - passing - yaw)
        if turned > least and abs(off) < 0.3:
            k, turned, least = k + 1, 0.0, rng.uniform(1.5, 2.8)
        if turned > 0.0:
            most, rate = 0.85 * radius, side * HANDS[k % 4] * now / radius
            turned += STEP_S * abs(rate)
        else:
            reined = np.sqrt((0.8 * radius) ** 2 + 2 * rein * max(far - radius, 0.0))
            most, rate = min(top, reined) if abs(off) < 0.6 else 0.8 * radius, 1.5 * off
            turned = 1e-3 if far < radius + 0.15 else 0.0
        now += float(np.clip(most - now, -0.08, 0.06))
        speed.append(now)
        turning.append(float(np.clip(rate, -0.95, 0.95)))
        yaw += STEP_S * turning[-1]
        x, y = x + STEP_S * now * np.cos(yaw), y + STEP_S * now * np.sin(yaw)
    return softened(speed, turning, 1.0)


def half_pipe(duration_s: float, rng: Rng) -> Waypoints:
    """A skater in a half-pipe: swings pumped ever higher, back down tail first or after a turn on the lip."""
    speed: list[float] = []
    turning: list[float] = []
    swing_s, way, lean, along, facing = rng.uniform(3.8, 5.2), 1.0, 0.0, 0.0, 1.0
    highest, height, pump = 0.85 * swing_s / np.pi, rng.uniform(0.3, 0.6), rng.uniform(1.1, 1.4)
    while STEP_S * len(speed) < duration_s + 1.0:
        u = steps(swing_s)
        peak = min(height, highest) * rng.uniform(0.92, 1.08)
        across = facing * way
        carve = float(np.clip(-0.15 * across * along + rng.normal() * 0.6, -0.9, 0.9)) - lean
        speed += (way * min(peak, 1.45) * np.sin(np.pi * u)).tolist()
        turning += (0.5 * np.pi * carve / swing_s * np.sin(np.pi * u)).tolist()
        along += across * 2 / np.pi * peak * swing_s * np.sin(lean + 0.5 * carve)
        lean += carve
        if rng.uniform() < 0.4:
            half = np.sin(np.pi * steps(np.pi**2 / 2 / rng.uniform(0.85, 1.0)))
            speed += (0.1 * way * half).tolist()
            turning += (float(rng.choice((-1.0, 1.0))) * np.pi * half / half.sum() / STEP_S).tolist()
            facing = -facing
        else:
            way = -way
        height *= pump if rng.uniform() < 0.9 and height < highest else rng.uniform(0.4, 0.8)
    return softened(speed, turning, 0.4)


def trout(duration_s: float, rng: Rng) -> Waypoints:
    """A trout: wavering on its station, then a dart at a fly and a drift back tail first, or a wide loop."""
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s + 1.0:
        wait, fast, bow = steps(rng.uniform(0.8, 2.2)), rng.uniform(0.7, 1.35), rng.uniform(-0.7, 0.7)
        speed += (0.1 * np.sin(2 * np.pi * wait)).tolist()
        turning += (0.35 * rng.normal() * np.sin(2 * np.pi * wait)).tolist()
        if rng.uniform() < 0.3:
            angle = np.copysign(2 * np.pi + 0.6 * rng.normal(), bow)
            fled = np.interp(steps(abs(angle) / rng.uniform(0.6, 0.85)), [0.0, 0.25, 1.0], [0.0, fast, 0.0])
            speed += fled.tolist()
            turning += (angle / (STEP_S * len(fled)) * np.minimum(8.0 * fled / fast, 1.0)).tolist()
            continue
        dart_s = np.pi * fast / rng.uniform(0.6, 0.85)
        dart = fast * np.sin(np.pi * steps(dart_s))
        drift = np.sin(np.pi * steps(dart_s * rng.uniform(1.0, 1.8)))
        drift *= -rng.uniform(0.9, 1.1) * dart.sum() / drift.sum()
        speed += np.concatenate((dart, drift)).tolist()
        turning += (bow * np.concatenate((dart, drift))).tolist()
    return softened(speed, turning, 0.7)


def comet(duration_s: float, rng: Rng) -> Waypoints:
    """A comet: fast and tight past its sun, slow far out, where the pull of planets changes its orbit."""
    speed: list[float] = []
    turning: list[float] = []
    near, fast, oval = rng.uniform(0.9, 1.3), rng.uniform(1.0, 1.3), rng.uniform(0.4, 0.6)
    pull, power = fast**2 * near ** rng.uniform(1.0, 1.05) / (1 + oval), rng.uniform(1.9, 2.15)
    place = near * np.exp(1j * rng.uniform(0.0, 2 * np.pi))
    going = 1j * float(rng.choice((-1.0, 1.0))) * fast * place / near
    outward, slow = True, 0.0
    while STEP_S * len(speed) < duration_s + 1.0:
        for _ in range(4):
            going -= 0.25 * STEP_S * pull * place / abs(place) ** (power + 1)
            place += 0.25 * STEP_S * going
        speed.append(float(abs(going)))
        sun = -pull * place / abs(place) ** (power + 1)
        turning.append(float((going.conjugate() * sun).imag) / abs(going) ** 2)
        leaving = float((place.conjugate() * going).real) > 0.0
        if outward and not leaving:
            slow = slow or float(abs(going))
            going *= rng.uniform(0.94, 1.2) * slow / abs(going)
        outward = leaving
    return softened(speed, turning, 0.6)

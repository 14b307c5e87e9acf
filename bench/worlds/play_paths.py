"""Paths of four more driver families: teacups, a micromouse, a glider and a sumo wrestler."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.parts import Rng
from worlds.signal_paths import homewards

STEP_S = 0.1
MOST_MPS = 0.98
MOST_RADPS = 1.08
CELLS = 2
"""Cells of the maze to each side of its middle."""
AWAY_M = 4.0
"""Farther from the start than this, a glider heads home; a wrestler does so at half of it."""


def within_limits(speed: list[float], turning: list[float], over_s: float) -> Waypoints:
    """References within the limits, averaged under a bell of this length."""
    fast = np.clip(speed, -MOST_MPS, MOST_MPS).tolist()
    return softened(fast, np.clip(turning, -MOST_RADPS, MOST_RADPS).tolist(), over_s)


def teacups(duration_s: float, rng: Rng) -> Waypoints:
    """A fairground ride: a cup on a turning table, each ride the other way about, some tail first."""
    speed: list[float] = []
    turning: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    while STEP_S * len(speed) < duration_s + 1.0:
        u = steps(rng.uniform(14.0, 24.0))
        table, cup = rng.uniform(0.25, 0.4), float(rng.choice((-0.6, 0.9))) * rng.uniform(0.8, 1.2)
        pace, share = rng.uniform(0.35, 0.65), rng.uniform(0.3, 0.5)
        going = np.clip(np.minimum(u, 1 - u) / 0.2, 0.0, 1.0)
        tau = STEP_S * np.cumsum(going)
        arm = share * np.exp(1j * ((cup - table) * tau + rng.uniform(0.0, 6.28)))
        rate = np.real((table + cup * arm) / (1 + arm))
        way = -1.0 if rng.uniform() < 0.25 else 1.0
        speed += (way * pace * np.abs(1 + arm) * going).tolist()
        turning += (side * rate * going).tolist()
        held = round(rng.uniform(0.5, 1.5) / STEP_S)
        speed += [0.0] * held
        turning += [0.0] * held
        side = -side
    return within_limits(speed, turning, 0.8)


def maze(rng: Rng, legs: int) -> list[tuple[int, int]]:
    """A route from the middle of the maze: legs of so many cells, each with a quarter turn at its end."""
    ways = ((1, 0), (0, 1), (-1, 0), (0, -1))
    x, y, quarter = 0, 0, 0
    route: list[tuple[int, int]] = []
    for _ in range(legs):
        dx, dy = ways[quarter]
        cells = int(rng.integers(1, max(CELLS - (x * dx + y * dy), 1) + 1))
        x, y = x + cells * dx, y + cells * dy
        side = int(rng.choice((-1, 1)))
        dx, dy = ways[(quarter + side) % 4]
        side = -side if x * dx + y * dy >= CELLS else side
        quarter = (quarter + side) % 4
        route.append((cells, side))
    return route


def hump(way_m: float, angle: float, length_s: float) -> tuple[list[float], list[float]]:
    """Speeds and yaw rates of a stretch that starts and ends at rest."""
    bump = 0.5 * np.pi / length_s * np.sin(np.pi * steps(length_s))
    return (way_m * bump).tolist(), (angle * bump).tolist()


def run_back(route: list[tuple[int, int]], cell: float, rng: Rng) -> tuple[list[float], list[float]]:
    """The legs of a route from the last to the first at a run, with rounded corners."""
    speed: list[float] = []
    turning: list[float] = []
    run, bend = rng.uniform(0.6, 0.95), rng.uniform(0.75, 1.0)
    corner = [bend * 0.5 * cell] * len(steps(0.5 * np.pi / bend))
    for k in range(len(route) - 1, -1, -1):
        corners = (k > 0) + (k < len(route) - 1)
        straight = [run] * round((route[k][0] - 0.5 * corners) * cell / run / STEP_S)
        speed += straight + (corner if k else [])
        turning += [0.0] * len(straight) + ([-route[k - 1][1] * bend] * len(corner) if k else [])
    return speed, turning


def micromouse(duration_s: float, rng: Rng) -> Waypoints:
    """In a maze: slowly from cell to cell with peeps into dead ends, then the same way back at a run."""
    speed: list[float] = []
    turning: list[float] = []
    cell = rng.uniform(0.7, 1.1)
    while STEP_S * len(speed) < duration_s + 1.0:
        route = maze(rng, int(rng.integers(2, 4)))
        parts: list[tuple[list[float], list[float]]] = []
        for cells, side in route:
            parts += [
                hump(cell, rng.normal() * 0.05, 0.4 + cell / rng.uniform(0.3, 0.6)) for _ in range(cells)
            ]
            if rng.uniform() < 0.4:
                peep = cell * rng.uniform(0.5, 1.0)
                parts += [hump(peep, 0.0, peep / 0.3 + 0.5), hump(-peep, 0.0, peep / 0.35 + 0.5)]
            parts.append(hump(0.0, 0.5 * np.pi * side, rng.uniform(2.5, 3.5)))
        parts.append(hump(0.0, 0.5 * np.pi * route[-1][1], rng.uniform(2.5, 3.0)))
        parts.append(run_back(route, cell, rng))
        parts.append(([0.0] * 8, [0.0] * 8))
        for go, rate in parts:
            speed += go
            turning += rate
    return within_limits(speed, turning, 1.6)


def glider(duration_s: float, rng: Rng) -> Waypoints:
    """Soaring: circles in a thermal, shifted towards its core, then a glide with dips to the next one."""
    speed: list[float] = []
    turning: list[float] = []
    side = float(rng.choice((-1.0, 1.0)))
    while STEP_S * len(speed) < duration_s + 1.0:
        rate, pace = rng.uniform(0.4, 0.75), rng.uniform(0.3, 0.6)
        angle = 2 * np.pi * rng.uniform(0.8, 1.8)
        u = angle * steps(angle / rate)
        core, strength = rng.uniform(0.0, 6.28), rng.uniform(0.15, 0.4) * np.exp(-u / 8.0)
        turning += (side * rate * (1 + strength * np.cos(u - core))).tolist()
        speed += (pace * (1 - 0.8 * strength * np.cos(u - core))).tolist()
        far, off = homewards(speed, turning)
        length_s, turn = rng.uniform(5.0, 9.0), rng.uniform(-1.0, 1.0)
        turn = 0.9 * off if far > AWAY_M else turn
        part_s = max(1.5, abs(turn) / 0.7)
        u, t_s = steps(length_s), length_s * steps(length_s)
        dips = rng.uniform(0.08, 0.22) * np.sin(2 * np.pi * t_s / rng.uniform(2.5, 5.0))
        rolls = rng.uniform(0.0, 0.25) * np.sin(2 * np.pi * t_s / rng.uniform(2.0, 4.0))
        speed += [pace] * len(steps(part_s))
        turning += [turn / part_s] * len(steps(part_s))
        speed += (rng.uniform(0.6, 0.8) + dips).tolist()
        turning += rolls.tolist()
        side = -side if rng.uniform() < 0.7 else side
    return within_limits(speed, turning, 1.6)


def sumo(duration_s: float, rng: Rng) -> Waypoints:
    """A bout: round the other, a charge, locked to and fro, shoved back or shoving on, a twist away."""
    speed: list[float] = []
    turning: list[float] = []
    while STEP_S * len(speed) < duration_s + 1.0:
        side = float(rng.choice((-1.0, 1.0)))
        far, off = homewards(speed, turning)
        twist = 0.9 * off if far > 0.5 * AWAY_M else side * rng.uniform(0.5, 2.2)
        u = steps(0.6 + abs(twist) / 0.75)
        turning += (twist / (STEP_S * len(u)) * 1.3 * np.sin(np.pi * u) ** 0.5).tolist()
        speed += (rng.uniform(-0.1, 0.15) * np.sin(np.pi * u)).tolist()
        round_s, go = rng.uniform(1.5, 4.0), rng.uniform(0.25, 0.55)
        bow = rng.uniform(0.25, 0.7)
        speed += [go] * len(steps(round_s))
        turning += (-side * bow * np.cos(np.pi * steps(round_s) * rng.uniform(0.5, 1.2))).tolist()
        charge = steps(rng.uniform(0.9, 1.8))
        speed += [rng.uniform(0.7, 1.0)] * len(charge)
        turning += [rng.uniform(-0.15, 0.15)] * len(charge)
        u = rng.uniform(3.0, 7.0) * steps(rng.uniform(3.0, 7.0))
        heave, sway = rng.uniform(0.15, 0.35), rng.uniform(0.2, 0.6)
        shoves = np.sin(1.5 * u + rng.uniform(0.0, 6.28)) + 0.6 * np.sin(2.6 * u)
        speed += (rng.uniform(-0.1, 0.1) + heave * shoves).tolist()
        turning += (sway * np.sin(rng.uniform(1.2, 2.4) * u + rng.uniform(0.0, 6.28))).tolist()
        end = steps(rng.uniform(1.5, 3.5))
        out = rng.uniform(-0.65, -0.35) if rng.uniform() < 0.6 else rng.uniform(0.2, 0.4)
        speed += (out * np.sin(np.pi * end) ** 0.5).tolist()
        turning += [rng.uniform(-0.5, 0.5)] * len(end)
    return within_limits(speed, turning, 1.8)

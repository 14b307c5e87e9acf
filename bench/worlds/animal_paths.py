"""Paths of four more driver families: a dung beetle, a tennis player, a squirrel and a dressage horse."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.nimble_paths import STEP_S, Trail
from worlds.parts import Rng


def stand(trail: Trail, length_s: float) -> None:
    """Still for a while."""
    for _ in range(round(length_s / STEP_S)):
        trail.go(0.0, 0.0)


def reach(trail: Trail, x: float, y: float, pace: float, keen: float, most_s: float) -> None:
    """Head first to a place, slower while it lies aside and just before it."""
    for _ in range(round(most_s / STEP_S)):
        far, off = trail.towards(x, y)
        if far < 0.35:
            break
        trail.go(min(pace, np.sqrt(0.9 * far)) * max(np.cos(off), 0.1), keen * off)


def dung_beetle(duration_s: float, rng: Rng) -> Waypoints:
    """Rolls its ball away tail first, wobbling; a dance round for a new bearing; a run to fetch."""
    trail = Trail(duration_s)
    push, wobble_s = rng.uniform(0.35, 0.75), rng.uniform(2.5, 4.5)
    side = float(rng.choice((-1.0, 1.0)))
    while not trail.over:
        bearing = np.arctan2(-trail.y, -trail.x) + rng.uniform(-1.2, 1.2)
        wide, gust = rng.uniform(0.15, 0.6), rng.uniform(0.15, 0.5)
        puff_s, roll_s = rng.uniform(1.8, 3.5), rng.uniform(5.0, 11.0)
        for u in roll_s * steps(roll_s):
            if np.hypot(trail.x + 0.8 * np.cos(bearing), trail.y + 0.8 * np.sin(bearing)) > 5.0:
                break
            off = trail.off(bearing + np.pi + wide * np.sin(2 * np.pi * u / wobble_s))
            heave = 1.0 + gust * np.sin(2 * np.pi * u / puff_s)
            trail.go(-push * heave * max(np.cos(off), 0.1), 1.8 * off)
        stand(trail, rng.uniform(0.2, 1.0))
        side = -side if rng.uniform() < 0.6 else side
        spin, creep = side * rng.uniform(0.6, 1.05), rng.uniform(0.0, 0.15)
        for u in steps(rng.uniform(2.5, 6.0)):
            trail.go(creep, spin * (0.6 + 0.4 * np.cos(2 * np.pi * u)))
        if rng.uniform() < 0.5:
            r, way = rng.uniform(0.5, 3.5), rng.uniform(-np.pi, np.pi)
            reach(trail, r * np.cos(way), r * np.sin(way), rng.uniform(0.6, 1.1), 1.6, 9.0)
            for u in steps(rng.uniform(1.0, 2.0)):
                trail.go(0.3 * np.sin(2 * np.pi * u), 0.0)
    return softened(trail.speed, trail.turning, 0.5)


def tennis_player(duration_s: float, rng: Rng) -> Waypoints:
    """Sprints to balls left and right, a swing, back to the middle; up to the net, backwards under a lob."""
    trail = Trail(duration_s)
    court = rng.uniform(-np.pi, np.pi)
    cx, cy, sx, sy = np.cos(court), np.sin(court), -np.sin(court), np.cos(court)
    quick, keen = rng.uniform(0.8, 1.15), rng.uniform(1.6, 2.4)
    while not trail.over:
        for _ in range(int(rng.integers(2, 6))):
            aside = rng.uniform(0.8, 3.0) * float(rng.choice((-1.0, 1.0)))
            deep = rng.uniform(-1.0, 1.0)
            pace = quick * rng.uniform(0.7, 1.0)
            reach(trail, deep * cx + aside * sx, deep * cy + aside * sy, pace, keen, 7.0)
            swing = np.sign(trail.off(court)) * rng.uniform(0.7, 1.05)
            for u in steps(rng.uniform(0.8, 1.8)):
                trail.go(0.15 * pace, swing * np.sin(np.pi * u))
            if rng.uniform() < 0.6:
                mid = rng.uniform(-0.4, 0.4)
                reach(trail, mid * sx, mid * sy, pace * rng.uniform(0.5, 0.9), keen, 6.0)
            for u in steps(rng.uniform(0.6, 1.2)):
                trail.go(0.2 * np.sin(2 * np.pi * u), 0.0)
        net, aside = rng.uniform(2.2, 3.5), rng.uniform(-1.5, 1.5)
        reach(trail, net * cx + aside * sx, net * cy + aside * sy, quick, keen, 8.0)
        sway_s, wide = rng.uniform(2.0, 3.5), rng.uniform(0.2, 0.7)
        for _ in steps(rng.uniform(1.0, 3.0)):
            trail.go(0.1, 2.5 * trail.off(court))
        lob, curl, lob_s = quick * rng.uniform(0.5, 0.8), rng.uniform(-0.3, 0.3), rng.uniform(3.0, 5.5)
        for u in lob_s * steps(lob_s):
            if trail.x * cx + trail.y * cy < -1.0:
                break
            rel = curl + wide * np.sin(2 * np.pi * u / sway_s)
            trail.go(-lob * max(np.cos(trail.off(court)), 0.1), 1.8 * trail.off(court + rel))
        stand(trail, rng.uniform(0.5, 3.0))
    return softened(trail.speed, trail.turning, 0.5)


def darts(trail: Trail, top: float, freeze: float, rng: Rng) -> None:
    """Towards a place by fits and starts."""
    r, way = rng.uniform(1.0, 4.0), rng.uniform(-np.pi, np.pi)
    x, y = r * np.cos(way), r * np.sin(way)
    for _ in range(int(rng.integers(2, 6))):
        hook = rng.uniform(-0.6, 0.6)
        for u in steps(rng.uniform(0.9, 2.0)):
            far, off = trail.towards(x, y)
            trail.go(top * min(far, 1.0) * np.sin(np.pi * u) ** 0.6, 1.8 * off + hook)
        stand(trail, freeze * rng.uniform(0.3, 1.5))


def double_back(trail: Trail, top: float, side: float, rng: Rng) -> None:
    """About, and off homewards."""
    home = np.arctan2(-trail.y, -trail.x)
    for u in steps(rng.uniform(1.5, 2.5)):
        trail.go(0.25 * top, side * (0.6 + 0.5 * u))
    for u in steps(rng.uniform(1.5, 3.0)):
        trail.go(top * np.sin(np.pi * u) ** 0.6, 2.0 * trail.off(home))


def round_a_tree(trail: Trail, top: float, side: float, rng: Rng) -> None:
    """Winds round a tree, now quicker, now slower."""
    girth, dash_s = rng.uniform(0.7, 1.4), rng.uniform(1.5, 3.0)
    length_s = rng.uniform(5.0, 10.0)
    for u in steps(length_s):
        pace = min(0.6 * top * (1.0 + 0.7 * np.sin(2 * np.pi * u * length_s / dash_s)), girth)
        trail.go(pace, side * pace / girth)


def squirrel(duration_s: float, rng: Rng) -> Waypoints:
    """Jerky darts with freezes between, sudden doublings back, winds round a tree, digs a nut in."""
    trail = Trail(duration_s)
    top, freeze = rng.uniform(0.7, 1.15), rng.uniform(0.3, 1.2)
    while not trail.over:
        mood = rng.choice(("darts", "double", "tree", "nut"), p=(0.4, 0.2, 0.25, 0.15))
        side = float(rng.choice((-1.0, 1.0)))
        if mood == "darts":
            darts(trail, top, freeze, rng)
        elif mood == "double":
            double_back(trail, top, side, rng)
        elif mood == "tree":
            round_a_tree(trail, top, side, rng)
        else:
            for u in steps(rng.uniform(2.5, 5.0)):
                trail.go(0.15 * np.sin(4 * np.pi * u), side * 0.7 * np.sin(6 * np.pi * u))
        if np.hypot(trail.x, trail.y) > 4.0:
            reach(trail, 0.0, 0.0, 0.8 * top, 1.5, 6.0)
    return softened(trail.speed, trail.turning, 0.4)


def ride(trail: Trail, pace: float, turning: float) -> None:
    """One step of a figure, bent back where it would leave the arena."""
    far, off = trail.towards(0.0, 0.0)
    edge = float(np.clip((far - 3.0) / 1.5, 0.0, 1.0)) * min(1.0, abs(off))
    trail.go(pace, (1.0 - edge) * turning + edge * float(np.clip(1.5 * off, -1.0, 1.0)))


def volte(trail: Trail, pace: float, hand: float, rng: Rng) -> float:
    """A circle; the hand stays."""
    radius = max(rng.uniform(0.7, 1.8), pace / 0.95)
    for u in steps(min(2 * np.pi * radius / pace, 14.0)):
        ride(trail, pace * (1.0 + 0.08 * np.sin(6 * np.pi * u)), hand * pace / radius)
    return hand


def serpentine(trail: Trail, pace: float, hand: float, rng: Rng) -> float:
    """Loops to one side and the other."""
    loops, loop_s = int(rng.integers(2, 5)), rng.uniform(2.5, 4.5)
    swing = rng.uniform(0.4, 0.9)
    for u in loops * steps(loops * loop_s):
        ride(trail, pace, hand * swing * np.cos(np.pi * u))
    return hand * (-1.0) ** loops


def diagonal(trail: Trail, pace: float, hand: float, rng: Rng) -> float:
    """Across the arena, and on to the other hand."""
    way, collected = rng.uniform(-np.pi, np.pi), 0.7 * pace
    x, y = 2.5 * np.cos(way), 2.5 * np.sin(way)
    for k in range(90):
        far, off = trail.towards(x, y)
        if far < 0.4:
            break
        trail.go(min(collected + 0.02 * k, 1.1 * pace) * max(np.cos(off), 0.3), 1.4 * off)
    return -hand


def halt(trail: Trail, walk: float, rng: Rng) -> None:
    """A stand, and mostly some steps back."""
    stand(trail, rng.uniform(1.0, 2.5))
    if rng.uniform() < 0.8:
        bend, back = rng.uniform(-0.25, 0.25), walk * rng.uniform(0.9, 1.1)
        for u in steps(rng.uniform(2.0, 4.5)):
            trail.go(-back * np.sin(np.pi * u) ** 0.5, bend)
        stand(trail, rng.uniform(0.2, 0.8))


FIGURES = {"volte": volte, "serpentine": serpentine, "diagonal": diagonal}


def dressage(duration_s: float, rng: Rng) -> Waypoints:
    """Voltes, serpentines and diagonals at walk, trot or canter; square halts, rein-backs, pirouettes."""
    trail = Trail(duration_s)
    walk = rng.uniform(0.3, 0.4)
    gaits = (walk, walk * rng.uniform(1.6, 1.9), walk * rng.uniform(2.2, 2.6))
    hand = float(rng.choice((-1.0, 1.0)))
    while not trail.over:
        pace = gaits[int(rng.integers(0, 3))]
        figure = rng.choice((*FIGURES, "halt", "pirouette"), p=(0.25, 0.25, 0.2, 0.18, 0.12))
        if figure in FIGURES:
            hand = FIGURES[figure](trail, pace, hand, rng)
        elif figure == "halt":
            halt(trail, walk, rng)
        else:
            spin = hand * rng.uniform(0.7, 0.95)
            for u in steps(rng.uniform(2.5, 5.0)):
                trail.go(0.1, spin * np.sin(np.pi * u) ** 0.5)
    return softened(trail.speed, trail.turning, 0.6)

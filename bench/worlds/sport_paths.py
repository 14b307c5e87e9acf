"""Paths of four more driver families: a snooker ball, a road roller, an otter and a matador."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.nimble_paths import STEP_S, Trail, draw
from worlds.parts import Rng


def stand(trail: Trail, rest_s: float) -> None:
    """Stands still for a while."""
    for _ in range(round(rest_s / STEP_S)):
        trail.go(0.0, 0.0)


def face(trail: Trail, heading: float, most: float, way: float = 0.0) -> None:
    """On the spot to this heading, the short way or, where ``way`` is not 0, to that side."""
    left = trail.off(heading)
    if way * left < 0.0:
        left += 2 * np.pi * np.sign(way)
    end = trail.yaw + left
    for _ in range(120):
        off = end - trail.yaw
        if abs(off) < 0.08:
            break
        trail.go(0.0, float(np.clip(1.6 * off, -most, most)))


def snooker_ball(duration_s: float, rng: Rng) -> Waypoints:
    """Straight across the table, ever slower, off the cushion by a turn on the spot; a pot and a rest."""
    trail = Trail(duration_s)
    long, wide = rng.uniform(2.5, 4.5), rng.uniform(1.5, 3.0)
    cloth, spin = rng.uniform(0.02, 0.06), rng.uniform(0.6, 1.05)
    while not trail.over:
        pace = rng.uniform(0.7, 1.15)
        x, y = rng.uniform(-long, long), rng.uniform(-wide, wide)
        heading = np.arctan2(y - trail.y, x - trail.x)
        face(trail, heading, spin, float(rng.choice((-1.0, 0.0, 1.0))))
        swerve = rng.uniform(0.0, 0.4) * float(rng.choice((-1.0, 1.0)))
        for _ in range(300):
            pace -= cloth * STEP_S
            if pace < 0.15:
                break
            ahead = 0.5 * max(trail.speed[-1], 0.1) ** 2 + 0.1
            far_x, far_y = trail.x + ahead * np.cos(trail.yaw), trail.y + ahead * np.sin(trail.yaw)
            if abs(far_x) > long and far_x * np.cos(trail.yaw) > 0.0:
                heading = np.pi - trail.yaw
            elif abs(far_y) > wide and far_y * np.sin(trail.yaw) > 0.0:
                heading = -trail.yaw
            else:
                trail.go(pace, swerve)
                continue
            while trail.speed[-1] > 0.02:
                trail.go(0.0, 0.0)
            face(trail, heading, spin)
            pace *= rng.uniform(0.6, 0.9)
            swerve *= -0.8
        stand(trail, rng.uniform(0.3, 2.0))
        if rng.uniform() < 0.4:
            screw = rng.uniform(0.4, 0.8)
            for u in steps(rng.uniform(2.0, 3.5)):
                trail.go(-screw * np.sin(np.pi * u), 0.0)
    return softened(trail.speed, trail.turning, 0.5)


def road_roller(duration_s: float, rng: Rng) -> Waypoints:
    """Strip beside strip, ahead and tail first, slanting across to the next; now and then a new road."""
    trail = Trail(duration_s)
    road, side = 0.0, float(rng.choice((-1.0, 1.0)))
    walk, lane = rng.uniform(0.45, 0.75), rng.uniform(0.4, 0.8)
    while not trail.over:
        reach = rng.uniform(1.5, 3.5)
        strip = -side * lane
        for k in range(int(rng.integers(3, 7))):
            facing = 1.0 if k % 2 == 0 else -1.0
            strip += side * lane
            pace = walk * rng.uniform(0.6, 1.5)
            for _ in range(round(rng.uniform(6.0, 10.0) / STEP_S)):
                along = trail.x * np.cos(road) + trail.y * np.sin(road)
                aside = -trail.x * np.sin(road) + trail.y * np.cos(road)
                left = reach - facing * along
                if left < 0.05:
                    break
                slant = facing * float(np.clip(1.2 * (strip - aside), -0.7, 0.7))
                trail.go(facing * min(pace, np.sqrt(0.8 * left) + 0.05), 1.8 * trail.off(road + slant))
            stand(trail, rng.uniform(0.2, 1.2))
        side = -side
        home = np.arctan2(-trail.y, -trail.x)
        for _ in range(120):
            far, off = trail.towards(0.0, 0.0)
            if far < 0.6:
                break
            trail.go(walk * max(np.cos(off), 0.0), 1.3 * off)
        road = home + rng.uniform(-1.2, 1.2)
        face(trail, road, 0.7)
    return softened(trail.speed, trail.turning, 0.6)


def otter(duration_s: float, rng: Rng) -> Waypoints:
    """Long bends that quicken and slow, tight curls one after the other, down the bank tail first."""
    trail = Trail(duration_s)
    lively = rng.uniform(0.75, 1.1)
    side = float(rng.choice((-1.0, 1.0)))
    while not trail.over:
        mood = rng.choice(("swoop", "curl", "slide"), p=(0.5, 0.25, 0.25))
        if mood == "swoop":
            length_s, dive_s, bend_s = rng.uniform(8.0, 14.0), rng.uniform(3.0, 6.0), rng.uniform(5.0, 9.0)
            bend = side * rng.uniform(0.4, 0.8)
            for u in length_s * steps(length_s):
                pace = lively * (0.6 + 0.4 * np.sin(2 * np.pi * u / dive_s))
                draw(trail, pace, bend * np.sin(2 * np.pi * u / bend_s + 0.5))
        elif mood == "curl":
            for _ in range(int(rng.integers(1, 4))):
                tight, curl_s = rng.uniform(0.8, 1.05), rng.uniform(2.5, 5.0)
                for u in steps(curl_s):
                    trail.go(lively * (0.15 + 0.3 * u), side * tight * np.sin(np.pi * u) ** 0.5)
                side = -side
        else:
            slope, wag, wag_s = rng.uniform(0.4, 0.85), rng.uniform(0.1, 0.5), rng.uniform(2.0, 4.0)
            slide_s = rng.uniform(3.0, 5.0)
            face(trail, np.arctan2(trail.y, trail.x), 0.9)
            for u in steps(slide_s):
                trail.go(-slope * np.sin(np.pi * u**1.5), wag * np.sin(2 * np.pi * u * slide_s / wag_s))
            stand(trail, rng.uniform(0.0, 1.5))
        side = -side if rng.uniform() < 0.5 else side
    return softened(trail.speed, trail.turning, 0.5)


def matador(duration_s: float, rng: Rng) -> Waypoints:
    """Half rounds about the bull to either side, ahead or tail first, a rush, a stand and a proud turn."""
    trail = Trail(duration_s)
    brave = rng.uniform(0.8, 1.15)
    while not trail.over:
        side = float(rng.choice((-1.0, 1.0)))
        for _ in range(int(rng.integers(1, 4))):
            facing = 1.0 if rng.uniform() < 0.6 else -1.0
            radius, arc = rng.uniform(0.5, 1.4), rng.uniform(0.7, 1.3) * np.pi
            pace = min(brave * rng.uniform(0.4, 0.8), 0.9 * radius)
            arc_s = arc * radius / (0.75 * pace)
            for u in steps(arc_s):
                swell = pace * np.sin(np.pi * u) ** 0.5
                trail.go(facing * swell, side * swell / radius)
            stand(trail, rng.uniform(0.2, 1.0))
            side = -side
        proud = rng.uniform(0.5, 1.0)
        face(trail, np.arctan2(-trail.y, -trail.x) + rng.uniform(-0.4, 0.4), proud, side)
        stand(trail, rng.uniform(0.3, 1.5))
        rush, feint = brave * rng.uniform(0.8, 1.0), rng.uniform(-0.3, 0.3)
        far, _ = trail.towards(0.0, 0.0)
        for u in steps(min(max(far, 1.0), 3.5) / (0.6 * rush)):
            trail.go(rush * np.sin(np.pi * u) ** 0.7, feint * np.sin(2 * np.pi * u))
    return softened(trail.speed, trail.turning, 0.5)

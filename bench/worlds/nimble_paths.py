"""Paths of four more driver families: a hummingbird, a skier, a yo-yo and a gymnast's ribbon."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from worlds.fresh_paths import softened, steps
from worlds.parts import Rng

STEP_S = 0.1
MOST_RADPS = 1.1
MOST_MPS2 = 1.0
MOST_RADPS2 = 2.2


class Trail:
    """What has been driven so far, and where it has led."""

    def __init__(self, duration_s: float) -> None:
        self.speed: list[float] = [0.0]
        self.turning: list[float] = [0.0]
        self.x, self.y, self.yaw = 0.0, 0.0, 0.0
        self.until = round((duration_s + 1.0) / STEP_S) + 1

    @property
    def over(self) -> bool:
        """Whether the trail is long enough."""
        return len(self.speed) >= self.until

    def go(self, speed: float, turning: float) -> None:
        """One step towards these speeds, no faster than the wheels can follow."""
        dv, dw = MOST_MPS2 * STEP_S, MOST_RADPS2 * STEP_S
        wish = float(np.clip(turning, -MOST_RADPS, MOST_RADPS))
        self.speed.append(self.speed[-1] + float(np.clip(speed - self.speed[-1], -dv, dv)))
        self.turning.append(self.turning[-1] + float(np.clip(wish - self.turning[-1], -dw, dw)))
        self.yaw += STEP_S * self.turning[-1]
        self.x += STEP_S * self.speed[-1] * np.cos(self.yaw)
        self.y += STEP_S * self.speed[-1] * np.sin(self.yaw)

    def off(self, heading: float) -> float:
        """How far to the left this heading is."""
        return float(np.arctan2(np.sin(heading - self.yaw), np.cos(heading - self.yaw)))

    def towards(self, x: float, y: float) -> tuple[float, float]:
        """How far away a place is and how far to the left."""
        return float(np.hypot(x - self.x, y - self.y)), self.off(np.arctan2(y - self.y, x - self.x))


def hummingbird(duration_s: float, rng: Rng) -> Waypoints:
    """From flower to flower: a dart that brakes hard, sips to and fro, then off the flower tail first."""
    trail = Trail(duration_s)
    top, keen = rng.uniform(0.6, 1.2), rng.uniform(1.0, 1.8)
    while not trail.over:
        r, way = rng.uniform(0.5, 4.0), rng.uniform(-np.pi, np.pi)
        x, y = r * np.cos(way), r * np.sin(way)
        dart, bow = top * rng.uniform(0.6, 1.0), rng.uniform(-0.5, 0.5)
        for _ in range(110):
            far, off = trail.towards(x, y)
            if far < 0.3:
                break
            pace = min(dart, np.sqrt(1.0 * far)) * max(np.cos(off), 0.15)
            trail.go(pace, keen * (off + bow * min(far / 2.0, 1.0)))
        sip_s, beat_s, reach = rng.uniform(1.5, 5.0), rng.uniform(1.5, 2.6), rng.uniform(0.12, 0.3)
        sway, nod_s = rng.uniform(0.0, 0.5), rng.uniform(1.5, 3.5)
        for u in sip_s * steps(sip_s):
            trail.go(reach * np.sin(2 * np.pi * u / beat_s), sway * np.sin(2 * np.pi * u / nod_s))
        away_s, back, twist = rng.uniform(1.5, 3.5), rng.uniform(0.25, 0.7), rng.uniform(-1.0, 1.0)
        for u in steps(away_s):
            trail.go(-back * np.sin(np.pi * u), twist * np.sin(np.pi * u) ** 2)
    return softened(trail.speed, trail.turning, 0.5)


def skier(duration_s: float, rng: Rng) -> Waypoints:
    """Linked turns down a slope, slower across the fall line, a skidded stop, and slowly up by the lift."""
    trail = Trail(duration_s)
    fall = rng.uniform(-np.pi, np.pi)
    across = rng.uniform(1.0, 2.0) * float(rng.choice((-1.0, 1.0)))
    tow = rng.uniform(0.3, 0.6)
    while not trail.over:
        foot, head = rng.uniform(2.5, 5.0), rng.uniform(-4.0, -1.5)
        pace, swing, turn_s = rng.uniform(0.6, 1.2), rng.uniform(0.5, 1.2), rng.uniform(3.5, 6.5)
        lean = float(rng.choice((-1.0, 1.0)))
        straight = rng.uniform() < 0.15
        gather = 0.0
        for k in range(220):
            along = trail.x * np.cos(fall) + trail.y * np.sin(fall)
            aside = -trail.x * np.sin(fall) + trail.y * np.cos(fall)
            if along > foot:
                break
            wave = 0.0 if straight else lean * swing * np.sin(2 * np.pi * STEP_S * k / turn_s)
            rel = wave - 0.15 * float(np.clip(aside, -3.0, 3.0))
            gather = min(gather + 0.05, 1.0)
            off = trail.off(fall + rel)
            trail.go(gather * pace * max(np.cos(trail.off(fall)), 0.25), 2.5 * off)
        skid = rng.uniform(0.8, 1.1) * float(rng.choice((-1.0, 1.0)))
        for u in steps(rng.uniform(1.2, 2.0)):
            trail.go(0.5 * pace * (1.0 - u), skid)
        for _ in range(round(rng.uniform(0.0, 2.0) / STEP_S)):
            trail.go(0.0, 0.0)
        x = head * np.cos(fall) - across * np.sin(fall)
        y = head * np.sin(fall) + across * np.cos(fall)
        jerk_s = rng.uniform(2.0, 4.0)
        for k in range(260):
            far, off = trail.towards(x, y)
            if far < 0.4:
                break
            tug = 1.0 + 0.2 * np.sin(2 * np.pi * STEP_S * k / jerk_s)
            trail.go(tow * tug * max(np.cos(off), 0.1), 1.2 * off)
    return softened(trail.speed, trail.turning, 0.6)


def wind_back(trail: Trail, wind: float, facing: float) -> None:
    """Back to the hand, tail first or ahead, ever quicker until close to it."""
    for k in range(140):
        far, ahead = trail.towards(0.0, 0.0)
        if far < 0.5:
            break
        off = ahead if facing > 0.0 else trail.off(trail.yaw + ahead + np.pi)
        pace = min(wind, 0.15 + 0.06 * k, np.sqrt(0.8 * far))
        trail.go(facing * pace * max(np.cos(off), 0.1), 1.3 * off)


def yo_yo(duration_s: float, rng: Rng) -> Waypoints:
    """Thrown out from the hand, asleep in a spin at the string's end, wound back tail first; with tricks."""
    trail = Trail(duration_s)
    side = float(rng.choice((-1.0, 1.0)))
    string = rng.uniform(2.0, 4.0)
    while not trail.over:
        trick = rng.choice(("sleeper", "world", "cradle"), p=(0.55, 0.25, 0.2))
        throw, curl = rng.uniform(0.6, 1.2), rng.uniform(-0.35, 0.35)
        out_s = string * rng.uniform(0.6, 1.0) / (0.55 * throw)
        for u in steps(out_s):
            trail.go(throw * (1.0 - u) ** 0.7, curl * np.sin(np.pi * u))
        if trick == "sleeper":
            spin, creep = side * rng.uniform(0.5, 1.05), rng.uniform(0.0, 0.12)
            for u in steps(rng.uniform(1.5, 6.0)):
                trail.go(creep, spin * (1.0 - 0.5 * u))
        elif trick == "world":
            round_s = rng.uniform(7.0, 11.0)
            for u in steps(round_s):
                pace = rng.uniform(0.98, 1.02) * throw * (0.65 + 0.3 * np.cos(2 * np.pi * u))
                trail.go(pace, side * 2 * np.pi / round_s)
        else:
            rock_s, wide = rng.uniform(2.4, 4.0), rng.uniform(0.2, 0.5)
            for u in rock_s * 3.0 * steps(rock_s * 3.0):
                trail.go(wide * np.sin(2 * np.pi * u / rock_s), side * wide * np.cos(2 * np.pi * u / rock_s))
        side = -side if rng.uniform() < 0.6 else side
        wind_back(trail, rng.uniform(0.35, 0.9), 1.0 if rng.uniform() < 0.25 else -1.0)
        for _ in range(round(rng.uniform(0.3, 1.5) / STEP_S)):
            trail.go(0.0, 0.0)
        turn = side * rng.uniform(0.4, 1.0)
        for u in steps(rng.uniform(0.8, 2.5)):
            trail.go(0.0, turn * np.sin(np.pi * u))
    return softened(trail.speed, trail.turning, 0.5)


def draw(trail: Trail, pace: float, turning: float) -> None:
    """One step, bent back to the middle of the floor where it leads too far off."""
    far, off = trail.towards(0.0, 0.0)
    edge = float(np.clip((far - 2.5) / 1.5, 0.0, 1.0)) * min(1.0, abs(off))
    homewards = float(np.clip(1.5 * off, -1.0, 1.0))
    trail.go(pace * (1.0 - 0.3 * edge), (1.0 - edge) * turning + edge * homewards)


def ribbon(duration_s: float, rng: Rng) -> Waypoints:
    """A gymnast's ribbon: snakes that widen or fade, spirals that tighten, a toss far ahead and its catch."""
    trail = Trail(duration_s)
    lively = rng.uniform(0.8, 1.2)
    while not trail.over:
        side = float(rng.choice((-1.0, 1.0)))
        trick = rng.choice(("snake", "spiral", "toss", "circle"), p=(0.35, 0.25, 0.25, 0.15))
        length_s = rng.uniform(5.0, 10.0)
        pace = lively * rng.uniform(0.3, 0.75)
        if trick == "snake":
            beat_s, first, last = rng.uniform(1.8, 3.2), rng.uniform(0.2, 1.0), rng.uniform(0.2, 1.0)
            for u in steps(length_s):
                wide = first + (last - first) * u
                draw(
                    trail, pace * (1.1 - 0.3 * wide), side * wide * np.sin(2 * np.pi * u * length_s / beat_s)
                )
        elif trick == "spiral":
            way = float(rng.choice((-1.0, 1.0)))
            for u in steps(length_s):
                tight = u if way > 0.0 else 1.0 - u
                draw(trail, lively * (0.85 - 0.6 * tight), side * (0.2 + 0.85 * tight))
        elif trick == "toss":
            far, bend = lively * rng.uniform(0.8, 1.0), rng.uniform(-0.2, 0.2)
            for u in steps(rng.uniform(2.0, 3.5)):
                draw(trail, far * np.sin(np.pi * min(u + 0.15, 1.0)) ** 0.7, bend)
            spin = side * rng.uniform(0.7, 1.05)
            for _ in steps(rng.uniform(1.0, 5.0)):
                trail.go(0.08, spin)
        else:
            sway_s = rng.uniform(2.5, 5.0)
            for u in steps(length_s):
                draw(
                    trail, pace * (1.0 + 0.35 * np.sin(2 * np.pi * u * length_s / sway_s)), side * pace / 0.9
                )
    return softened(trail.speed, trail.turning, 0.5)

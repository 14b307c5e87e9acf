"""Seventy driver families: references of speed and yaw rate, and histories of contact modes, by seed.

Every draw comes from the generator that is given. Paths are those of ``quality_logs`` where they fit; mode
histories are drawn here, since their rate is part of what the benchmark varies.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import quality_logs

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import ClosedLoop, Waypoints
from wmr_synth.driving.patrol import ramped, stop_go_reverse_turn
from worlds import (
    animal_paths,
    course_paths,
    duty_paths,
    fresh_paths,
    heeding_paths,
    late_paths,
    nimble_paths,
    outdoor_paths,
    play_paths,
    practice_paths,
    restless_paths,
    route_paths,
    signal_paths,
    site_paths,
    sport_paths,
    wild_paths,
    work_paths,
    yard_paths,
)
from worlds.parts import Rng, in_parts

SQUARE_WAVE_SPEED_MPS = 1.2


@dataclass(frozen=True)
class Drive:
    """References at knots, and the true contact modes (stamps in ns since the start).

    The robot starts with the references' first speeds.
    """

    path: Waypoints
    modes: ModeTrack

    @property
    def start(self) -> tuple[float, float]:
        """Initial speed in m/s and yaw rate in rad/s."""
        return self.path.v_long_mps[0], self.path.yaw_rate_radps[0]


@dataclass(frozen=True)
class Family:
    """A path, and log-uniform lengths in s of ideal rolling and of what lies between."""

    path: Callable[[float, Rng], Waypoints]
    ideal_s: tuple[float, float]
    lost_s: tuple[float, float]


def slow_square_wave(duration_s: float, rng: Rng) -> Waypoints:
    """Constant 1.2 m/s, steering that changes its sign every 3 to 8 s."""
    n = int(duration_s / 3.0) + 2
    turning = rng.uniform(0.2, 0.8) * np.resize([1.0, -1.0], n)
    targets = np.full(n, SQUARE_WAVE_SPEED_MPS), turning
    rates = np.full(n, 1.0), np.full(n, 2.0)
    return ramped(np.full(n, rng.uniform(3.0, 8.0)), targets, rates, (SQUARE_WAVE_SPEED_MPS, 0.0))


def delivery(duration_s: float, rng: Rng) -> Waypoints:
    """A round with docking: a run with a bend, slowly up to a dock, a stop, backwards out with a turn."""
    n = int(duration_s / 10.0) + 2
    parts = []
    for _ in range(n):
        run, bend = rng.uniform(0.7, 1.6), rng.choice((-1.0, 1.0), 2) * rng.uniform(0.2, 0.8, 2)
        parts += [
            (rng.uniform(2.0, 5.0), run, 0.0),
            (rng.uniform(1.5, 3.5), rng.uniform(0.7, 1.0) * run, bend[0]),
            (rng.uniform(2.0, 4.0), rng.uniform(0.15, 0.35), 0.0),
            (rng.uniform(1.0, 2.0), 0.0, 0.0),
            (rng.uniform(2.0, 4.0), -rng.uniform(0.3, 0.7), bend[1]),
        ]
    lengths, speed, turning = np.array(parts).T
    rates = rng.uniform(0.5, 1.2, len(parts)), rng.uniform(0.8, 2.0, len(parts))
    return ramped(lengths, (speed, turning), rates)


def slalom(duration_s: float, rng: Rng) -> Waypoints:
    """A weave at 1 to 1.8 m/s, about a bend that changes, with braking to walking pace now and then."""
    t_s = np.arange(0.0, duration_s + 0.25, 0.25)
    phase = np.cumsum(0.25 * 2 * np.pi / rng.uniform(2.5, 6.0, len(t_s)))
    n = int(duration_s / 4.0) + 2
    cruise, weave = rng.uniform(1.0, 1.8), rng.uniform(0.3, 0.8)
    brakes = rng.uniform(0.0, 1.0, n) < 0.4
    speeds = np.where(brakes, rng.uniform(0.2, 0.5, n), cruise * rng.uniform(0.85, 1.1, n))
    bends = rng.uniform(-0.3, 0.3, n)
    rates = rng.uniform(0.6, 1.5, n), np.full(n, 0.5)
    slow = ramped(rng.uniform(3.0, 7.0, n), (speeds, bends), rates)
    speed, bend = slow(t_s)
    return Waypoints(
        tuple(t_s.tolist()), tuple(speed.tolist()), tuple((bend + weave * np.sin(phase)).tolist())
    )


def lawn_mower(duration_s: float, rng: Rng) -> Waypoints:
    """Parallel passes; between two, a half turn to alternating sides, mostly by way of reversing."""
    side, width, parts = float(rng.choice((-1.0, 1.0))), rng.uniform(0.5, 1.2), []
    while sum(length for length, *_ in parts) < duration_s:
        parts.append((rng.uniform(3.0, 8.0), width * rng.uniform(0.9, 1.1), 0.0))
        rate = rng.uniform(0.5, 0.9)
        if rng.uniform() < 0.5:
            half = 0.5 * np.pi / rate + 0.5
            parts += [(half, 0.3, side * rate), (rng.uniform(1.0, 2.0), -0.4, 0.0), (half, 0.3, side * rate)]
        else:
            parts.append((np.pi / rate + 0.5, rng.uniform(0.2, 0.4), side * rate))
        side = -side
    return in_parts(parts, rng, (0.5, 1.2), (1.0, 2.0))


def joystick(duration_s: float, rng: Rng) -> Waypoints:
    """A stick that wanders about a mean, in steps of .3 s, with a quarter of the range left dead."""
    n = int(duration_s / 0.3) + 2
    stick = np.zeros((2, n))
    for k in range(1, n):
        stick[:, k] = np.clip(0.93 * stick[:, k - 1] + 0.3 * rng.normal(size=2), -1.0, 1.0)
    dead = np.sign(stick) * np.maximum(np.abs(stick) - 0.15, 0.0) / 0.85
    speed = np.clip(rng.uniform(0.2, 0.6) + rng.uniform(0.7, 1.3) * dead[0], -0.8, 1.8)
    t_s = 0.3 * np.arange(n)
    return Waypoints(
        tuple(t_s.tolist()), tuple(speed.tolist()), tuple((rng.uniform(0.5, 1.0) * dead[1]).tolist())
    )


def aisles(duration_s: float, rng: Rng) -> Waypoints:
    """Runs between shelves at two speeds, tight quarter turns, stops to pick, at times backwards."""
    quick, parts = rng.uniform(0.9, 1.7), []
    while sum(length for length, *_ in parts) < duration_s:
        speed = quick if rng.uniform() < 0.6 else 0.5 * quick
        parts.append((rng.uniform(2.0, 7.0), speed * rng.uniform(0.9, 1.0), 0.0))
        if rng.uniform() < 0.5:
            parts.append((rng.uniform(1.0, 3.0), 0.0, 0.0))
        if rng.uniform() < 0.3:
            parts.append((rng.uniform(1.5, 4.0), -0.5 * quick, 0.0))
        rate, side = rng.uniform(0.6, 1.0), float(rng.choice((-1.0, 1.0)))
        parts.append((0.5 * np.pi / rate + 0.3, rng.uniform(0.05, 0.2), side * rate))
    return in_parts(parts, rng)


def circuit(duration_s: float, rng: Rng) -> Waypoints:
    """Laps of a closed course: straights and bends of a few radii, quicker and slower, reversed half way."""
    n_bends, radii = int(rng.integers(3, 7)), rng.uniform(1.2, 4.0, 7)
    angles = rng.choice((1.0, 1.0, -1.0), n_bends) * rng.uniform(0.6, 2.0, n_bends)
    straights, parts = rng.uniform(1.0, 4.0, n_bends), []
    while (spent := sum(length for length, *_ in parts)) < duration_s:
        pace, way = rng.uniform(0.6, 1.5), 1.0 if spent < 0.5 * duration_s else -1.0
        for length, angle, radius in zip(straights, angles, radii, strict=False):
            turning = pace * rng.uniform(0.6, 0.9)
            parts.append((length / pace, pace, 0.0))
            parts.append((abs(angle) * radius / turning, turning, way * np.sign(angle) * turning / radius))
    return in_parts(parts, rng)


def shuttle(duration_s: float, rng: Rng) -> Waypoints:
    """Forwards and backwards between two places along an S, as a fork lift; a stop at each end."""
    reach, sway, parts = rng.uniform(4.0, 9.0), rng.uniform(0.2, 0.7), []
    while sum(length for length, *_ in parts) < duration_s:
        for way in (1.0, -1.0):
            speed = rng.uniform(0.5, 1.3)
            third = reach / speed / 3
            turn, slow = sway * rng.uniform(0.7, 1.3), 0.6 * way * speed
            parts += [(third, way * speed, turn), (third, way * speed, -turn), (third, slow, 0.0)]
            parts.append((rng.uniform(0.5, 2.5), 0.0, 0.0))
    return in_parts(parts, rng)


def inspection(duration_s: float, rng: Rng) -> Waypoints:
    """Walking pace in arcs, with looks to both sides: turning on the spot; now and then a dash."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        dash = rng.uniform() < 0.25
        speed = rng.uniform(1.2, 1.9) if dash else rng.uniform(0.3, 0.8)
        parts.append((rng.uniform(2.0, 6.0), speed, rng.uniform(-0.3, 0.3)))
        if rng.uniform() < 0.4:
            look, rate = rng.uniform(0.8, 2.0), float(rng.choice((-1.0, 1.0))) * rng.uniform(0.4, 1.0)
            parts += [(0.8, 0.0, 0.0), (look, 0.0, rate), (2 * look, 0.0, -rate), (look, 0.0, rate)]
    return in_parts(parts, rng)


def spiral(duration_s: float, rng: Rng) -> Waypoints:
    """Outwards and inwards on a spiral, its speed swelling slowly; then the other way."""
    t_s = np.arange(0.0, duration_s + 0.25, 0.25)
    mean, swell = rng.uniform(0.6, 1.1), rng.uniform(0.2, 0.4)
    speed = mean * (1 + swell * np.sin(2 * np.pi * t_s / rng.uniform(5.0, 12.0)))
    middle, reach = rng.uniform(1.5, 3.0), rng.uniform(0.4, 0.7)
    radius = middle * (1 + reach * np.sin(2 * np.pi * t_s / rng.uniform(18.0, 45.0)))
    side = np.tanh(6 * np.sin(2 * np.pi * t_s / rng.uniform(40.0, 80.0) + rng.uniform(0.0, 3.0)))
    turning = np.clip(side * speed / radius, -1.0, 1.0)
    return Waypoints(tuple(t_s.tolist()), tuple(speed.tolist()), tuple(turning.tolist()))


def follower(duration_s: float, rng: Rng) -> Waypoints:
    """Behind a person who walks, waits and hurries: smooth speeds, the heading corrected all the time."""
    t_s = np.arange(0.0, duration_s + 0.2, 0.2)
    n, pace, turning = len(t_s), np.zeros(len(t_s)), np.zeros(len(t_s))
    wanted, heading = rng.uniform(0.6, 1.2), 0.0
    for k in range(1, n):
        if rng.uniform() < 0.2 / 4.0:
            wanted = rng.choice((0.0, 1.0, 1.0, 1.0)) * rng.uniform(0.5, 1.6)
        if rng.uniform() < 0.2 / 3.0:
            heading = rng.uniform(-1.5, 1.5)
        pace[k] = pace[k - 1] + np.clip(0.25 * (wanted - pace[k - 1]), -0.16, 0.12)
        turning[k] = 0.8 * turning[k - 1] + 0.2 * np.clip(1.2 * heading, -0.9, 0.9) + 0.03 * rng.normal()
        heading -= 0.2 * turning[k]
    return Waypoints(tuple(t_s.tolist()), tuple(pace.tolist()), tuple(turning.tolist()))


def dash(duration_s: float, rng: Rng) -> Waypoints:
    """All or nothing: as hard as it goes to top speed and back to a crawl, bends in the crawl or at speed."""
    top, parts = rng.uniform(1.4, 2.0), []
    while sum(length for length, *_ in parts) < duration_s:
        bend = float(rng.choice((-1.0, 0.0, 1.0))) * rng.uniform(0.1, 0.4)
        parts.append((rng.uniform(1.5, 4.0), top * rng.uniform(0.7, 1.0), bend))
        parts.append((rng.uniform(0.8, 2.0), rng.uniform(0.0, 0.3), rng.uniform(-0.9, 0.9)))
    return in_parts(parts, rng, (1.2, 2.0), (1.5, 3.0))


def parking(duration_s: float, rng: Rng) -> Waypoints:
    """Turning in several moves: ahead to one side, back to the other, then a run to the next place."""
    parts = []
    while sum(length for length, *_ in parts) < duration_s:
        side, speed, rate = float(rng.choice((-1.0, 1.0))), rng.uniform(0.3, 0.7), rng.uniform(0.3, 0.8)
        for _ in range(int(rng.integers(1, 4))):
            parts.append((rng.uniform(1.2, 2.5), speed, side * rate))
            parts.append((rng.uniform(1.2, 2.5), -speed, side * rate * rng.uniform(0.3, 1.0)))
        parts.append((rng.uniform(3.0, 7.0), rng.uniform(0.8, 1.6), rng.uniform(-0.15, 0.15)))
        if rng.uniform() < 0.3:
            parts.append((rng.uniform(1.0, 3.0), 0.0, 0.0))
    return in_parts(parts, rng)


def path_of(family: Callable[..., object]) -> Callable[[float, Rng], Waypoints]:
    """The path of a family of ``quality_logs``, without its modes."""

    def path(duration_s: float, rng: Rng) -> Waypoints:
        driver = family(duration_s, rng).driver  # type: ignore[attr-defined]
        assert isinstance(driver, ClosedLoop)
        assert isinstance(driver.references, Waypoints)
        return driver.references

    return path


FAMILIES = {
    "patrol": Family(stop_go_reverse_turn, (6.0, 14.0), (2.0, 5.0)),
    "stop-go": Family(stop_go_reverse_turn, (0.5, 5.0), (0.5, 5.0)),
    "square-wave": Family(slow_square_wave, (8.0, 60.0), (0.5, 3.0)),
    "teleoperated": Family(path_of(quality_logs.teleoperated), (1.0, 20.0), (0.5, 5.0)),
    "straight": Family(path_of(quality_logs.straight_runs), (15.0, 60.0), (0.5, 4.0)),
    "friction-limit": Family(path_of(quality_logs.friction_limit), (0.5, 8.0), (0.5, 8.0)),
    "delivery": Family(delivery, (3.0, 20.0), (0.5, 3.0)),
    "slalom": Family(slalom, (2.0, 12.0), (0.5, 4.0)),
    "lawn-mower": Family(lawn_mower, (5.0, 30.0), (0.5, 4.0)),
    "joystick": Family(joystick, (1.0, 15.0), (0.5, 4.0)),
    "aisles": Family(aisles, (3.0, 25.0), (0.5, 4.0)),
    "circuit": Family(circuit, (2.0, 20.0), (0.5, 5.0)),
    "shuttle": Family(shuttle, (1.0, 10.0), (0.5, 3.0)),
    "inspection": Family(inspection, (4.0, 40.0), (0.5, 4.0)),
    "spiral": Family(spiral, (4.0, 30.0), (0.5, 4.0)),
    "follower": Family(follower, (2.0, 20.0), (0.5, 4.0)),
    "dash": Family(dash, (1.0, 12.0), (0.5, 3.0)),
    "parking": Family(parking, (2.0, 25.0), (0.5, 4.0)),
    "sweeper": Family(late_paths.sweeper, (4.0, 30.0), (0.5, 3.0)),
    "tug": Family(late_paths.tug, (5.0, 40.0), (0.5, 4.0)),
    "guard": Family(late_paths.guard, (4.0, 40.0), (0.5, 4.0)),
    "chase": Family(late_paths.chase, (1.0, 10.0), (0.5, 3.0)),
    "convoy": Family(late_paths.convoy, (2.0, 25.0), (0.5, 4.0)),
    "sweeps": Family(late_paths.sweeps, (3.0, 30.0), (0.5, 4.0)),
    "backwards": Family(late_paths.backwards, (3.0, 25.0), (0.5, 4.0)),
    "stations": Family(late_paths.stations, (4.0, 35.0), (0.5, 3.0)),
    "crowd": Family(late_paths.crowd, (2.0, 20.0), (0.5, 3.0)),
    "figures": Family(late_paths.figures, (3.0, 30.0), (0.5, 4.0)),
    "shunting": Family(late_paths.shunting, (4.0, 35.0), (0.5, 4.0)),
    "ladder": Family(late_paths.ladder, (5.0, 40.0), (0.5, 4.0)),
    "mail": Family(work_paths.mail, (3.0, 30.0), (0.5, 4.0)),
    "polisher": Family(work_paths.polisher, (2.0, 25.0), (0.5, 4.0)),
    "squares": Family(work_paths.squares, (4.0, 40.0), (0.5, 3.0)),
    "line": Family(work_paths.line, (3.0, 25.0), (0.5, 4.0)),
    "bump-and-turn": Family(site_paths.bump_and_turn, (3.0, 30.0), (0.5, 4.0)),
    "forklift": Family(site_paths.forklift, (4.0, 35.0), (0.5, 4.0)),
    "saws": Family(site_paths.saws, (2.0, 25.0), (0.5, 4.0)),
    "survey": Family(site_paths.survey, (3.0, 30.0), (0.5, 3.0)),
    "orchard": Family(route_paths.orchard, (4.0, 35.0), (0.5, 4.0)),
    "ferry": Family(route_paths.ferry, (3.0, 30.0), (0.5, 4.0)),
    "pacer": Family(route_paths.pacer, (2.0, 25.0), (0.5, 4.0)),
    "rink": Family(route_paths.rink, (2.0, 20.0), (0.5, 4.0)),
    "plough": Family(yard_paths.plough, (2.0, 25.0), (0.5, 4.0)),
    "museum": Family(yard_paths.museum, (4.0, 35.0), (0.5, 3.0)),
    "skidpad": Family(yard_paths.skidpad, (2.0, 25.0), (0.5, 4.0)),
    "search": Family(yard_paths.search, (3.0, 30.0), (0.5, 4.0)),
    "bed": Family(duty_paths.bed, (4.0, 35.0), (0.5, 4.0)),
    "walker": Family(duty_paths.walker, (3.0, 30.0), (0.5, 3.0)),
    "collector": Family(duty_paths.collector, (2.0, 25.0), (0.5, 4.0)),
    "goalkeeper": Family(duty_paths.goalkeeper, (2.0, 20.0), (0.5, 3.0)),
    "pram": Family(outdoor_paths.pram, (3.0, 30.0), (0.5, 3.0)),
    "hound": Family(outdoor_paths.hound, (2.0, 25.0), (0.5, 4.0)),
    "hairpins": Family(outdoor_paths.hairpins, (2.0, 20.0), (0.5, 4.0)),
    "sprayer": Family(outdoor_paths.sprayer, (4.0, 35.0), (0.5, 4.0)),
    "dance": Family(practice_paths.dance, (3.0, 30.0), (0.5, 3.0)),
    "babble": Family(practice_paths.babble, (2.0, 20.0), (0.5, 4.0)),
    "novice": Family(practice_paths.novice, (3.0, 30.0), (0.5, 4.0)),
    "dolly": Family(practice_paths.dolly, (4.0, 35.0), (0.5, 4.0)),
    "yacht": Family(heeding_paths.yacht, (2.0, 25.0), (0.5, 4.0)),
    "sheepdog": Family(heeding_paths.sheepdog, (2.0, 20.0), (0.5, 4.0)),
    "trailer": Family(heeding_paths.trailer, (3.0, 30.0), (0.5, 4.0)),
    "waiter": Family(heeding_paths.waiter, (4.0, 35.0), (0.5, 3.0)),
    "vacuum": Family(fresh_paths.vacuum, (3.0, 30.0), (0.5, 4.0)),
    "bee": Family(fresh_paths.bee, (2.0, 25.0), (0.5, 4.0)),
    "statues": Family(fresh_paths.statues, (3.0, 30.0), (0.5, 3.0)),
    "rower": Family(fresh_paths.rower, (2.0, 25.0), (0.5, 4.0)),
    "moth": Family(wild_paths.moth, (2.0, 25.0), (0.5, 4.0)),
    "bull": Family(wild_paths.bull, (2.0, 20.0), (0.5, 4.0)),
    "curler": Family(wild_paths.curler, (3.0, 30.0), (0.5, 4.0)),
    "scribe": Family(wild_paths.scribe, (3.0, 30.0), (0.5, 3.0)),
    "barrel-racer": Family(course_paths.barrel_racer, (2.0, 25.0), (0.5, 4.0)),
    "half-pipe": Family(course_paths.half_pipe, (2.0, 20.0), (0.5, 3.0)),
    "trout": Family(course_paths.trout, (3.0, 30.0), (0.5, 4.0)),
    "comet": Family(course_paths.comet, (3.0, 30.0), (0.5, 4.0)),
    "fencer": Family(signal_paths.fencer, (2.0, 25.0), (0.5, 4.0)),
    "lighthouse": Family(signal_paths.lighthouse, (3.0, 30.0), (0.5, 4.0)),
    "rally": Family(signal_paths.rally, (2.0, 20.0), (0.5, 4.0)),
    "swing": Family(signal_paths.swing, (3.0, 30.0), (0.5, 4.0)),
    "teacups": Family(play_paths.teacups, (3.0, 30.0), (0.5, 4.0)),
    "micromouse": Family(play_paths.micromouse, (2.0, 20.0), (0.5, 4.0)),
    "glider": Family(play_paths.glider, (3.0, 30.0), (0.5, 4.0)),
    "sumo": Family(play_paths.sumo, (2.0, 25.0), (0.5, 4.0)),
    "coaster": Family(restless_paths.coaster, (2.0, 25.0), (0.5, 4.0)),
    "tumbleweed": Family(restless_paths.tumbleweed, (3.0, 30.0), (0.5, 4.0)),
    "typewriter": Family(restless_paths.typewriter, (2.0, 20.0), (0.5, 4.0)),
    "spinning-top": Family(restless_paths.spinning_top, (3.0, 30.0), (0.5, 4.0)),
    "hummingbird": Family(nimble_paths.hummingbird, (2.0, 25.0), (0.5, 4.0)),
    "skier": Family(nimble_paths.skier, (3.0, 30.0), (0.5, 4.0)),
    "yo-yo": Family(nimble_paths.yo_yo, (2.0, 20.0), (0.5, 4.0)),
    "ribbon": Family(nimble_paths.ribbon, (3.0, 30.0), (0.5, 4.0)),
    "dung-beetle": Family(animal_paths.dung_beetle, (2.0, 25.0), (0.5, 4.0)),
    "tennis-player": Family(animal_paths.tennis_player, (3.0, 30.0), (0.5, 4.0)),
    "squirrel": Family(animal_paths.squirrel, (2.0, 20.0), (0.5, 4.0)),
    "dressage": Family(animal_paths.dressage, (3.0, 30.0), (0.5, 4.0)),
    "snooker-ball": Family(sport_paths.snooker_ball, (3.0, 30.0), (0.5, 4.0)),
    "road-roller": Family(sport_paths.road_roller, (3.0, 30.0), (0.5, 4.0)),
    "otter": Family(sport_paths.otter, (3.0, 30.0), (0.5, 4.0)),
    "matador": Family(sport_paths.matador, (3.0, 30.0), (0.5, 4.0)),
}
"""From one switch in .5 s (stop-go, friction-limit) to one a minute (square-wave, straight)."""


def log_uniform(low: float, high: float, rng: Rng, n: int) -> np.ndarray:
    """``n`` numbers whose logarithm is uniform."""
    return np.exp(rng.uniform(np.log(low), np.log(high), n))


def mode_history(duration_s: float, family: Family, rng: Rng) -> ModeTrack:
    """Ideal rolling first; then intervals of skidding and of slipping, mostly with ideal rolling between.

    One in six skids or slips follows another one directly. How often the robot skids rather than slips is
    drawn once a log.
    """
    n = int(duration_s / min(family.ideal_s[0], family.lost_s[0])) + 2
    skids = rng.uniform(0.0, 1.0, n) < rng.uniform(0.3, 0.8)
    lost = np.where(skids, ContactMode.SKIDDING, ContactMode.SLIPPING)
    mode = np.stack([np.zeros(n, np.int64), lost], axis=1).ravel()
    lengths = np.stack([log_uniform(*family.ideal_s, rng, n), log_uniform(*family.lost_s, rng, n)], 1).ravel()
    directly = (np.arange(2 * n) % 2 == 0) & (np.repeat(rng.uniform(0.0, 1.0, n), 2) < 1 / 6)
    directly[0] = False
    mode, lengths = mode[~directly], lengths[~directly]
    starts_s = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    kept = (starts_s < duration_s) & (np.diff(mode, prepend=-1) != 0)
    return ModeTrack(np.rint(starts_s[kept] * NS_PER_S).astype(np.int64), mode[kept].astype(np.int8))


def drawn_drive(family: str, duration_s: float, rng: Rng) -> Drive:
    """One drive of the family."""
    chosen = FAMILIES[family]
    return Drive(chosen.path(duration_s, rng), mode_history(duration_s, chosen, rng))

"""What the scenarios' robots drive: a lively mixture, and an hour in a warehouse."""

from collections.abc import Iterator

import numpy as np

from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Profile, Waypoints
from wmr_synth.driving.patrol import ramped
from wmr_synth.wheel_speed.plan import Driver

STOP, REVERSE, SPIN, STRAIGHT = 0.12, 0.2, 0.12, 0.25
"""Shares of the targets of a lively drive: stops, reversals, turns on the spot; and of those that go
straight.
"""
AISLES, CROSS_M, AISLE_M = 6, 3.0, 24.0
"""A warehouse: rows, the distance from one to the next, their length."""
Leg = tuple[float, float, float]
"""Duration in s, speed in m/s, yaw rate in rad/s."""


def lively(v_mps: float, yaw_rate_radps: float) -> Driver:
    """Targets held for 2 to 5 s, up to the given speed and yaw rate, reached on ramps of .6 to 2 m/s²."""

    def driver(duration_s: float, rng: np.random.Generator) -> Profile:
        n = int(np.ceil(duration_s / 2.0)) + 1
        kind = rng.uniform(0.0, 1.0, n)
        ahead, back = rng.uniform(0.3, 1.0, n) * v_mps, -rng.uniform(0.2, 0.6, n) * v_mps
        spins = kind < STOP + SPIN
        speed = np.where(spins, 0.0, np.where(kind < STOP + SPIN + REVERSE, back, ahead))
        turning = rng.uniform(0.25, 1.0, n) * yaw_rate_radps * rng.choice((-1.0, 1.0), n)
        straight = (rng.uniform(0.0, 1.0, n) < STRAIGHT) & ~spins
        turning[straight | (kind < STOP)] = 0.0
        rates = rng.uniform(0.6, 2.0, n), rng.uniform(1.0, 3.0, n)
        return ramped(rng.uniform(2.0, 5.0, n), (speed, turning), rates)

    return driver


def profile_of(legs: Iterator[Leg], duration_s: float, rates: tuple[float, float]) -> Waypoints:
    """Legs one after another until ``duration_s`` is full, on ramps of ``rates`` in m/s² and rad/s²."""
    taken: list[Leg] = []
    total_s = 0.0
    while total_s < duration_s:
        taken.append(next(legs))
        total_s += taken[-1][0]
    lengths, speed, turning = (np.array(column) for column in zip(*taken, strict=True))
    return ramped(lengths, (speed, turning), (np.full(len(taken), rates[0]), np.full(len(taken), rates[1])))


def turn_by(angle_rad: float, yaw_rate_radps: float, v_mps: float) -> Leg:
    """A turn by an angle at a yaw rate: the ramp up is its own, the ramp down lies in the next leg."""
    size = abs(angle_rad)
    return size / yaw_rate_radps, v_mps, float(np.copysign(yaw_rate_radps, angle_rad))


def along(distance_m: float, v_mps: float) -> Leg:
    """A straight stretch."""
    return distance_m / v_mps, v_mps, 0.0


def warehouse_legs(rng: np.random.Generator) -> Iterator[Leg]:
    """Up one aisle and down the next, with stops at shelves, loading, a reversal out of a bay now and
    then.
    """
    side = 1.0
    while True:
        for aisle in range(AISLES):
            yield from aisle_legs(rng)
            last = aisle == AISLES - 1
            turn = side if aisle % 2 == 0 else -side
            if last:
                yield (0.8, 0.0, 0.0)
                yield turn_by(turn * np.pi, 0.8, 0.0)
                yield (0.8, 0.0, 0.0)
                yield (float(rng.uniform(15.0, 40.0)), 0.0, 0.0)
            else:
                cruise = float(rng.uniform(0.6, 0.9))
                yield turn_by(turn * np.pi / 2, 0.6, 0.5)
                yield along(CROSS_M, cruise)
                yield turn_by(turn * np.pi / 2, 0.6, 0.5)
        side = -side


def aisle_legs(rng: np.random.Generator) -> Iterator[Leg]:
    """An aisle with none to three stops; at some of them the robot turns to the shelf, loads, and backs
    out.
    """
    stops = int(rng.integers(0, 4))
    parts: F64 = np.diff(np.concatenate([[0.0], np.sort(rng.uniform(0.15, 0.85, stops)), [1.0]])) * AISLE_M
    for part in parts[:-1]:
        yield along(float(part), float(rng.uniform(0.9, 1.5)))
        yield (2.2, 0.0, 0.0)
        if rng.uniform() < 0.4:
            turn = float(rng.choice((-1.0, 1.0))) * np.pi / 2
            yield turn_by(turn, 0.7, 0.0)
            yield (0.6, 0.0, 0.0)
            yield along(1.2, 0.3)
            yield (float(rng.uniform(8.0, 30.0)), 0.0, 0.0)
            yield along(-1.2, -0.3)
            yield (0.6, 0.0, 0.0)
            yield turn_by(-turn, 0.7, 0.0)
            yield (0.6, 0.0, 0.0)
        else:
            yield (float(rng.uniform(4.0, 20.0)), 0.0, 0.0)
    yield along(float(parts[-1]), float(rng.uniform(0.9, 1.5)))


def warehouse(duration_s: float, rng: np.random.Generator) -> Profile:
    """Aisles, stops, turns and loading at up to 1.5 m/s, on ramps of .8 m/s² and 2 rad/s²."""
    return profile_of(warehouse_legs(rng), duration_s, (0.8, 2.0))

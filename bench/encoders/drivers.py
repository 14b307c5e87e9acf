"""Driver families: who drives, as references of speed and yaw rate.

A family's speeds are those of a differential drive; a skid-steer robot drives at .8 of them. Families share
nothing but the ramps: each has its own mixture of stops, turns, speeds and jerkiness.
"""

from collections.abc import Callable

import numpy as np

from wmr_schemas.arrays import F64
from wmr_synth.driving.drivers import Profile
from wmr_synth.driving.patrol import ramped
from wmr_synth.wheel_speed.plan import Driver

JOYSTICK_S, LOOK_S = 0.7, 0.05
"""A hand's correlation time, and the grid on which it is drawn."""


def held(
    lengths_s: tuple[float, float],
    targets: Callable[[int, np.random.Generator], tuple[F64, F64]],
    rates: tuple[tuple[float, float], tuple[float, float]],
) -> Driver:
    """Targets held for ``lengths_s``, reached on ramps of ``rates`` in m/s² and rad/s²."""

    def driver(duration_s: float, rng: np.random.Generator) -> Profile:
        n = int(np.ceil(duration_s / lengths_s[0])) + 1
        ramps = rng.uniform(*rates[0], n), rng.uniform(*rates[1], n)
        return ramped(rng.uniform(*lengths_s, n), targets(n, rng), ramps)

    return driver


def either(rng: np.random.Generator, n: int) -> F64:
    """Left or right."""
    return rng.choice((-1.0, 1.0), n)


def patrol(n: int, rng: np.random.Generator) -> tuple[F64, F64]:
    """Steady ahead at .6 to 1.3 m/s with gentle bends, a sharp corner every fourth time, rarely a stop."""
    speed, corner = rng.uniform(0.6, 1.3, n), np.arange(n) % 4 == 3
    turning = np.where(corner, rng.uniform(0.5, 1.0, n), rng.uniform(0.0, 0.25, n)) * either(rng, n)
    speed[corner] *= 0.6
    speed[rng.uniform(0.0, 1.0, n) < 0.08] = 0.0
    return speed, turning


def stop_and_go(n: int, rng: np.random.Generator) -> tuple[F64, F64]:
    """Go and stop in turn, a third of it in reverse, half of it while turning."""
    speed = np.where(np.arange(n) % 2 == 0, rng.uniform(0.5, 1.7, n), 0.0)
    speed[rng.uniform(0.0, 1.0, n) < 1 / 3] *= -0.6
    turning = rng.uniform(0.2, 0.9, n) * either(rng, n) * (rng.uniform(0.0, 1.0, n) < 0.5)
    turning[speed == 0.0] = 0.0
    return speed, turning


def spin_and_go(n: int, rng: np.random.Generator) -> tuple[F64, F64]:
    """Turn on the spot, then go straight, and again."""
    spins = np.arange(n) % 2 == 0
    speed = np.where(spins, 0.0, rng.uniform(0.4, 1.4, n))
    return speed, np.where(spins, rng.uniform(0.5, 1.5, n) * either(rng, n), 0.0)


def wander(n: int, rng: np.random.Generator) -> tuple[F64, F64]:
    """Any speed with any yaw rate, held for a second or two."""
    return rng.uniform(-0.5, 1.6, n), rng.uniform(-1.2, 1.2, n)


def teleop(duration_s: float, rng: np.random.Generator) -> Profile:
    """A hand at a joystick: jerky speed and turning at once; no ramps but the drive's."""
    n = int(np.ceil(duration_s / LOOK_S)) + 1
    stick = np.empty((n, 2))
    stick[0] = 0.0
    keep = np.exp(-LOOK_S / JOYSTICK_S)
    fresh = np.sqrt(1 - keep**2) * rng.normal(0.0, 1.0, (n, 2))
    for k in range(1, n):
        stick[k] = keep * stick[k - 1] + fresh[k]
    hands_on = np.sin(2 * np.pi * (np.arange(n) * LOOK_S / rng.uniform(6.0, 12.0) + rng.uniform())) > -0.6
    speed = np.clip(0.7 + 0.6 * stick[:, 0], -0.6, 1.6) * hands_on
    turning = np.clip(0.7 * stick[:, 1], -1.3, 1.3) * hands_on

    def profile(t_s: F64) -> tuple[F64, F64]:
        rows = np.minimum((t_s / LOOK_S).astype(int), n - 1)
        return speed[rows], turning[rows]

    return profile


def aisles(duration_s: float, rng: np.random.Generator) -> Profile:
    """Slow along straight aisles for 8 to 14 s, a quarter turn between two, a short stop now and then."""
    n = int(np.ceil(duration_s / 9.0)) + 1
    stops = np.where(rng.uniform(0.0, 1.0, n) < 0.4, rng.uniform(1.0, 2.5, n), 0.05)
    cruise, rate = rng.uniform(0.3, 0.8, n), rng.uniform(0.4, 0.8, n)
    lengths = np.stack([rng.uniform(8.0, 14.0, n), stops, np.pi / 2 / rate], axis=1).ravel()
    slow = np.stack([cruise, np.where(stops > 0.1, 0.0, cruise), 0.5 * cruise], axis=1).ravel()
    turning = np.stack([np.zeros(n), np.zeros(n), rate * either(rng, n)], axis=1).ravel()
    return ramped(lengths, (slow, turning), (np.full(3 * n, 0.5), np.full(3 * n, 1.5)))


def manoeuvres(duration_s: float, rng: np.random.Generator) -> Profile:
    """Three-point turns between slaloms: arcs ahead and back with a halt between two, then steering left and
    right in a sine at speed.
    """
    n = int(np.ceil(duration_s / 2.0)) + 1
    starts_s = np.cumsum(rng.uniform(2.0, 5.0, n))
    backs, slaloms = np.arange(n) % 5 == 1, np.arange(n) % 5 >= 3
    speed = np.where(slaloms, rng.uniform(0.7, 1.5, n), rng.uniform(0.3, 0.8, n)) * np.where(backs, -1.0, 1.0)
    turning = rng.uniform(0.3, 1.0, n) * either(rng, n)
    waves_s, halt_s, rise_s = rng.uniform(1.8, 5.0, n), rng.uniform(0.1, 0.8, n), rng.uniform(0.2, 0.7, n)

    def profile(t_s: F64) -> tuple[F64, F64]:
        leg = np.minimum(np.searchsorted(starts_s, t_s, side="right"), n - 1)
        since_s = t_s - np.concatenate([[0.0], starts_s])[leg]
        grown = np.clip((since_s - halt_s[leg]) / rise_s[leg], 0.0, 1.0)
        left = np.clip((starts_s[leg] - t_s) / rise_s[leg], 0.0, 1.0)
        share = np.minimum(grown, left)
        wave = np.where(slaloms[leg], np.sin(2 * np.pi * since_s / waves_s[leg]), 1.0)
        return share * speed[leg], share * turning[leg] * wave

    return profile


def docking(duration_s: float, rng: np.random.Generator) -> Profile:
    """Figures of eight, then slowly up to a dock, a stop, and backwards out of it on an arc."""
    n = int(np.ceil(duration_s / 12.0)) + 1
    rate, cruise = rng.uniform(0.5, 1.1, n), rng.uniform(0.3, 0.9, n)
    side, arc, still = either(rng, n), 2 * np.pi / rate * rng.uniform(0.5, 1.0, n), np.zeros(n)
    back, out = -rng.uniform(0.3, 0.6, n), rng.uniform(0.3, 0.9, n) * either(rng, n)
    lengths = [arc, arc, rng.uniform(2.0, 3.5, n), rng.uniform(1.0, 2.0, n), rng.uniform(2.0, 3.5, n)]
    speed = [cruise, cruise, rng.uniform(0.15, 0.3, n), still, back]
    turning = [side * rate, -side * rate, still, still, out]
    return legs(lengths, speed, turning, (0.7, 2.0))


def perimeter(duration_s: float, rng: np.random.Generator) -> Profile:
    """Along a fence for 10 to 20 s, hardly steering; its few corners are tight and all to one side."""
    n = int(np.ceil(duration_s / 10.0)) + 1
    side, rate, halves = float(rng.choice((-1.0, 1.0))), rng.uniform(0.9, 1.7, n), rng.uniform(5.0, 10.0, n)
    cruise, weave = rng.uniform(0.6, 1.3, n), rng.uniform(-0.05, 0.05, n)
    lengths = [halves, halves, 0.5 * np.pi / rate]
    return legs(
        lengths, [cruise, cruise, rng.uniform(0.1, 0.25, n)], [weave, -weave, side * rate], (0.8, 2.5)
    )


def orchard(duration_s: float, rng: np.random.Generator) -> Profile:
    """Up a row and down the next with a weave, half a circle at its end; here and there a stop and back."""
    n = int(np.ceil(duration_s / 10.0)) + 1
    cruise, rate, weave = rng.uniform(0.4, 0.9, n), rng.uniform(0.5, 0.9, n), rng.uniform(0.05, 0.2, n)
    side, stops = np.where(np.arange(n) % 2 == 0, 1.0, -1.0), rng.uniform(0.0, 1.0, n) < 1 / 3
    parts, still = [rng.uniform(2.0, 4.0, n) for _ in range(3)], np.zeros(n)
    back = [np.where(stops, 1.5, 0.05), np.where(stops, 2.0, 0.05)]
    lengths = [*parts, *back, np.pi / rate]
    speed = [cruise] * 3 + [np.where(stops, 0.0, cruise), np.where(stops, -0.3, cruise), 0.6 * cruise]
    turning = [weave, -1.5 * weave, 0.5 * weave, still, still, side * rate]
    return legs(lengths, speed, turning, (0.6, 1.5))


def legs(lengths_s: list[F64], speed: list[F64], turning: list[F64], rates: tuple[float, float]) -> Profile:
    """Rounds of legs, each a list of (n,) by leg, on ramps of ``rates`` in m/s² and rad/s²."""
    lengths, v_mps, yaw = (np.stack(part, axis=1).ravel() for part in (lengths_s, speed, turning))
    return ramped(lengths, (v_mps, yaw), (np.full(len(lengths), rates[0]), np.full(len(lengths), rates[1])))


FAMILIES: dict[str, Driver] = {
    "patrol": held((2.5, 6.0), patrol, ((0.5, 1.2), (1.0, 2.0))),
    "stop-and-go": held((2.0, 4.5), stop_and_go, ((0.6, 2.0), (1.0, 2.5))),
    "spin-and-go": held((1.5, 4.0), spin_and_go, ((0.6, 1.5), (1.5, 3.0))),
    "wander": held((1.0, 2.5), wander, ((0.8, 2.5), (1.5, 4.0))),
    "teleop": teleop,
    "aisles": aisles,
    "manoeuvres": manoeuvres,
    "docking": docking,
    "perimeter": perimeter,
    "orchard": orchard,
}
SKID_STEER_PACE = 0.8


def driver_of(family: str, pace: float) -> Driver:
    """The family's driver with its speeds times ``pace``."""

    def driver(duration_s: float, rng: np.random.Generator) -> Profile:
        profile = FAMILIES[family](duration_s, rng)

        def paced(t_s: F64) -> tuple[F64, F64]:
            v_mps, yaw_rate_radps = profile(t_s)
            return pace * v_mps, yaw_rate_radps

        return paced

    return driver

"""The library of manoeuvres: pieces of a drive that begin and end at rest, at one place and heading.

Each ends where it began, so that pieces in any order stay in the area. What does not close by itself is
retraced in reverse. Speeds are joined by straight lines, so that torques change in steps.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from wmr_replay.excite.bounds import Limits
from wmr_replay.excite.profile import GRID_S, Profile, joined, rest

Leg = tuple[float, float, float]
SHARES = (0.35, 0.65, 1.0)
GENTLE = 0.25
"""Share of the acceleration of a gentle manoeuvre."""


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """A piece of a drive with its family and parameters in words."""

    family: str
    words: str
    profile: Profile

    @property
    def duration_s(self) -> float:
        """Its length, the standstill before it included."""
        return self.profile.duration_s


def library(limits: Limits) -> tuple[Manoeuvre, ...]:
    """Every manoeuvre that keeps to the bounds, each behind a short standstill."""
    found = []
    still = rest(limits.settings.rest_s)
    for family, generate in FAMILIES.items():
        for words, profile in generate(limits):
            whole = still.then(profile)
            if limits.allow(whole):
                found.append(Manoeuvre(family, words, whole))
    return tuple(found)


def distance_legs(v: float, a: float, length: float) -> list[Leg]:
    """From rest to rest over exactly ``length``, at up to ``v`` and accelerating by up to ``a``."""
    top = min(v, float(np.sqrt(a * length)))
    ramp_s = on_grid(top / a)
    hold_s = on_grid(max(length / top - ramp_s, 0.0))
    top = length / (ramp_s + hold_s)
    return [(ramp_s, top, 0.0), (hold_s, top, 0.0), (ramp_s, 0.0, 0.0)]


def on_grid(seconds: float) -> float:
    """The next time on the knots' grid."""
    return float(np.ceil(seconds / GRID_S - 1e-9) * GRID_S)


def turn_legs(w: float, b: float, angle_rad: float) -> list[Leg]:
    """Turning on the spot by ``angle_rad``, at up to ``w`` with the angular acceleration ``b``."""
    return [(s, 0.0, np.sign(angle_rad) * rate) for s, rate, _ in distance_legs(w, b, abs(angle_rad))]


def steps(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Straight ahead and back in reverse, or turned about, at several speeds and accelerations."""
    for share, hard in product(SHARES, (GENTLE, 1.0)):
        v, a = share * limits.bounds.speed_mps, hard * limits.ahead_mps2
        ahead = Profile.of(distance_legs(v, a, limits.reach_m))
        kind = "hard" if hard == 1.0 else "gently"
        yield f"straight, {v:.2f} m/s, {kind}, and back in reverse", ahead.and_back()
        turn = Profile.of(turn_legs(limits.bounds.yaw_rate_radps, limits.turning_radps2 / 2, np.pi))
        yield f"straight, {v:.2f} m/s, {kind}, and back turned about", joined([ahead, turn, ahead, turn])


def reversals(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Ahead and back over and over: torques of one size and changing sign."""
    for half_s, hard in product((0.2, 0.5, 1.0), (0.5, 1.0)):
        a = hard * limits.ahead_mps2
        top = min(a * half_s / 2, limits.bounds.speed_mps)
        tops = alternating(top, max(2, round(3.0 / half_s)))
        legs = [(half_s / 2, top, 0.0), *((half_s, v, 0.0) for v in tops), (half_s / 2, 0.0, 0.0)]
        yield f"ahead and back, {a:.2f} m/s² for {half_s:.1f} s each", Profile.of(legs).and_back()


def alternating(top: float, n: int) -> list[float]:
    """−top, top, −top …"""
    return [-top if k % 2 == 0 else top for k in range(n)]


def spins(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Turns on the spot, left and right, at several rates and accelerations."""
    for share, hard in product(SHARES, (GENTLE, 1.0)):
        w, b = share * limits.bounds.yaw_rate_radps, hard * limits.turning_radps2
        left = Profile.of(turn_legs(w, b, np.pi))
        kind = "hard" if hard == 1.0 else "gently"
        yield f"turn on the spot, {w:.2f} rad/s, {kind}, left and right", left.then(left.mirrored())


def wiggles(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Left and right over and over on the spot."""
    for half_s, hard in product((0.2, 0.5, 1.0), (0.5, 1.0)):
        b = hard * limits.turning_radps2
        top = min(b * half_s / 2, limits.bounds.yaw_rate_radps)
        tops = alternating(top, 2 * max(1, round(2.0 / half_s)))
        legs = [(half_s / 2, 0.0, top), *((half_s, 0.0, w) for w in tops), (half_s / 2, 0.0, 0.0)]
        left = Profile.of(legs)
        yield (
            f"left and right on the spot, {b:.2f} rad/s² for {half_s:.1f} s each",
            left.then(left.mirrored()),
        )


def chirps(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Torques that change sign faster and faster, ahead or in yaw."""
    half_s = np.geomspace(0.9, 0.12, 14)
    for hard in (0.5, 1.0):
        a, b = hard * limits.ahead_mps2, hard * limits.turning_radps2
        a = min(a, limits.bounds.speed_mps / half_s[0])
        b = min(b, limits.bounds.yaw_rate_radps / half_s[0])
        yield f"chirp ahead, {a:.2f} m/s²", Profile.of(chirp_legs(a, 0.0, half_s)).and_back()
        turning = Profile.of(chirp_legs(0.0, b, half_s))
        yield f"chirp in yaw, {b:.2f} rad/s²", turning.then(turning.mirrored())


def chirp_legs(a: float, b: float, half_s: np.ndarray) -> list[Leg]:
    """Speeds that rise and fall by turns, each for a shorter time; up, down below 0, and so on."""
    legs: list[Leg] = []
    v = w = 0.0
    for k, seconds in enumerate(half_s):
        sign, rounded = (1.0 if k % 2 == 0 else -1.0), on_grid(seconds)
        v, w = v + sign * a * rounded, w + sign * b * rounded
        legs.append((rounded, v, w))
    settle = max(abs(v) / a if a else 0.0, abs(w) / b if b else 0.0)
    return [*legs, (settle, 0.0, 0.0)]


def circle_legs(v: float, radius_m: float, a: float, turns: float = 1.0) -> list[Leg]:
    """A circle to the left from rest to rest, of constant curvature."""
    return [(s, speed, speed / radius_m) for s, speed, _ in distance_legs(v, a, 2 * np.pi * radius_m * turns)]


def radii(limits: Limits) -> tuple[float, ...]:
    """Radii of circles that begin at the start: across, each is twice as far away."""
    return tuple(share * limits.reach_m / 2 for share in (0.4, 0.7, 1.0))


def curved_acceleration(limits: Limits, radius_m: float) -> float:
    """The acceleration that the outer wheel's torque allows on a circle."""
    base, most = limits.base, limits.torque_nm * limits.settings.torque_share
    return 2 * most / (1 / base.alpha + base.half_track_m / radius_m / base.alpha_yaw)


def eights(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """A circle to the left and one to the right, at several speeds."""
    for radius, share in product(radii(limits), SHARES):
        v = min(share * limits.bounds.speed_mps, share * limits.bounds.yaw_rate_radps * radius)
        left = Profile.of(circle_legs(v, radius, curved_acceleration(limits, radius) / 2))
        yield f"figure-eight, radius {radius:.1f} m, {v:.2f} m/s", left.then(left.mirrored())
        yield f"circle, radius {radius:.1f} m, {v:.2f} m/s, and back in reverse", left.and_back()


def ladders(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Speeds from slow to fast, each held, on a circle or on the spot."""
    shares = (0.2, 0.4, 0.6, 0.8, 1.0)
    for radius in radii(limits):
        top = min(limits.bounds.speed_mps, limits.bounds.yaw_rate_radps * radius)
        a = curved_acceleration(limits, radius) / 2
        legs: list[Leg] = []
        for share in shares:
            legs += [
                (0.2 * top / a, share * top, share * top / radius),
                (1.2, share * top, share * top / radius),
            ]
        left = Profile.of([*legs, (top / a, 0.0, 0.0)])
        yield f"speed ladder up to {top:.2f} m/s on a circle of {radius:.1f} m, and back", left.and_back()
    top, b = limits.bounds.yaw_rate_radps, limits.turning_radps2 / 2
    legs = []
    for share in shares:
        legs += [(0.2 * top / b, 0.0, share * top), (1.0, 0.0, share * top)]
    spin = Profile.of([*legs, (top / b, 0.0, 0.0)])
    yield f"ladder of yaw rates up to {top:.2f} rad/s on the spot, left and right", spin.then(spin.mirrored())


def slaloms(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """One speed at changing yaw rates, and back."""
    for share, half_s in product((0.3, 0.6), (0.6, 1.2)):
        v, a = share * limits.bounds.speed_mps, limits.ahead_mps2 / 2
        top = min(limits.turning_radps2 * half_s / 4, 0.8 * limits.bounds.yaw_rate_radps)
        legs: list[Leg] = [(v / a, v, 0.0), (half_s / 2, v, top)]
        legs += [(half_s, v, w) for w in alternating(top, 4)]
        wave = Profile.of([*legs, (half_s / 2, v, 0.0), (v / a, 0.0, 0.0)])
        yield f"slalom, {v:.2f} m/s, up to {top:.2f} rad/s, and back", wave.and_back()


def stars(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """The same straight piece, there and back, in four headings."""
    turn = Profile.of(turn_legs(limits.bounds.yaw_rate_radps, limits.turning_radps2 / 2, np.pi / 2))
    for share in (0.5, 1.0):
        v = share * limits.bounds.speed_mps
        piece = Profile.of(distance_legs(v, limits.ahead_mps2, 0.6 * limits.reach_m)).and_back()
        yield f"star of four headings, {v:.2f} m/s", joined([piece, turn] * 4)


def standstills(limits: Limits) -> Iterator[tuple[str, Profile]]:
    """Nothing at all: what still moves is no matter of torques."""
    yield "stand still", rest(4.0)


FAMILIES: dict[str, Callable[[Limits], Iterator[tuple[str, Profile]]]] = {
    "steps": steps,
    "reversals": reversals,
    "spins": spins,
    "wiggles": wiggles,
    "chirps": chirps,
    "figure-eights": eights,
    "speed ladders": ladders,
    "slaloms": slaloms,
    "stars": stars,
    "standstill": standstills,
}

"""Which single fault explains the factors between pose, wheel speeds, torques and the robot's parameters.

A quantity that is recorded f times too large shows in several comparisons at once, each in its own power of
f. The pattern tells the quantity: positions in millimetres change the speed and not the turning, wheel speeds
in rpm change both.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.ratios import WheelRatios
from wmr_replay.quality.response import Answer, Response
from wmr_replay.quality.turning import PathRatios
from wmr_replay.quality.votes import Tally
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.robot import RobotParameters

CODES = ("yaw_unit", "position_unit", "half_track", "wheel_speed_unit", "torque_unit")
YAW, POSITION, HALF_TRACK, WHEEL, TORQUE = range(len(CODES))
NONE, UNEXPLAINED = -1, -2
"""In place of a fault: all factors are near 1; they are not, and no single fault explains them."""

PATTERNS = np.array(
    [
        # speed, turning, path, torque ahead, torque turning
        [0.0, 1.0, 1.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 1.0],
        [-1.0, -1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0, -1.0],
    ]
)
"""Powers of f (faults, comparisons): motion over what wheel speeds or torques make of it; yaw over path."""

LOWEST = np.array([-0.2, -0.6, -0.5, -1.2, -1.2])
HIGHEST = np.array([0.2, 0.22, 0.5, 0.7, 0.7])
"""Decimal logarithms between which a comparison is no fault. Speeds: a factor of 1.6, more than tyres wear or
slip over half of a log. Turning: wheels that scrub turn the robot by up to 4 times less than the track says,
none turns it more. Path: drifting turns yaw and path apart, not 3 times. Torques: slipping takes up to nine
tenths of the answer, and nothing makes it 5 times as large.
"""
TOLERANCE = np.array([0.12, 0.3, 0.2, 0.7, 0.7])
"""How far a comparison may be from what a fault predicts. Torques: slipping and friction reduce the answer."""
PENALTY = np.array([0.5, 0.5, 0.2, 0.0, 0.0])
"""Where two faults explain the same: the one that leaves the answers more use is assumed."""
FAST_MPS, FAST_MPS2 = 60.0, 50.0
"""A median speed, or a median centripetal acceleration, that no wheeled robot has: 216 km/h, 5 g."""
LEAST_VOTES = 10
"""5 s of clear motion."""
MOST_SPREAD = np.array([0.2, 0.2, 0.8])
"""Interquartile range of a constant factor. Yaw in degrees at 10 Hz turns by whole circles between two poses;
its factor is wide, and far from 1 all the same.
"""
LEAST_T, LEAST_SHARE, LEAST_S = 6.0, 0.4, 10.0
"""An answer to torques that is beyond chance, is most of what moves the robot, and has been seen for 10 s."""


class Explained(NamedTuple):
    """After each of m cells: the comparisons' ``decades`` (5, m), NaN where unknown; ``fault`` (m,) an index
    of ``CODES``, ``NONE`` or ``UNEXPLAINED``; ``size`` (m,) its decades; ``alone`` (m,): no other explains.
    ``off`` (5, m): comparisons out of their bounds.
    """

    decades: F64
    off: Bool
    fault: I64
    size: F64
    alone: Bool


def compare(wheels: WheelRatios, path: PathRatios, response: Response, robot: RobotParameters) -> F64:
    """Decimal logarithms (5, m) of the comparisons, NaN where the log cannot tell."""
    tallies = wheels.ahead, wheels.turn, path.path
    voted = [constant(tally, spread) for tally, spread in zip(tallies, MOST_SPREAD, strict=True)]
    if robot.wheel_radius_m is None:
        voted[0] = voted[1] = np.full(len(response.n), np.nan)
    if robot.half_track_m is None:
        voted[1] = np.full(len(response.n), np.nan)
    alpha, alpha_turn = nominal_answers(robot)
    ahead = answered(response.ahead_by_sum, response.n, alpha)
    turn = answered(response.turn_by_difference, response.n, alpha_turn)
    return np.stack([*voted, ahead, turn])


def constant(tally: Tally, spread: float) -> F64:
    """The tally's decades (m,) where enough cells agree."""
    return np.where((tally.n >= LEAST_VOTES) & (tally.spread <= spread), tally.log10, np.nan)


def answered(answer: Answer, n: F64, nominal: float | None) -> F64:
    """Decades (m,) of the answer over the nominal one, where it is certain."""
    certain = (np.abs(answer.t) >= LEAST_T) & (answer.share >= LEAST_SHARE) & (n >= LEAST_S)
    return np.log10(np.where(certain, np.abs(answer.slope) / (nominal or np.nan), np.nan))


def nominal_answers(robot: RobotParameters) -> tuple[float | None, float | None]:
    """dv_long/dt and d(yaw rate)/dt per N·m of the efforts' sum and difference, by the robot's parameters.

    α where it is given, in whatever convention; else of a rigid robot, 1/(r (m + 2 I_φ/r²)).
    """
    ahead = robot.alpha
    if ahead is None and robot.mass_kg is not None and robot.wheel_radius_m is not None:
        wheels = 2 * (robot.wheel_inertia_kgm2 or 0.0) / robot.wheel_radius_m**2
        ahead = 1 / (robot.wheel_radius_m * (robot.mass_kg + wheels))
    turn = None
    if robot.alpha_yaw is not None and robot.half_track_m is not None:
        turn = robot.alpha_yaw / robot.half_track_m
    return ahead, turn


def explain(decades: F64, path: PathRatios) -> Explained:
    """The fault (m,) that explains the comparisons' ``decades`` (5, m) best."""
    known = np.isfinite(decades)
    off = known & ((decades < LOWEST[:, None]) | (decades > HIGHEST[:, None]))
    fast = is_fast(path)
    weight = np.where(known, TOLERANCE[:, None] ** -2.0, 0.0)
    values = np.where(known, decades, 0.0)
    power = PATTERNS[:, :, None]
    shown = (weight * power**2).sum(axis=1)
    size = (weight * power * values).sum(axis=1) / np.where(shown > 0, shown, 1.0)
    missed = np.abs(values - power * size[:, None]) / TOLERANCE[:, None]
    fits = (shown > 0) & (np.where(known, missed, 0.0) <= 1).all(axis=1) & off.any(axis=0)
    fits[POSITION] &= ~fast | (size[POSITION] > 0)
    fits[WHEEL] &= ~fast | np.isnan(decades[3])
    cost = np.where(fits, np.where(known, missed**2, 0.0).sum(axis=1) + PENALTY[:, None], np.inf)
    cost[POSITION] -= np.where(fast & fits[POSITION], 10.0, 0.0)
    best = np.argmin(cost, axis=0)
    found = np.where(fits.any(axis=0), best, np.where(off.any(axis=0), UNEXPLAINED, NONE))
    found = np.where(fast & (found < 0), POSITION, found)
    alone = (fits.sum(axis=0) == 1) | fast
    chosen = np.take_along_axis(size, np.maximum(found, 0)[None], axis=0)[0]
    return Explained(decades, off, found, chosen, alone)


def is_fast(path: PathRatios) -> Bool:
    """Whether (m,) the poses move as no wheeled robot does."""
    speed, lateral = path.speed_mps, path.lateral_mps2
    driven = (speed.n >= LEAST_VOTES) & (speed.log10 > np.log10(FAST_MPS))
    turned = (lateral.n >= LEAST_VOTES) & (lateral.log10 > np.log10(FAST_MPS2))
    return np.asarray(driven | turned)

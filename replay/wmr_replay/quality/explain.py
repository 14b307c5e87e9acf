"""Which single fault explains the factors between pose, wheel speeds, torques and the robot's parameters.

A quantity that is recorded f times too large shows in several comparisons at once, each in its own power of
f. The pattern tells the quantity: positions in millimetres change the speed and not the turning, wheel speeds
in rpm change both.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.plausibility_limits import LIMITS
from wmr_replay.quality.ratios import WheelRatios
from wmr_replay.quality.response import Answer, Response, is_certain
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

_BOUNDS = np.array([LIMITS.speed, LIMITS.turn, LIMITS.path, LIMITS.torque, LIMITS.torque]).T[:, :, None]
_TOLERANCE = np.array(LIMITS.tolerance)[:, None]
PENALTY = np.array([0.5, 0.5, 0.2, 0.0, 0.0])[:, None]
"""Where two faults explain the same: the one that leaves the answers more use is assumed."""


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
    voted = [constant(tally) for tally in (wheels.ahead, wheels.turn)]
    if robot.wheel_radius_m is None:
        voted[0] = voted[1] = np.full(len(response.n), np.nan)
    if robot.half_track_m is None:
        voted[1] = np.full(len(response.n), np.nan)
    alpha, alpha_turn = nominal_answers(robot)
    ahead = answered(response.ahead_by_sum, response.n, alpha)
    turn = answered(response.turn_by_difference, response.n, alpha_turn)
    return np.stack([*voted, yaw_over_path(path.path), ahead, turn])


def constant(tally: Tally) -> F64:
    """The tally's decades (m,) where enough cells agree."""
    agree = (tally.n >= LIMITS.least_votes) & (tally.spread <= LIMITS.most_spread)
    return np.where(agree, tally.log10, np.nan)


def yaw_over_path(tally: Tally) -> F64:
    """The tally's decades (m,) where a few cells agree well, or many roughly."""
    well = (tally.n >= LIMITS.least_path_votes) & (tally.spread <= LIMITS.most_spread)
    roughly = (tally.n >= LIMITS.least_votes) & (tally.spread <= LIMITS.most_path_spread)
    return np.where(well | roughly, tally.log10, np.nan)


def answered(answer: Answer, n: F64, nominal: float | None) -> F64:
    """Decades (m,) of the answer over the nominal one, where it is certain."""
    certain = is_certain(answer, n, LIMITS.least_share_size)
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
    """The fault (m,) that explains the comparisons' ``decades`` (5, m) best.

    A yaw that does not turn with its path is at fault whatever else is: speeds and accelerations along a
    wrong yaw say nothing. One that turns less than its path is left to the heading's monitor: it is of
    another body, or the robot moves sideways.
    """
    known, fast = np.isfinite(decades), is_fast(path)
    off = known & ((decades < _BOUNDS[0]) | (decades > _BOUNDS[1]))
    size, missed = fitted(decades, known)
    fits = (missed <= 1).all(axis=1) & (np.abs(size) >= LIMITS.least_fault) & off.any(axis=0)
    fits[YAW] &= ~known[2]
    fits[WHEEL] &= ~fast
    fits[POSITION] &= ~fast | (size[POSITION] > 0)
    cost = np.where(fits, (missed**2).sum(axis=1) + PENALTY, np.inf)
    fault = np.where(fits.any(axis=0), np.argmin(cost, axis=0), np.where(off.any(axis=0), UNEXPLAINED, NONE))
    fault = np.where(fast & (fault != HALF_TRACK), POSITION, fault)
    alone = (fits.sum(axis=0) == 1) | fast | off[2]
    size = np.take_along_axis(size, np.maximum(fault, 0)[None], axis=0)[0]
    fault = np.where(off[2], np.where(decades[2] > 0, YAW, NONE), fault)
    return Explained(decades, off, fault, np.where(off[2], decades[2], size), alone)


def fitted(decades: F64, known: Bool) -> tuple[F64, F64]:
    """Least-squares decades (faults, m) of each fault, and what it misses (faults, 5, m) in tolerances."""
    weight, values = np.where(known, _TOLERANCE**-2.0, 0.0), np.where(known, decades, 0.0)
    power = PATTERNS[:, :, None]
    shown = (weight * power**2).sum(axis=1)
    size = (weight * power * values).sum(axis=1) / np.where(shown > 0, shown, 1.0)
    return size, np.where(known, np.abs(values - power * size[:, None]) / _TOLERANCE, 0.0)


def is_fast(path: PathRatios) -> Bool:
    """Whether (m,) the poses move as no wheeled robot does."""
    speed, lateral = path.speed_mps, path.lateral_mps2
    driven = (speed.n >= LIMITS.least_votes) & (speed.log10 > np.log10(LIMITS.fast_mps))
    turned = (lateral.n >= LIMITS.least_votes) & (lateral.log10 > np.log10(LIMITS.fast_mps2))
    return np.asarray(driven | turned)

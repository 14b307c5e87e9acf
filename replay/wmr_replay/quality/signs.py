"""Which sign and which side the torques and wheel speeds have, by what the robot does in answer."""

from enum import IntEnum

import numpy as np

from wmr_replay.quality.plausibility_limits import LIMITS
from wmr_replay.quality.ratios import WheelRatios
from wmr_replay.quality.response import Answer, Response, is_certain
from wmr_replay.quality.turning import PathRatios
from wmr_replay.quality.votes import Tally
from wmr_schemas.arrays import F64, I64, Bool


class Torques(IntEnum):
    """What is wrong with the signs of the torques."""

    AS_THEY_SHOULD = 0
    REVERSED = 1
    LEFT_REVERSED = 2
    RIGHT_REVERSED = 3
    SWAPPED = 4
    REVERSED_AND_SWAPPED = 5
    TURN_REVERSED = 6
    """The turning answers the wrong way, and the speed changes too little to say more."""


class Wheels(IntEnum):
    """What is wrong with the signs of the wheel speeds."""

    AS_THEY_SHOULD = 0
    REVERSED = 1
    LEFT_REVERSED = 2
    RIGHT_REVERSED = 3
    SWAPPED = 4


def sign_of(answer: Answer, n: F64) -> I64:
    """Sign (m,) of an answer, 0 where it is not certain."""
    certain = is_certain(answer, n, LIMITS.least_share_sign)
    return np.where(certain, np.sign(answer.slope), 0).astype(np.int64)


def torque_signs(response: Response) -> I64:
    """:class:`Torques` (m,) after each cell.

    With one side reversed, the sum of the efforts is what was their difference: it then turns the robot, and
    their difference drives it. One of the two alone is believed where it is beyond doubt: a controller
    that compensates a disturbance makes either likely for a while.
    """
    n = response.n
    ahead, ahead_crossed = sign_of(response.ahead_by_sum, n), sign_of(response.ahead_by_difference, n)
    turn, turn_crossed = sign_of(response.turn_by_difference, n), sign_of(response.turn_by_sum, n)
    side = np.sign(ahead_crossed + turn_crossed)
    clear = (
        np.maximum(np.abs(response.ahead_by_difference.t), np.abs(response.turn_by_sum.t)) >= LIMITS.clear_t
    )
    seen = (ahead_crossed * turn_crossed > 0) | ((ahead_crossed * turn_crossed == 0) & clear)
    one_side = (ahead == 0) & (turn == 0) & seen
    return np.select(
        [
            one_side & (side > 0),
            one_side & (side < 0),
            (ahead < 0) & (turn > 0),
            ahead < 0,
            (ahead > 0) & (turn < 0),
            turn < 0,
        ],
        [
            Torques.LEFT_REVERSED,
            Torques.RIGHT_REVERSED,
            Torques.REVERSED_AND_SWAPPED,
            Torques.REVERSED,
            Torques.SWAPPED,
            Torques.TURN_REVERSED,
        ],
        Torques.AS_THEY_SHOULD,
    )


def wheel_signs(ratios: WheelRatios) -> I64:
    """:class:`Wheels` (m,) after each cell."""
    ahead, crossed, turn = (votes_sign(t) for t in (ratios.ahead, ratios.crossed, ratios.turn))
    return np.select(
        [(ahead < 0), (ahead == 0) & (crossed > 0), (ahead == 0) & (crossed < 0), (ahead > 0) & (turn < 0)],
        [Wheels.REVERSED, Wheels.LEFT_REVERSED, Wheels.RIGHT_REVERSED, Wheels.SWAPPED],
        Wheels.AS_THEY_SHOULD,
    )


def yaw_is_clockwise(path: PathRatios) -> Bool:
    """Whether (m,) the yaw turns against the path, as fast as the path."""
    against = path.path.negative >= 1 - LIMITS.most_exceptions
    return np.asarray(turns_as_fast(path.path) & against)


def yaw_is_right(path: PathRatios, seconds: F64) -> Bool:
    """Whether (m,) the yaw turns with the path, or none is followed for a long time."""
    along = turns_as_fast(path.path) & (path.path.negative <= LIMITS.most_exceptions)
    return np.asarray(along | ((path.path.n < LIMITS.least_path_votes) & (seconds >= LIMITS.long_s)))


def turns_as_fast(tally: Tally) -> Bool:
    """Whether (m,) enough votes put the yaw's turning near the path's."""
    alike = (tally.spread <= 2 * LIMITS.most_spread) & (np.abs(tally.log10) < LIMITS.most_spread)
    return np.asarray((tally.n >= LIMITS.least_path_votes) & alike)


def votes_sign(tally: Tally) -> I64:
    """Sign (m,) of a constant factor, 0 where the votes differ."""
    constant = (tally.n >= LIMITS.least_votes) & (tally.spread <= LIMITS.most_spread)
    along = tally.negative <= LIMITS.most_exceptions
    sign = np.where(along, 1, np.where(tally.negative >= 1 - LIMITS.most_exceptions, -1, 0))
    return np.where(constant, sign, 0).astype(np.int64)

"""Which sign and which side the torques and wheel speeds have, by what the robot does in answer."""

from enum import IntEnum

import numpy as np

from wmr_replay.quality.ratios import WheelRatios
from wmr_replay.quality.response import Answer, Response
from wmr_replay.quality.turning import PathRatios
from wmr_replay.quality.votes import Tally
from wmr_schemas.arrays import F64, I64, Bool

LEAST_T, LEAST_SHARE, LEAST_S = 6.0, 0.3, 10.0
"""An answer that is beyond chance, is a good part of what moves the robot, and has been seen for 10 s. Torques
that fight a slope or a bump answer to the motion with t up to 3 and shares below a fifth.
"""
LEAST_VOTES, MOST_SPREAD, MOST_EXCEPTIONS = 10, 0.2, 0.1
"""5 s of clear motion, a constant factor, and nine in ten votes of one sign."""


class Torques(IntEnum):
    """What is wrong with the signs of the torques."""

    AS_THEY_SHOULD = 0
    REVERSED = 1
    LEFT_REVERSED = 2
    RIGHT_REVERSED = 3
    SWAPPED = 4
    REVERSED_AND_SWAPPED = 5


class Wheels(IntEnum):
    """What is wrong with the signs of the wheel speeds."""

    AS_THEY_SHOULD = 0
    REVERSED = 1
    LEFT_REVERSED = 2
    RIGHT_REVERSED = 3
    SWAPPED = 4


def sign_of(answer: Answer, n: F64) -> I64:
    """Sign (m,) of an answer, 0 where it is not certain."""
    certain = (np.abs(answer.t) >= LEAST_T) & (answer.share >= LEAST_SHARE) & (n >= LEAST_S)
    return np.where(certain, np.sign(answer.slope), 0).astype(np.int64)


def torque_signs(response: Response) -> I64:
    """:class:`Torques` (m,) after each cell.

    With one side reversed, the sum of the efforts is what was their difference: it then turns the robot, and
    their difference drives it.
    """
    n = response.n
    ahead, ahead_crossed = sign_of(response.ahead_by_sum, n), sign_of(response.ahead_by_difference, n)
    turn, turn_crossed = sign_of(response.turn_by_difference, n), sign_of(response.turn_by_sum, n)
    one_side = (ahead == 0) & (ahead_crossed != 0) & (turn == 0) & (ahead_crossed * turn_crossed >= 0)
    return np.select(
        [
            one_side & (ahead_crossed > 0),
            one_side & (ahead_crossed < 0),
            (ahead < 0) & (turn > 0),
            ahead < 0,
            (ahead > 0) & (turn < 0),
        ],
        [
            Torques.LEFT_REVERSED,
            Torques.RIGHT_REVERSED,
            Torques.REVERSED_AND_SWAPPED,
            Torques.REVERSED,
            Torques.SWAPPED,
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
    tally = path.path
    alike = (tally.spread <= 2 * MOST_SPREAD) & (np.abs(tally.log10) < MOST_SPREAD)
    return np.asarray((tally.n >= LEAST_VOTES) & alike & (tally.negative >= 1 - MOST_EXCEPTIONS))


def votes_sign(tally: Tally) -> I64:
    """Sign (m,) of a constant factor, 0 where the votes differ."""
    constant, negative = (tally.n >= LEAST_VOTES) & (tally.spread <= MOST_SPREAD), tally.negative
    sign = np.where(negative <= MOST_EXCEPTIONS, 1, np.where(negative >= 1 - MOST_EXCEPTIONS, -1, 0))
    return np.where(constant, sign, 0).astype(np.int64)

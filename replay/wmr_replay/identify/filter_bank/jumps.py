"""Jumps of the pose: those that were found before the bank, and those that only the bank can suppose."""

import numpy as np

from wmr_replay.identify.filter_bank.hypotheses import Population, copy
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

RELEASE_SD = 30.0
"""Standard deviations of a bin's pose: a jump is taken out to within those of single rows."""
SURPRISE = 25.0
"""χ² of three degrees of freedom: a chance of 1.5e-5."""
JUMPS_PER_S = 1 / 3600
JUMP_M, JUMP_RAD = 1.0, 0.3
LEAST_LOG_WEIGHT = -9.0
SHOWS_S = 0.5


@compiled
def open_pose(people: Population, h: int, variances: tuple[float, float, float], now_s: float) -> None:
    """What a hypothesis knew of x, y and ψ holds no more, what it knew of the motion does."""
    for c in range(3):
        people.covariance[h, c, c] += variances[c]
    people.jumped_s[h] = now_s


@compiled
def release_pose(people: Population, variances: F64, now_s: float) -> None:
    """The pose is known to have jumped, and has been carried back."""
    wide = RELEASE_SD**2
    for h in range(people.size[0]):
        open_pose(people, h, (wide * variances[0], wide * variances[1], wide * variances[2]), now_s)


@compiled
def surprising(people: Population, pose: F64, variances: F64) -> bool:
    """Whether a bin's pose lies too far off for every hypothesis."""
    for h in range(people.size[0]):
        chi_square = 0.0
        for c in range(3):
            error = pose[c] - people.mean[h, c]
            chi_square += error * error / (people.covariance[h, c, c] + variances[c])
        if chi_square <= SURPRISE:
            return False
    return True


@compiled
def suppose_jump(people: Population, step_s: float, now_s: float) -> None:
    """A jump that nobody has found: a child of each probable hypothesis whose pose is open."""
    for parent in range(people.size[0]):
        child = people.size[0]
        if people.log_weight[parent] < LEAST_LOG_WEIGHT or child == people.mode.shape[0]:
            continue
        copy(people, parent, child)
        people.log_weight[child] += np.log(JUMPS_PER_S * step_s)
        open_pose(people, child, (JUMP_M**2, JUMP_M**2, JUMP_RAD**2), now_s)
        people.size[0] += 1


@compiled
def share_that_jumped(people: Population, now_s: float) -> float:
    """How probable it is that the pose has jumped within the last .5 s."""
    share = 0.0
    for h in range(people.size[0]):
        if now_s - people.jumped_s[h] < SHOWS_S:
            share += np.exp(people.log_weight[h])
    return share

"""Jumps of the pose: those found before the bank, and those that only the bank can hypothesise."""

import math

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, copy
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

RELEASE_VARIANCES = PRIORS.release_sd * PRIORS.release_sd
JUMP_VARIANCES = (
    PRIORS.jump_m * PRIORS.jump_m,
    PRIORS.jump_m * PRIORS.jump_m,
    PRIORS.jump_rad * PRIORS.jump_rad,
)
SURPRISE, SHOWS_S = PRIORS.surprise_chi2, PRIORS.jump_shows_s
JUMPS_PER_S, LEAST_LOG_WEIGHT = PRIORS.jumps_per_s, PRIORS.jump_log_weight


@lean
def open_pose(hypotheses: HypothesisSet, h: int, variances: tuple[float, float, float], now_s: float) -> None:
    """Widen x, y and ψ of a hypothesis by a jump; its velocities stay as they are."""
    for c in range(3):
        hypotheses.covariance[h, c, c] += variances[c]
    hypotheses.jumped_s[h] = now_s


@lean
def release_pose(hypotheses: HypothesisSet, variances: F64, now_s: float) -> None:
    """The pose is known to have jumped, and has been carried back."""
    wide = RELEASE_VARIANCES
    for h in range(hypotheses.size[0]):
        open_pose(hypotheses, h, (wide * variances[0], wide * variances[1], wide * variances[2]), now_s)


@lean
def surprising(hypotheses: HypothesisSet, pose: F64, variances: F64) -> bool:
    """Whether a bin's pose lies too far off for every hypothesis."""
    for h in range(hypotheses.size[0]):
        chi_square = 0.0
        for c in range(3):
            error = pose[c] - hypotheses.mean[h, c]
            chi_square += error * error / (hypotheses.covariance[h, c, c] + variances[c])
        if chi_square <= SURPRISE:
            return False
    return True


@lean
def hypothesise_jump(hypotheses: HypothesisSet, step_s: float, now_s: float) -> None:
    """A jump that the repair has not found: a child of each probable hypothesis whose pose is open."""
    for parent in range(hypotheses.size[0]):
        child = hypotheses.size[0]
        if hypotheses.log_weight[parent] < LEAST_LOG_WEIGHT or child == hypotheses.mode.shape[0]:
            continue
        copy(hypotheses, parent, child)
        hypotheses.log_weight[child] += math.log(JUMPS_PER_S * step_s)
        open_pose(hypotheses, child, JUMP_VARIANCES, now_s)
        hypotheses.size[0] += 1


@lean
def share_that_jumped(hypotheses: HypothesisSet, now_s: float) -> float:
    """How probable it is that the pose has jumped within the last .5 s."""
    share = 0.0
    for h in range(hypotheses.size[0]):
        if now_s - hypotheses.jumped_s[h] < SHOWS_S:
            share += math.exp(hypotheses.log_weight[h])
    return share

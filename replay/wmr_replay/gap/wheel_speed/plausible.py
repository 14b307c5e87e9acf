"""Whether wheel speeds and poses belong together at all: signs, sides, and logs of one robot."""

import numpy as np

from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.errors import InvalidSignal

AGAINST = -0.3
"""A slope of measured over predicted motion below this is a wrong sign. Judgement: slip leaves it above 0."""
APART = 0.1
"""Relative difference of two logs' slopes from which on they are said to be of two robots. Judgement: tyres
and loads change a radius by some per cent."""
LEAST_STEP = 0.02
"""Least predicted step of a bin that counts, m or rad."""


def check_signs(problem: Problem) -> None:
    """Raises InvalidSignal where the wheels turn against the motion, or the sides are swapped."""
    sign = "give left_sign = -1 and right_sign = -1 in [wheel_speeds] of --map"
    log_of_bin = problem.record.log_of[problem.bins.stretch]
    for k in range(int(log_of_bin.max()) + 1):
        ahead, turning = slopes(problem, log_of_bin == k)
        which = "" if not log_of_bin.any() else f"in log {k + 1} "
        if ahead < AGAINST:
            text = f"{which}the wheels turn backward where the robot drives ahead; {sign}"
            raise InvalidSignal("wheel speed", text)
        if turning < AGAINST:
            text = f"{which}left and right are swapped: turns by the wheels go the other way"
            raise InvalidSignal("wheel speed", text)


def slopes(problem: Problem, which: Bool) -> tuple[float, float]:
    """Measured over predicted steps of some bins (n,), ahead and in yaw: medians; NaN without driving."""
    block = problem.bins.block_of
    joined = which[1:] & which[:-1] & (block[1:] == block[:-1]) & (block[1:] >= 0)
    paths = problem.measured, problem.predicted({})
    measured, predicted = (np.diff(path, axis=1)[:, joined] for path in paths)
    return slope(measured[0], predicted[0]), slope(measured[2], predicted[2])


def slope(measured: F64, predicted: F64) -> float:
    """Median ratio of steps that are large enough."""
    large = np.abs(predicted) > LEAST_STEP
    return float(np.median(measured[large] / predicted[large])) if large.sum() > 5 else float("nan")


def logs_apart(problem: Problem) -> tuple[str, ...]:
    """A note where the logs' wheels roll differently: they may be of two robots."""
    log_of_bin = problem.record.log_of[problem.bins.stretch]
    found = [slopes(problem, log_of_bin == k)[0] for k in range(int(log_of_bin.max()) + 1)]
    known = [one for one in found if np.isfinite(one)]
    if len(known) < 2 or max(known) - min(known) < APART * abs(np.median(known)):
        return ()
    said = ", ".join("–" if not np.isfinite(one) else f"{one:.2f}" for one in found)
    return (f"the logs' wheels roll {said} times as far as stated: are these logs of one robot?",)

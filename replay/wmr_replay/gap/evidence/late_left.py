"""What a calibration log leaves open of a lag and of a delay.

Every motor lags, by some 10 to 40 ms. A base model holds what its calibration log shows of that; what a noisy
one does not show, other logs of the robot do, and it is no finding there.
"""

import numpy as np

from wmr_replay.gap.estimation.covariance import robust_covariance
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, gauss_newton
from wmr_replay.gap.evidence.answer import LATE, RESPONSES


def late_left(problem: Problem, fit: Fit) -> dict[str, float]:
    """The largest lag and delay, in s, that the log leaves beside the model ``fit``: the likeliest one and
    twice its standard deviation.
    """
    own, budget = problem.settings.misfit, problem.settings.budget
    found: dict[str, float] = {}
    for name in LATE:
        extension = fit.extension.with_effect(name, {RESPONSES[name]: own.lag_s})
        there = gauss_newton(problem, extension, fit.noise, budget.last_steps)
        (column,) = (j for j, (owner, _) in enumerate(there.keys) if owner == name)
        covariance, _ = robust_covariance(problem, there)
        open_to_s = own.in_sd * np.sqrt(covariance[column, column])
        found[name] = float(abs(there.values[column]) + open_to_s)
    return found

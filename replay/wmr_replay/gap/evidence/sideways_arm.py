"""A pose measured to one side of the robot, on a drive that turns one way: no finding."""

import numpy as np

from wmr_replay.gap.estimation.covariance import robust_covariance
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.significance import LEVER_ARM
from wmr_replay.gap.model.dictionary import columns_of, is_one_way


def is_sideways_one_way(name: str, problem: Problem, fit: Fit) -> str:
    """Why a lever arm of the model ``fit`` may be what holds back in turns; empty where it is not, or is
    another effect.

    To one side by y the pose moves y·yaw_rate slower than the robot: where it always turns the same way, so
    does a robot that turns brake more, or less, than a calibrated base model says. Ahead of the robot there
    is no such likeness.
    """
    if name != LEVER_ARM or not fit.extension.misfit:
        return ""
    own, misfit = problem.settings.significance, fit.extension.misfit
    sd = np.sqrt(np.diag(robust_covariance(problem, fit)[0]))[fit.keys.index((name, "x_m"))]
    ahead_m = abs(fit.extension.effects[name]["x_m"])
    turned = columns_of(problem.binned)["yaw_rate"]
    if ahead_m > max(own.component_sd * sd, misfit.get(name, 0.0)) or not is_one_way(turned, own.one_way):
        return ""
    return (
        f"{name} to one side would explain part of it, but on a drive that turns one way so would a robot "
        "that brakes otherwise in turns than the base model says: turn the other way, too"
    )

"""Why other tyres are no finding: skids at one place alone, a slippery patch of the ground there, and tyres
of which nothing is known.
"""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.significance import size_columns

TYRES = "cornering_stiffness"


def tyres_are_assumed(name: str, problem: Problem) -> str:
    """Why another cornering stiffness is no finding of a robot whose own is assumed, not known; empty where
    it is, or for another effect.
    """
    if name != TYRES or problem.binned.log.robot.skid_decay_mps2 is not None:
        return ""
    return (
        "another cornering stiffness than the assumed one would explain how the robot skids, and the robot's "
        "own is not known: give mass_kg and cornering_stiffness_over_epsilon, or mind where it skids: the "
        "ground may be slippery there"
    )


def skids_at_one_place(name: str, problem: Problem, fit: Fit) -> str:
    """Why another cornering stiffness of the model ``fit`` may be a patch of the ground; empty where it is
    not, or is another effect.
    """
    if name != TYRES:
        return ""
    own, places = problem.settings.selection, problem.binned.pose[:, :2]
    shown = np.square(fit.psi[:, :, size_columns(fit, name)]).sum(axis=(1, 2)) * problem.train
    share = shown / max(float(shown.sum()), 1e-300)
    x, y = share @ places
    beyond = np.hypot(*(places - (x, y)).T) > own.one_place_m
    if not beyond.any() or share[~beyond].sum() < own.most_at_one_place:
        return ""
    return (
        f"another cornering stiffness would explain skids about x {x:.1f} m, y {y:.1f} m alone: "
        "the ground may be slippery there. Skid in other places, too"
    )

"""The gap before and after, over windows that were held out and over those that were fitted."""

from typing import NamedTuple

from wmr_replay.gap.wheel_speed.estimate import Fit
from wmr_replay.gap.wheel_speed.evidence import folds_of
from wmr_replay.gap.wheel_speed.held_out import held_out_gaps
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_replay.gap.wheel_speed.windows import Gaps, Windows, gaps_of


class Proof(NamedTuple):
    """A model's gap: each window simulated with the fold that did not fit it, and with the fit to all."""

    held_out: Gaps
    trained: Gaps


def proof_of(problem: Problem, windows: Windows, fit: Fit, pose_sd: tuple[float, float]) -> Proof:
    """The gaps of one model. The base model has no parameters, and the same gaps either way."""
    trained = gaps_of(problem, windows, fit.values, pose_sd)
    if not fit.parameters:
        return Proof(trained, trained)
    return Proof(held_out_gaps(problem, windows, folds_of(problem, fit), pose_sd), trained)

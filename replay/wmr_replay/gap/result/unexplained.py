"""A disagreement in one time or place that no effect explains, though logs with nothing missing show none."""

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.placebo import placebo_p
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.slip_test import may_be_slipping
from wmr_schemas.model_file import Effect

GAINS = ("drive_gain", "yaw_inertia")
"""What a calibration leaves open of what torques do, ahead and in turning."""


def unexplained(problem: Problem, selection: Selection, seed: int) -> Effect | None:
    """The loss of traction that a selection without effects leaves as the largest; None where there is none.

    It is significant, larger than all that placebo logs show, and no slipping of the model's own. It failed
    another gate, of which the held-out gap is one: so it is no effect, and yet something is there. A loss no
    larger than what a calibrated base model leaves open of its gains may be theirs.
    """
    misfit = selection.base.extension.misfit
    left = max((misfit.get(name, 0.0) for name in GAINS), default=0.0)
    level = problem.settings.significance.level
    for one in selection.stages[0] if selection.stages else ():
        if one.name not in LOCAL or one.p_value > level or one.score <= 0:
            continue
        if one.fit.extension.effects[one.name]["loss"] <= left or may_be_slipping(problem, one.fit, one.name):
            continue
        if placebo_p(problem, selection.base, one.fit, one.name, seed) <= level:
            return Effect(one.name, dict(one.fit.extension.effects[one.name]))
    return None

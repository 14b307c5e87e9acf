"""Whether a slope moves the robot sideways where it is said to skid, as a log shows it.

Tyres that slide go downhill sideways as well. Where they hold while a label says skid, or creep there by far
less, that motion is not there: a slope that must explain it is fitted too small, or another effect takes its
place. So the likelier of both is taken.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.refit import Fit, fit_model


def with_likelier_skids(fit: Fit, name: str) -> Fit:
    """The fit in which a slope moves nothing sideways, where that is worth a parameter, ln n of the deviance.
    The fit itself for other effects, and where nothing skids.
    """
    problem, budget, extension = fit.problem, fit.problem.settings.budget, fit.extension
    if name != "slope" or extension.held_sideways or not np.any(problem.binned.skids):
        return fit
    held = replace(extension, held_sideways=True)
    again = fit_model(problem, held, fit.noise, budget.best_diffusion)
    return again if again.deviance < fit.deviance - np.log(3 * problem.train.sum()) else fit

"""How far the time or place of an effect may be moved before the log tells.

Where a robot stands, or gives no torque, the log does not say when a load came or traction was lost, and the
likelihood is flat: its curvature says nothing of how wide the flat part is.
"""

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.search.starts import shifted


def reach(problem: Problem, fit: Fit, name: str, key: str) -> tuple[float, float]:
    """The values of a time or place of the model ``fit`` up to which −2 log likelihood rises by no more than
    ``ReportSettings.flat``, everything else as it is; in steps of what an edge's form leaves open.
    """
    own = problem.settings.report
    step = own.edge_sd_s if key.endswith("_s") else own.edge_sd_m
    most = problem.deviance(fit.extension, fit.noise) + own.flat
    ends = []
    for by in (-step, step):
        extension, steps = fit.extension, 0
        while steps < own.most_steps:
            further = shifted(extension, name, key, by)
            stays = further.effects[name][key] == extension.effects[name][key]
            if stays or problem.deviance(further, fit.noise) > most:
                break
            extension, steps = further, steps + 1
        ends.append(extension.effects[name][key])
    return ends[0], ends[1]

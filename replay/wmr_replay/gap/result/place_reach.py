"""How far the time or place of an effect may be moved before the log tells.

Where a robot stands, or gives no torque, the log does not say when a load came or traction was lost, and the
likelihood is flat: its curvature says nothing of how wide the flat part is. Where the wheels slip as the
model knows it, a loss of traction tells no more: it may begin before such a slip, and end after it.
"""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.search.starts import shifted
from wmr_schemas.arrays import F64


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


def over_slips(binned: BinnedLog, ends: tuple[float, float], hole_s: float) -> tuple[float, float]:
    """The ends of an interval of when traction was lost or came back, moved over the slips that adjoin them;
    holes between slips of up to ``hole_s`` are of them.
    """
    t_s = binned.t_s[binned.slips]
    return -furthest(-ends[0], -t_s[::-1], hole_s), furthest(ends[1], t_s, hole_s)


def furthest(end_s: float, t_s: F64, hole_s: float) -> float:
    """How far the times (n,), which rise, go on from ``end_s`` without a hole of more than ``hole_s``."""
    chain = np.concatenate([[end_s], t_s[t_s > end_s]])
    holes = np.flatnonzero(np.diff(chain) > hole_s)
    return float(chain[holes[0] if len(holes) else -1])

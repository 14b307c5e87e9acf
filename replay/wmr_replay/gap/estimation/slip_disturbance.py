"""How exactly a log's slipping follows the model's.

While slipping, v_long and w walk at random beside what the model says, by q m/s per √s. A q that is too large
hides every loss of traction behind the name of slipping; one that is too small takes a tyre's own ways for a
loss. So q is the log's own: each slipping interval says by its likelihood how well it follows the model. One
interval counts up to a bound, since it may hide a loss of traction.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import F64


def with_slip_disturbance(problem: Problem, extension: Extension) -> GateSettings:
    """The problem's settings with the disturbance while slipping that its intervals ask for.

    q minimises Σ min(Dᵢ(q) − min Dᵢ, bound) + (ln q/usual)²/sd², Dᵢ the −2 log likelihood of interval i. It
    stays as large as it is where a robot's masses, and so what its slipping loses, are unknown.
    """
    settings = problem.settings
    if problem.binned.log.robot.slip_shares is None:
        return settings
    own, largest = settings.slip, settings.filter.slip_disturbance_mps2_rthz
    tried = np.array([q for q in own.disturbances_mps2_rthz if q <= largest])
    excess = own.disturbance_sd**-2 * np.log(tried / own.usual_mps2_rthz) ** 2
    if np.any(problem.binned.slips):
        by_interval = deviances_of_intervals(problem, extension, tried)
        worse = by_interval - by_interval.min(axis=0)
        excess = excess + np.minimum(worse, own.most_of_one).sum(axis=1)
    q = float(tried[int(np.argmin(excess))])
    return replace(settings, filter=settings.filter._replace(slip_disturbance_mps2_rthz=q))


def deviances_of_intervals(problem: Problem, extension: Extension, tried: F64) -> F64:
    """−2 log likelihood (q, intervals) of each slipping interval with its ends, at one common diffusion."""
    binned, settings = problem.binned, problem.settings
    noise = fit_diffusion(problem, extension, iterations=settings.budget.ranked_diffusion)
    edges = np.flatnonzero(np.diff(binned.slips, prepend=False, append=False)).reshape(-1, 2)
    found = np.zeros((len(tried), len(edges)))
    for k, q in enumerate(tried):
        by_q = replace(settings, filter=settings.filter._replace(slip_disturbance_mps2_rthz=float(q)))
        rows = replace(problem, binned=replace(binned, settings=by_q)).filtered(extension, noise).deviance
        sums = np.concatenate([[0.0], np.cumsum(rows)])
        ends = np.minimum(edges[:, 1] + binned.margin, len(rows))
        found[k] = sums[ends] - sums[np.maximum(edges[:, 0] - binned.margin, 0)]
    return found

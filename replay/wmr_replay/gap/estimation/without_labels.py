"""How far fitted sizes move where no row has a contact mode.

An answer is fitted with one history of contact modes, as if that were known. A skid that is too long
or a slip that is missed, moves the estimate, and neither the information nor the innovations show it: the
filter is sure of its modes. The likelihood of :mod:`.unknown_modes` sums over the modes of the whole log. Its
top is another estimate of the same sizes; where the labels are right, it is near. One step towards it,
along directions c_i of one standard deviation each, independent under the labels:

    step = −Σ_i c_i g_i / h_i,    g_i = ∂(−ln L)/∂c_i,    h_i = ∂²(−ln L)/∂c_i²

That two estimates of which one takes more for granted differ by what is wrong with it is the idea of Hausman,
Specification Tests in Econometrics, Econometrica 46 (1978) 1251.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, with_values
from wmr_replay.gap.estimation.unknown_modes import causal_deviance
from wmr_replay.gap.model.candidates import is_place
from wmr_schemas.arrays import F64


def step_without_labels(problem: Problem, fit: Fit) -> F64:
    """The step (q,) of the fitted parameters; 0 for times and places, and where the modes are not an
    identifier's.
    """
    own, step = problem.settings.unlabelled, np.zeros(len(fit.keys))
    sizes = [j for j, key in enumerate(fit.keys) if not is_place(*key)]
    if not sizes or not problem.binned.identified:
        return step
    keys, values = tuple(fit.keys[j] for j in sizes), fit.values[sizes]
    unlabelled = replace(problem, train=np.zeros(len(problem.binned), bool))

    def deviance(at: F64) -> float:
        return float(causal_deviance(unlabelled, with_values(fit.extension, keys, at), fit.noise).sum())

    here, h = deviance(values), own.difference_sd
    for direction in independent(fit.psi[problem.train][:, :, sizes]):
        ahead, back = deviance(values + h * direction), deviance(values - h * direction)
        slope, curvature = (ahead - back) / (4 * h), (ahead + back - 2 * here) / (2 * h * h)
        if np.isfinite(slope) and np.isfinite(curvature):
            step[sizes] -= slope / np.clip(curvature, own.least_information, 1.0) * direction
    shares = problem.settings.refit.dampings
    return step * next((share for share in shares if deviance(values + share * step[sizes]) < here), 0.0)


def independent(psi: F64) -> F64:
    """Directions (k, q) of one standard deviation each by the information ΨᵀΨ of Ψ (n, 3, q), which makes
    them independent; those that the data do not see are left out.
    """
    flat = psi.reshape(-1, psi.shape[2])
    scale = np.sqrt(np.maximum(np.einsum("ij,ij->j", flat, flat), 1e-12))
    seen, axes = np.linalg.eigh((flat.T @ flat) / np.outer(scale, scale))
    kept = seen > 1e-8 * max(float(seen[-1]), 1e-12)
    return np.asarray((axes[:, kept] / np.sqrt(seen[kept])).T / scale)

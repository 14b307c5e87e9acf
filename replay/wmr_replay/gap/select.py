"""Which effects are missing: leads fitted in full, the best accepted while it passes, up to three."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, t as student

from wmr_replay.gap.extension import Extension
from wmr_replay.gap.kalman import Diffusion
from wmr_replay.gap.problem import Problem, fit_noise
from wmr_replay.gap.refit import Fit, refit
from wmr_replay.gap.scan import Lead, scan
from wmr_schemas.arrays import F64

MOST_EFFECTS, MOST_FITTED = 3, 6
BLOCK_S, LEVEL = 2.0, 0.01


@dataclass(frozen=True, eq=False)
class Tried:
    """A lead fitted in full: its gain over the model before, and what was scanned to find it."""

    lead: Lead
    fit: Fit
    gain: float
    penalty: float
    tried: int
    p_value: float
    p_robust: float


def select(problem: Problem, extension: Extension, log=None):
    noise, deviance = fit_noise(problem, extension)
    current = refit(problem, extension, noise) if extension.effects else Fit(extension, noise, deviance, (), np.zeros((len(problem.drive),3,0)), problem.passed(extension, noise).innovations)
    found = []
    for _ in range(MOST_EFFECTS):
        tried = attempts(problem, current)
        if log is not None: log.append(tried)
        if not tried: break
        best = tried[0]
        if best.p_value > LEVEL or best.p_robust > LEVEL: break
        found.append(best); current = best.fit
    return current, found


def attempts(problem: Problem, current: Fit) -> list[Tried]:
    leads = scan(problem, current.extension, current.noise, current.psi)
    total = sum(l.tried for l in leads)
    worth = [l for l in leads if l.gain > max(8.0, 0.15 * leads[0].gain)][:MOST_FITTED]
    out = []
    for lead in worth:
        fit = refit(problem, current.extension.with_effect(lead.name, lead.parameters), current.noise)
        gain = current.deviance - fit.deviance
        k = len(lead.parameters)
        penalty = k * np.log(3 * problem.train.sum()) + 2 * np.log(lead.tried)
        p = float(min(1.0, chi2.sf(max(gain,0), k) * total))
        out.append(Tried(lead, fit, gain, penalty, total, p, robust_p(problem, fit, lead.name) * total))
    return sorted(out, key=lambda a: -(a.gain - a.penalty))


def robust_p(problem: Problem, fit: Fit, name: str) -> float:
    """Block-robust Wald test of the effect's size parameter."""
    size = [j for j, (n, key) in enumerate(fit.keys) if n == name and key not in ("t0_s", "start_s", "end_s", "x_m", "y_m", "radius_m")
            or (n == name and name == "pose_lever_arm")]
    psi = fit.psi[problem.train]; e = np.clip(fit.innovations[problem.train], -6, 6)
    block = (problem.drive.t_s[problem.train] // BLOCK_S).astype(int)
    _, block = np.unique(block, return_inverse=True)
    scores = np.zeros((block.max() + 1, psi.shape[2]))
    np.add.at(scores, block, np.einsum("ijk,ij->ik", psi, e))
    flat = psi.reshape(-1, psi.shape[2])
    info = flat.T @ flat
    d = np.sqrt(np.maximum(np.diag(info), 1e-12))
    inv = np.linalg.pinv(info / np.outer(d, d), rcond=1e-8) / np.outer(d, d)
    V = inv @ (scores.T @ scores) @ inv
    V = np.where(np.eye(len(V), dtype=bool), np.maximum(V, inv), V)
    nominal = {"torque_saturation": np.inf}
    values = fit.values
    ps = []
    for j in size:
        n, key = fit.keys[j]
        if n in ("torque_saturation", "undeclared_skid"):
            return 0.0
        ps.append(2 * student.sf(abs(values[j]) / np.sqrt(V[j, j]), len(scores) - 1))
    return min(ps)

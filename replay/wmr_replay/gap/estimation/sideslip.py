"""Elastic sideslip: tyres that grip creep sideways in a turn, by v·yaw_rate over a stiffness.

It is no skid and nothing that is missing, but it looks like a pose that is measured off the axle, and the
disturbance that makes up for it hides other effects. An undeclared skid with very stiff tyres describes it.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import fit_diffusion, with_calm_lateral
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import SKID
from wmr_replay.gap.model.dynamics import LEAST_SPEED_MPS
from wmr_replay.gap.model.extension import STIFFEST, Extension
from wmr_schemas.arrays import F64


def with_sideslip(problem: Problem, extension: Extension) -> Extension:
    """The extension with the log's elastic sideslip as a known effect, where the log shows any.

    One Gauss–Newton step from none, since v_lat is proportional to the compliance.
    """
    own = problem.settings.sideslip
    if any(name == SKID for name, _ in extension.acting):
        return extension
    noise = fit_diffusion(problem, extension, iterations=own.iterations)
    noise = with_calm_lateral(noise, problem.settings.diffusion)
    e = problem.filtered(extension, noise).innovations[problem.train]
    psi = creep_slope(problem, extension, noise)[problem.train]
    clipped = np.clip(e, -own.clip_sd, own.clip_sd)
    information = float(np.sum(psi * psi))
    if information <= 0.0:
        return extension
    compliance = float(np.sum(psi * clipped)) / information
    if (
        not 0.0 < compliance <= most_compliance(problem, extension)
        or compliance**2 * information < own.least_gain
    ):
        return extension
    return creeping(extension, min(compliance, 1 / STIFFEST))


def creep_slope(problem: Problem, extension: Extension, noise: Diffusion) -> F64:
    """−∂e/∂compliance (n, 3) of the innovations e; 0 where the model skids all the time."""
    if any(name == SKID and p["stiffness_ratio"] < STIFFEST for name, p in extension.acting):
        return np.zeros_like(problem.filtered(extension, noise).innovations)
    held = known_creep(extension)
    small = problem.settings.sideslip.difference / STIFFEST
    small = small if held + small <= 1 / STIFFEST else -small
    e, moved = (
        problem.filtered(one, noise).innovations for one in (extension, creeping(extension, held + small))
    )
    return np.asarray((e - moved) / small)


def known_creep(extension: Extension) -> float:
    """The compliance that the model holds as known, as a share of the skid's."""
    return float(sum(1 / p["stiffness_ratio"] for name, p in extension.known if name == SKID))


def most_compliance(problem: Problem, extension: Extension) -> float:
    """The largest compliance that is a sideslip, as a share of the skid's."""
    most_s = problem.settings.sideslip.most_s
    return most_s * extension.base.skid_decay_mps2 / usual_speed_mps(problem.binned)


def usual_speed_mps(binned: BinnedLog) -> float:
    """Root mean square of the speed over seconds, at least the model's floor."""
    t_s = np.arange(binned.t_s[0], binned.t_s[-1], 1.0)
    x, y = (np.interp(t_s, binned.t_s, binned.pose[:, k]) for k in (0, 1))
    return max(float(np.sqrt(np.mean(np.diff(x) ** 2 + np.diff(y) ** 2))), LEAST_SPEED_MPS)


def creeping(extension: Extension, compliance: float) -> Extension:
    """The extension whose tyres creep by ``compliance`` times what they skid."""
    others = (effect for effect in extension.known if effect[0] != SKID)
    known = (*others, (SKID, {"stiffness_ratio": 1 / compliance}))
    return replace(extension, known=known)

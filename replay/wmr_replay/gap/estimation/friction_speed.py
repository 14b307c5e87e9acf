"""The speed over which dry friction changes its sign, as a log shows it.

Friction is c₀ tanh(v/v₀). A robot that creeps, waits or turns on the spot balances its torques against a
part of c₀ that v₀ decides: with another v₀ the estimate of c₀ is off, and a bias or a lever arm seems to be
missing beside it. So v₀ is a nuisance parameter: where a friction is fitted, it is the likeliest of a few.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.refit import Fit, fit_model, gauss_newton
from wmr_schemas.arrays import F64
from wmr_schemas.effects import FRICTIONS


def has_own_speed(fit: Fit, name: str) -> bool:
    """Whether the effect is a friction that changes its sign over another speed than the usual one."""
    return name in FRICTIONS and fit.extension.friction_speed_mps > 0.0


def with_friction_speed(fit: Fit, name: str) -> Fit:
    """The fit at the likeliest speed, where the friction ``name`` was fitted and another speed is worth a
    parameter, ln n of the deviance. The fit itself for other effects.
    """
    if name not in FRICTIONS:
        return fit
    problem, budget, extension = fit.problem, fit.problem.settings.budget, fit.extension
    others = [replace(extension, friction_speed_mps=v) for v in problem.settings.refit.friction_speeds_mps]
    tried = [gauss_newton(problem, one, fit.noise, 1) for one in others]
    best = min(tried, key=lambda one: one.deviance)
    if best.deviance >= fit.deviance:
        return fit
    again = fit_model(problem, best.extension, fit.noise, budget.ranked_diffusion, budget.ranked_steps)
    return again if again.deviance < fit.deviance - np.log(3 * problem.train.sum()) else fit


def spread_of_speeds(fit: Fit) -> F64:
    """What not knowing v₀ adds to the covariance (q, q) of the fitted parameters θ̂:

        Σ_v w_v (θ_v − θ̂)(θ_v − θ̂)ᵀ,    w_v = exp(−D_v/2) / Σ_u exp(−D_u/2)

    with θ_v the parameters at the speed v, D_v the deviance there, every speed as likely as another.
    The speeds are closer than those that a fit tries: between two of them, c₀ moves by far more than noise
    moves it. 0 where no friction is fitted.
    """
    q, extension = len(fit.keys), fit.extension
    if not FRICTIONS & extension.effects.keys():
        return np.zeros((q, q))
    speeds = fit.problem.settings.report.friction_speeds_mps
    others = [replace(extension, friction_speed_mps=v) for v in speeds]
    steps = fit.problem.settings.budget.last_steps
    tried = [fit, *(gauss_newton(fit.problem, one, fit.noise, steps, places=False) for one in others)]
    deviances = np.array([one.deviance for one in tried])
    weights = np.exp((deviances.min() - deviances) / 2)
    off = np.array([one.values - fit.values for one in tried])
    return np.asarray(off.T @ (off * weights[:, None]) / weights.sum())

"""What the declared form of an effect leaves open, as a log shows it.

- Friction is c₀ tanh(v/v₀). A robot that creeps, waits or turns on the spot balances its torques against a
  part of c₀ that v₀ decides: with another v₀ the estimate of c₀ is off, and a bias or a lever arm seems to be
  missing beside it.
- A dead zone and a limit of the torques set in at once, or over a share of their threshold. What a sharp
  corner leaves of a round one looks like a gain beside it.

So v₀ and the share are nuisance parameters: where such an effect is fitted, they are the likeliest of a few.
"""

import numpy as np

from wmr_replay.gap.estimation.refit import Fit, fit_model, gauss_newton, keys_of
from wmr_schemas.arrays import F64
from wmr_schemas.effects import FRICTIONS, WITHHOLDING

FREEDOMS = {"friction_speed_mps": frozenset(FRICTIONS), "corner_share": frozenset(WITHHOLDING)}
"""Fields of an extension, and the effects whose form they are."""


def freedom_of(name: str) -> str:
    """The field that says the form of an effect; empty for one whose form is given."""
    return next((field for field, names in FREEDOMS.items() if name in names), "")


def has_own_form(fit: Fit, name: str) -> bool:
    """Whether the effect has another form than the usual one, as a friction with a speed of its own."""
    field = freedom_of(name)
    return bool(field) and getattr(fit.extension, field) > 0.0


def with_own_form(fit: Fit, name: str) -> Fit:
    """The fit in the likeliest form of the effect ``name``, where another than the usual one is worth a
    parameter, ln n of the deviance. The fit itself for effects whose form is given.
    """
    field = freedom_of(name)
    if not field:
        return fit
    problem, budget, values = fit.problem, fit.problem.settings.budget, fit.problem.settings.forms
    others = [fit.extension.in_form(field, value) for value in values.tried[field]]
    tried = [gauss_newton(problem, one, fit.noise, 1) for one in others]
    best = min(tried, key=lambda one: one.deviance)
    if best.deviance >= fit.deviance:
        return fit
    again = fit_model(problem, best.extension, fit.noise, budget.ranked_diffusion, budget.ranked_steps)
    return again if again.deviance < fit.deviance - np.log(3 * problem.train.sum()) else fit


def spread_of_forms(fit: Fit) -> F64:
    """What not knowing a form's freedom f adds to the covariance (q, q) of the fitted parameters θ̂:

        Σ_f w_f (θ_f − θ̂)(θ_f − θ̂)ᵀ,    w_f = exp(−D_f/2) / Σ_g exp(−D_g/2)

    with θ_f the parameters at f, D_f the deviance there, every value as likely as another. The values are
    closer than those that a fit tries: between two of them, c₀ moves by far more than noise moves it. 0 where
    no effect with such a freedom is fitted.
    """
    spread, values = np.zeros((len(fit.keys), len(fit.keys))), fit.problem.settings.forms
    steps, sizes = fit.problem.settings.budget.last_steps, keys_of(fit.extension, places=False)
    for field, names in FREEDOMS.items():
        if not names & fit.extension.effects.keys():
            continue
        others = [fit.extension.in_form(field, value) for value in values.reported[field]]
        tried = [fit, *(gauss_newton(fit.problem, one, fit.noise, steps, keys=sizes) for one in others)]
        deviances = np.array([one.deviance for one in tried])
        weights = np.exp((deviances.min() - deviances) / 2)
        off = np.array([one.values - fit.values for one in tried])
        spread += off.T @ (off * weights[:, None]) / weights.sum()
    return spread

"""What the declared form of an effect leaves open, as a log shows it.

- Friction is c₀ tanh(v/v₀). A robot that creeps, waits or turns on the spot balances its torques against a
  part of c₀ that v₀ decides: with another v₀ the estimate of c₀ is off, and a bias or a lever arm seems to be
  missing beside it.
- A scrub changes its sign so, too, as a tyre winds up on its patch before it slides; that takes more.
- A dead zone and a limit of the torques set in at once, or over a share of their threshold. What a sharp
  corner leaves of a round one looks like a gain beside it.

So v₀ and the share are nuisance parameters: where such an effect is fitted, they are the likeliest of a few,
and what lies between those is interpolated.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from wmr_replay.gap.estimation.refit import Fit, Keys, fit_model, gauss_newton, keys_of
from wmr_replay.gap.estimation.sticking import SCRUB
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


class Forms(NamedTuple):
    """The forms of a fitted effect: values f of its freedom (k,), which rise, and the fit at each.

    What lies between them is a cubic spline over √f, which spreads small values out.
    """

    freedoms: F64
    fits: tuple[Fit, ...]

    @property
    def deviances(self) -> F64:
        """−2 log likelihood (k,)."""
        return np.array([fit.deviance for fit in self.fits])

    @property
    def best(self) -> Fit:
        """The likeliest of them."""
        return self.fits[int(np.argmin(self.deviances))]

    def between(self) -> tuple[F64, F64, F64]:
        """Values of the freedom, evenly spread in √f (m,), the deviances (m,) and the parameters (m, q)."""
        if len(self.fits) == 1:
            return self.freedoms, self.deviances, self.best.values[np.newaxis]
        known = np.sqrt(self.freedoms)
        fine = np.linspace(known[0], known[-1], self.best.problem.settings.forms.fine)
        values = np.array([fit.values for fit in self.fits])
        return fine**2, CubicSpline(known, self.deviances)(fine), CubicSpline(known, values)(fine)


def with_own_form(fit: Fit, name: str) -> Fit:
    """The fit in the likeliest form of the effect ``name``, where another than the usual one is worth a
    parameter, ln n of the deviance. The fit itself for effects whose form is given.
    """
    field = freedom_of(name)
    if not field:
        return fit
    problem, budget, values = fit.problem, fit.problem.settings.budget, fit.problem.settings.forms
    tried = forms_at(fit, field, values.tried(field, name == SCRUB), 1, keys_of(fit.extension))
    if tried.best is fit:
        return fit
    for _ in range(values.looks):
        freedoms, deviances, _ = tried.between()
        likeliest = float(freedoms[np.argmin(deviances)])
        if np.isclose(likeliest, tried.freedoms, atol=values.alike).any():
            break
        tried = forms_at(fit, field, (*tried.freedoms, likeliest), 1, keys_of(fit.extension))
    again = fit_model(problem, tried.best.extension, fit.noise, budget.ranked_diffusion, budget.ranked_steps)
    return again if again.deviance < fit.deviance - np.log(3 * problem.train.sum()) else fit


def forms_at(fit: Fit, field: str, values: tuple[float, ...], steps: int, keys: Keys) -> Forms:
    """The fit beside those at other values of a freedom, with the parameters ``keys`` found again. A value at
    which the model runs away is left out.
    """
    here = getattr(fit.extension, field) or fit.problem.settings.forms.usual[field]
    fits = {here: fit}
    for value in map(float, values):
        if value != here:
            fits[value] = gauss_newton(
                fit.problem, fit.extension.in_form(field, value), fit.noise, steps, keys=keys
            )
    freedoms = sorted(value for value, one in fits.items() if np.isfinite(one.deviance))
    return Forms(np.array(freedoms), tuple(fits[value] for value in freedoms))


def spread_of_forms(fit: Fit) -> F64:
    """What not knowing a form's freedom f adds to the covariance (q, q) of the fitted parameters θ̂:

        ∫ w(f) (θ(f) − θ̂)(θ(f) − θ̂)ᵀ d√f,    w(f) = exp(−D(f)/2) / ∫ exp(−D(g)/2) d√g

    with θ(f) the parameters at f and D(f) the deviance there. Between two values that are fitted a threshold
    or a c₀ moves by far more than noise moves it. 0 where no effect with such a freedom is fitted.
    """
    spread, values = np.zeros((len(fit.keys), len(fit.keys))), fit.problem.settings.forms
    steps, sizes = fit.problem.settings.budget.last_steps, keys_of(fit.extension, places=False)
    for field, names in FREEDOMS.items():
        if not names & fit.extension.effects.keys():
            continue
        covered = values.reported(field, SCRUB in names & fit.extension.effects.keys())
        _, deviances, found = forms_at(fit, field, covered, steps, sizes).between()
        weights, off = np.exp((deviances.min() - deviances) / 2), found - fit.values
        spread += off.T @ (off * weights[:, None]) / weights.sum()
    return spread

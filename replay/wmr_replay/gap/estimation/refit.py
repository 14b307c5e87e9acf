"""Gauss–Newton on the whitened innovations: the effects' parameters at a fixed diffusion, or with it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.problem import Problem, identity_of
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.candidates import candidate_of, is_place
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings.filter import RefitSettings
from wmr_schemas.arrays import F64

Key = tuple[str, str]
Keys = tuple[Key, ...]


@dataclass(frozen=True, eq=False)
class Fit:
    """An extended model with its diffusion.

    ``deviance`` is −2 log likelihood of the fitted rows, infinite outside of all bounds; ``innovations``
    (n, 3) and ``row_deviance`` (n,) cover all rows.
    """

    problem: Problem
    extension: Extension
    noise: Diffusion
    deviance: float
    innovations: F64
    row_deviance: F64

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        return self.innovations.nbytes + self.row_deviance.nbytes

    @property
    def keys(self) -> Keys:
        """The free parameters (q,)."""
        return keys_of(self.extension)

    @cached_property
    def psi(self) -> F64:
        """Sensitivities (n, 3, q) of the innovations to ``keys``."""
        return sensitivities(self.problem, self.extension, self.noise, self.keys, self.innovations)

    @property
    def values(self) -> F64:
        """The fitted parameters (q,)."""
        return np.array([self.extension.effects[name][key] for name, key in self.keys])


def keys_of(extension: Extension, *, places: bool = True) -> Keys:
    """Every free parameter of the effects; without ``places``, not those that say when and where one acts."""
    return tuple(
        (name, key)
        for name in extension.effects
        for key in candidate_of(name).free
        if places or not is_place(name, key)
    )


def with_values(extension: Extension, keys: Keys, values: F64) -> Extension:
    """The extension with the parameters ``keys`` set to ``values`` (q,), clipped to their bounds."""
    effects = {name: dict(parameters) for name, parameters in extension.effects.items()}
    for (name, key), value in zip(keys, values, strict=True):
        effects[name][key] = float(np.clip(value, *candidate_of(name).bounds_at(key, effects[name])))
    return replace(extension, effects=effects)


def sensitivities(problem: Problem, extension: Extension, noise: Diffusion, keys: Keys, at: F64) -> F64:
    """Ψ (n, 3, q) = −∂e/∂parameter, by differences from the innovations ``at``."""
    psi, sizes, moved = np.zeros((*at.shape, len(keys))), [], []
    for name, key in keys:
        value, size = extension.effects[name][key], candidate_of(name).steps[key]
        if value + size > candidate_of(name).bounds[key][1]:
            size = -size
        sizes.append(size)
        moved.append((with_values(extension, ((name, key),), np.array([value + size])), noise))
    for j, (size, new) in enumerate(zip(sizes, problem.filtered_each(moved), strict=True)):
        psi[:, :, j] = (at - new.innovations) / size
    return psi


def gauss_newton(
    problem: Problem, extension: Extension, noise: Diffusion, steps: int, *, keys: Keys | None = None
) -> Fit:
    """Up to ``steps`` damped steps of the effects' parameters ``keys`` (default: all) at the diffusion
    ``noise``.

    After a step that lowers the deviance as much as it promises, innovations are linear there: the next step
    has the same Ψ. In times and places they never are: what a step promises there says little of a part of
    it.
    """
    keys = keys_of(extension) if keys is None else keys
    of = "model", identity_of(extension), tuple(extension.misfit.items()), noise, steps, keys
    return problem.fitted_once(of, lambda: stepwise(problem, extension, noise, steps, keys))


def stepwise(problem: Problem, extension: Extension, noise: Diffusion, steps: int, keys: Keys) -> Fit:
    """:func:`gauss_newton` where its answer is not known."""
    own = problem.settings.refit
    smooth = not any(is_place(*key) for key in keys)
    at, psi = evaluate(problem, extension, noise), None
    for _ in range(steps if keys and np.isfinite(at.deviance) else 0):
        held = psi is not None
        if psi is None:
            psi = sensitivities(problem, at.extension, noise, keys, at.innovations)[problem.fitted]
        step = newton_step(psi, at.innovations[problem.fitted], own)
        promised = float(np.square(psi.reshape(-1, len(keys)) @ step).sum())
        if smooth and promised < own.nothing:
            break
        dampings = own.dampings[:1] if held else own.dampings
        damping, tried = first_lower(at, keys, step, dampings)
        if tried is None and held:
            psi = None
            continue
        if tried is None:
            break
        gained, at = at.deviance - tried.deviance, tried
        if gained < own.enough:
            break
        linear = damping == 1.0 and abs(gained - promised) <= own.linear * promised
        psi = psi if smooth and linear else None
    return at


def first_lower(at: Fit, keys: Keys, step: F64, dampings: tuple[float, ...]) -> tuple[float, Fit | None]:
    """The first share of a step that lowers the deviance, and the model there; None where none does."""
    values = np.array([at.extension.effects[name][key] for name, key in keys])
    for damping in dampings:
        tried = evaluate(at.problem, with_values(at.extension, keys, values + damping * step), at.noise)
        if tried.deviance < at.deviance:
            return damping, tried
    return 0.0, None


def evaluate(problem: Problem, extension: Extension, noise: Diffusion) -> Fit:
    """The model as it is, without a step."""
    output = problem.filtered(extension, noise)
    deviance = float(output.deviance[problem.fitted].sum())
    deviance = deviance if np.isfinite(deviance) else np.inf
    return Fit(problem, extension, noise, deviance, output.innovations, output.deviance)


def fit_model(
    problem: Problem,
    extension: Extension,
    noise: Diffusion | None = None,
    iterations: int | None = None,
    steps: int | None = None,
) -> Fit:
    """Effects and diffusion at the greatest likelihood, in turns.

    When and where an effect acts comes from all rows: an end of it may lie among those that are held out.
    ``noise`` is where the diffusion starts (default: the prior's median), ``iterations`` its budget and
    ``steps`` that of the effects before the diffusion is fitted again (defaults: the settings').
    """
    budget = problem.settings.budget
    if any(is_place(*key) for key in keys_of(extension)) and not np.all(problem.train):
        whole = fit_model(problem.all_fitted(), extension, noise, iterations, steps)
        noise = fit_diffusion(problem, whole.extension, whole.noise, iterations)
        keys = keys_of(whole.extension, places=False)
        return gauss_newton(problem, whole.extension, noise, budget.last_steps, keys=keys)
    if not extension.effects:
        return evaluate(problem, extension, fit_diffusion(problem, extension, noise, iterations))
    if noise is None:
        noise = fit_diffusion(problem, extension, None, iterations)
    extension = gauss_newton(problem, extension, noise, steps or budget.steps).extension
    noise = fit_diffusion(problem, extension, noise, iterations)
    return gauss_newton(problem, extension, noise, budget.last_steps)


def cost_of(fit: Fit) -> float:
    """−2 log of the joint probability of modes and poses over the whole log; less is more likely.

    Changes of the mode are rare, and cost accordingly. Rows that were held out of the fit count as well: a
    time or place that is lost is often among them.
    """
    modes, settings = fit.problem.binned.mode, fit.problem.settings.modes
    return float(fit.row_deviance.sum() + np.sum(np.diff(modes) != 0) * settings.change_cost)


def newton_step(psi: F64, e: F64, settings: RefitSettings) -> F64:
    """(ΨᵀΨ)⁻¹ Ψᵀe (q,); directions that the data do not see, or that lead out of all bounds, stay at 0."""
    psi = np.where(np.isfinite(psi), psi, 0.0)
    flat = psi.reshape(-1, psi.shape[2])
    scale = np.sqrt(np.maximum(np.einsum("ij,ij->j", flat, flat), 1e-12))
    solution, *_ = np.linalg.lstsq(flat / scale, clipped(e, settings).ravel(), rcond=1e-6)
    return np.asarray(solution / scale)


def clipped(e: F64, settings: RefitSettings) -> F64:
    """Whitened innovations, outliers clipped at six times the usual size under this model."""
    limit = settings.clip_sd * max(1.0, float(np.median(np.abs(e))) / settings.normal_median)
    return np.asarray(np.clip(e, -limit, limit))

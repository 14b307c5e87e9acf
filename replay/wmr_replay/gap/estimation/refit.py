"""Effects fitted in full: Gauss–Newton on the whitened innovations, in turns with the diffusion."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.candidates import candidate_of, is_place
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64

Key = tuple[str, str]
Keys = tuple[Key, ...]
CLIP, ENOUGH = 6.0, 0.1
NORMAL_MEDIAN = 0.6745


@dataclass(frozen=True, eq=False)
class Fit:
    """An extended model with its diffusion, and its innovations (n, 3) and deviance (n,) over all rows."""

    problem: Problem
    extension: Extension
    noise: Diffusion
    deviance: float
    innovations: F64
    row_deviance: F64

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


def replaced(extension: Extension, keys: Keys, values: F64) -> Extension:
    """The parameters named by ``keys`` set to ``values``, within their bounds."""
    effects = {name: dict(parameters) for name, parameters in extension.effects.items()}
    for (name, key), value in zip(keys, values, strict=True):
        effects[name][key] = float(np.clip(value, *candidate_of(name).bounds[key]))
    return replace(extension, effects=effects)


def sensitivities(problem: Problem, extension: Extension, noise: Diffusion, keys: Keys, at: F64) -> F64:
    """Ψ (n, 3, q) = −∂e/∂parameter, by differences from the innovations ``at``."""
    psi = np.zeros((*at.shape, len(keys)))
    for j, (name, key) in enumerate(keys):
        value, size = extension.effects[name][key], candidate_of(name).steps[key]
        if value + size > candidate_of(name).bounds[key][1]:
            size = -size
        moved = replaced(extension, ((name, key),), np.array([value + size]))
        psi[:, :, j] = (at - problem.passed(moved, noise).innovations) / size
    return psi


def gauss_newton(
    problem: Problem, extension: Extension, noise: Diffusion, steps: int = 4, *, places: bool = True
) -> Fit:
    """Damped steps until the deviance stops falling; without ``places``, when and where effects act stays."""
    keys = keys_of(extension, places=places)
    passed = problem.passed(extension, noise)
    deviance = float(passed.deviance[problem.train].sum())
    for _ in range(steps if keys and np.isfinite(deviance) else 0):
        psi = sensitivities(problem, extension, noise, keys, passed.innovations)
        move = newton_step(psi[problem.train], passed.innovations[problem.train])
        values = np.array([extension.effects[name][key] for name, key in keys])
        for damping in (1.0, 0.4, 0.1):
            tried = replaced(extension, keys, values + damping * move)
            new = problem.passed(tried, noise)
            new_deviance = float(new.deviance[problem.train].sum())
            if new_deviance < deviance:
                break
        else:
            break
        gained, extension, passed, deviance = deviance - new_deviance, tried, new, new_deviance
        if gained < ENOUGH:
            break
    deviance = deviance if np.isfinite(deviance) else np.inf
    return Fit(problem, extension, noise, deviance, passed.innovations, passed.deviance)


def newton_step(psi: F64, e: F64) -> F64:
    """(ψᵀψ)⁻¹ ψᵀe; directions that the data do not see, or that lead out of all bounds, are left alone."""
    psi = np.where(np.isfinite(psi), psi, 0.0)
    flat = psi.reshape(-1, psi.shape[2])
    scale = np.sqrt(np.maximum(np.einsum("ij,ij->j", flat, flat), 1e-12))
    solution, *_ = np.linalg.lstsq(flat / scale, clipped(e).ravel(), rcond=1e-6)
    return np.asarray(solution / scale)


def clipped(e: F64) -> F64:
    """Whitened innovations, the outliers among them clipped at six times what is usual for this model."""
    limit = CLIP * max(1.0, float(np.median(np.abs(e))) / NORMAL_MEDIAN)
    return np.asarray(np.clip(e, -limit, limit))


def inverse_information(psi: F64) -> F64:
    """(ψᵀψ)⁻¹ (q, q) of (n, 3, q); directions that the data do not see have no variance of their own."""
    flat = psi.reshape(-1, psi.shape[2])
    d = np.sqrt(np.maximum(np.einsum("ij,ij->j", flat, flat), 1e-12))
    return np.asarray(np.linalg.pinv((flat.T @ flat) / np.outer(d, d), rcond=1e-8) / np.outer(d, d))

"""The effects of a selection with intervals, confounds and alternatives, and the extended model."""

from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from wmr_replay.effects.efforts import combined
from wmr_replay.gap.estimation.diffusion import noise_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.spread import interval_covariance
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import declaration_of, is_place
from wmr_replay.gap.model.confounds import confound_class, separate_with
from wmr_replay.gap.model.extension import WEIGHTS
from wmr_replay.gap.result.gain_or_payload import with_twin
from wmr_replay.gap.result.place_reach import over_slips, place_covariance, reach
from wmr_replay.gap.result.result import Alternative, Estimate, FoundEffect
from wmr_replay.gap.result.shown_by import shown_by
from wmr_replay.gap.scan.misfit import misfit_beside
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.settings.result import ReportSettings
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.model_file import Effect, Model

SLIPS_IN_TIME = "slip_interval"


def found_effects(problem: Problem, selection: Selection) -> tuple[FoundEffect, ...]:
    """The effects with 95 % intervals by Student's t over blocks, confound classes and alternatives."""
    if not selection.found:
        return ()
    fit, own = selection.fit, problem.settings.report
    V, n_blocks = interval_covariance(problem, fit)
    V = V + place_covariance(fit, problem.binned)
    width = -stdtrit(max(n_blocks - len(V), own.least_blocks), own.interval_tail) * np.sqrt(np.diag(V))
    names = tuple(effect.name for effect in selection.found)
    estimates: dict[str, dict[str, Estimate]] = {name: {} for name in names}
    for (name, key), value, w in zip(fit.keys, fit.values, width, strict=True):
        ci95 = float(value - w), float(value + w)
        if is_place(name, key):
            low, high = reach(problem.all_fitted(), fit, name, key)
            wide = min(ci95[0], low), max(ci95[1], high)
            if name == SLIPS_IN_TIME:
                wide = over_slips(problem.binned, wide, own.slip_hole_s)
            ci95 = within_the_log(problem.binned, key, float(value), wide)
        elif key == "loss":
            ci95 = max(ci95[0], min(0.0, float(value))), min(ci95[1], max(1.0, float(value)))
        estimates[name][key] = Estimate(float(value), ci95, declaration_of(name).units[key])
    misfit = problem.settings.misfit
    found = (with_twin(effect, fit.extension, misfit) for effect in selection.found)
    return tuple(
        reported(effect, estimates[effect.name], confound_class(names, effect.name), own) for effect in found
    )


def reported(
    effect: FittedCandidate,
    parameters: dict[str, Estimate],
    confounds: tuple[str, ...],
    settings: ReportSettings,
) -> FoundEffect:
    """One effect as the result holds it."""
    form = declaration_of(effect.name)
    alternatives = tuple(
        Alternative(other, delta, separate_with(effect.name, (other,)))
        for other, delta in effect.alternatives
    )
    close = tuple(a.name for a in alternatives if a.delta_bic < settings.ambiguous_bic)
    return FoundEffect(
        name=effect.name,
        channel=form.channel,
        formula=form.formula,
        parameters=parameters,
        confound_class=confounds,
        alternatives=alternatives,
        p_value=effect.p_value,
        separate_with=separate_with(effect.name, close),
        **shown_by(effect.name)._asdict(),
    )


def within_the_log(
    binned: BinnedLog, key: str, value: float, ci95: tuple[float, float]
) -> tuple[float, float]:
    """The interval of a time or place, clipped to the log and its path."""
    x_m, y_m = binned.pose[:, 0], binned.pose[:, 1]
    across_m = float(np.hypot(np.ptp(x_m), np.ptp(y_m)))
    spans = {"x_m": (x_m.min(), x_m.max()), "y_m": (y_m.min(), y_m.max()), "radius_m": (0.0, across_m)}
    first, last = spans.get(key, (binned.t_s[0], binned.t_s[-1]))
    return max(ci95[0], min(float(first), value)), min(ci95[1], max(float(last), value))


def extended_model(model: BaseModel, effects: tuple[FoundEffect, ...], fit: Fit, binned: BinnedLog) -> Model:
    """The base model with the effects found, as a file holds it."""
    in_sd = binned.settings.report.interval_in_sd
    new = tuple(
        Effect(
            e.name,
            {key: p.value for key, p in e.parameters.items()},
            {key: (p.ci95[1] - p.ci95[0]) / in_sd for key, p in e.parameters.items()},
            e.formula if e.name.startswith(UNNAMED_PREFIX) else "",
        )
        for e in effects
    )
    return Model(
        robot=model.robot,
        noise=noise_model(binned, fit.noise),
        effects=fit.extension.with_forms(merged_effects(model.effects, new)),
        misfit=misfit_beside(fit.extension, model.misfit, binned.settings.misfit),
    )


def merged_effects(base: tuple[Effect, ...], new: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """The effects of both models.

    Of two lasting effects of one name, the parameters add up as they do in the filter; a new stiffness of an
    undeclared skid replaces the old one. Effects in a time or place stay separate.
    """
    found = {effect.name: effect for effect in base if effect.name not in WEIGHTS}
    local = [effect for effect in (*base, *new) if effect.name in WEIGHTS]
    for effect in new:
        old = found.get(effect.name)
        if effect.name in WEIGHTS:
            continue
        if old is None or effect.name == "undeclared_skid":
            found[effect.name] = effect
        else:
            sums = {key: combined(key, old.parameters.get(key), v) for key, v in effect.parameters.items()}
            found[effect.name] = replace(effect, parameters=sums)
    return (*found.values(), *local)

"""A medium that brakes by the speed squared, as one that brakes by the speed.

    −c₂ v|v| and −e₂ w V    or    −c₁ v and −d₁ w,    w = l·yaw_rate, V² = v² + w²

are the same on a drive at one speed, ahead and in turning. A search that goes one effect after the other
finds the first at once, and the second, a ``viscous_drag`` beside a ``yaw_damping``, in two steps.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.same_loss import with_alternative

MEDIUM, AHEAD, IN_TURNING = "aerodynamic_drag", "viscous_drag", "yaw_damping"
Effects = tuple[FittedCandidate, ...]


def with_other_medium(problem: Problem, current: Fit, effects: Effects) -> tuple[Fit, Effects]:
    """The model and its effects, one that brakes by the speed squared as the one that brakes by the speed
    where that is clearly likelier, else with it as an alternative. Both have two parameters.
    """
    if MEDIUM not in [effect.name for effect in effects]:
        return current, effects
    held = current.extension.effects
    if not held[MEDIUM]["e2_per_m"] or held.keys() & {AHEAD, IN_TURNING}:
        return current, effects
    fit = by_the_speed(problem, current)
    worse = fit.deviance - current.deviance
    if worse < -problem.settings.selection.strong:
        return fit, tuple(one for effect in effects for one in in_two(effect, fit))
    return current, tuple(
        with_alternative(one, AHEAD, max(worse, 0.0)) if one.name == MEDIUM else one for one in effects
    )


def by_the_speed(problem: Problem, current: Fit) -> Fit:
    """The model with the medium that brakes by the speed in place of the other, from the same force at the
    root mean square speed.
    """
    sizes = current.extension.effects[MEDIUM]
    speed_mps = float(np.sqrt(np.mean(columns_of(problem.binned)["v"] ** 2)))
    start = current.extension.without(MEDIUM)
    start = start.with_effect(AHEAD, {"c1_per_s": sizes["c2_per_m"] * speed_mps})
    start = start.with_effect(IN_TURNING, {"d1_per_s": sizes["e2_per_m"] * speed_mps})
    return fit_model(problem, start, current.noise, problem.settings.budget.ranked_diffusion)


def in_two(effect: FittedCandidate, fit: Fit) -> Effects:
    """The effect as the model ``fit`` has it: the medium in two."""
    if effect.name != MEDIUM:
        return (effect,)
    two = ((name, dict(fit.extension.effects[name])) for name in (AHEAD, IN_TURNING))
    return tuple(
        replace(effect, scored=replace(effect.scored, name=name, parameters=sizes), fit=fit, alternatives=())
        for name, sizes in two
    )

"""Two forms of one cause, an actuator lag and an input delay, where the truth lies between them.

Most real lags have more than one pole, or a delay beside one. Then both together explain more than either
alone, and by how much the two differ says little of which of them is there.
"""

from dataclasses import replace

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, gauss_newton
from wmr_replay.gap.model.candidates import CONFOUNDED_FORMS, candidate_of
from wmr_replay.gap.search.fit_candidates import FittedCandidate


def with_forms_between(problem: Problem, current: Fit, effect: FittedCandidate) -> FittedCandidate:
    """The effect of the model ``current``, nearer to its other form by what both together explain beyond it:
    of D, by which it is likelier, D − J is left, at least 0, with J the gain of both forms together.
    """
    others = other_forms(effect)
    if not others or others & current.extension.effects.keys():
        return effect
    gained = {name: max(gain_of_both(problem, current, effect.name, name), 0.0) for name in others}
    nearer = ((name, max(worse - gained.get(name, 0.0), 0.0)) for name, worse in effect.alternatives)
    return replace(effect, alternatives=tuple(sorted(nearer, key=lambda one: one[1])))


def other_forms(effect: FittedCandidate) -> set[str]:
    """The alternatives of an effect that are another form of the same cause."""
    close = {name for name, _ in effect.alternatives}
    forms = set[str]().union(*(forms for forms in CONFOUNDED_FORMS if effect.name in forms))
    return (forms - {effect.name}) & close


def gain_of_both(problem: Problem, current: Fit, name: str, other: str) -> float:
    """What half of each form, and the sizes fitted from there, explain beyond the one of the model."""
    ((key, size),) = current.extension.effects[name].items()
    (other_key,) = candidate_of(other).free
    both = current.extension.with_effect(name, {key: 0.5 * size}).with_effect(
        other, {other_key: 0.5 * abs(size)}
    )
    fit = gauss_newton(problem, both, current.noise, problem.settings.budget.candidate_steps)
    return current.deviance - fit.deviance

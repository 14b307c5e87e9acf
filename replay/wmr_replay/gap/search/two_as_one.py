"""A drive gain, a payload and a yaw inertia: any two of the same size are the third alone.

A gain g acts on α and α_yaw, a payload on α, a yaw inertia on α_yaw:

    (1 + g)/(1 + payload) on α,    (1 + g)/(1 + ratio) on α_yaw,    (1 + payload)/(1 + ratio) on l m d/I

A search that goes one effect after the other may find two where one is missing, as while a centre of mass
that is missing, too, turns the robot.
"""

from collections.abc import Collection
from dataclasses import replace

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.search.fit_candidates import FittedCandidate, price_of

PARAMETER = {"drive_gain": "ratio", "payload": "mass_ratio", "yaw_inertia": "ratio"}
INVERSE = "drive_gain"
"""A gain is 1/(1 + r) of the others of its size."""


def two_as_one(
    problem: Problem, current: Fit, found: list[FittedCandidate]
) -> tuple[Fit, list[FittedCandidate]]:
    """The model and its effects, with the third in place of two of these, where that is no less likely beside
    the price of both.
    """
    pair = [effect for effect in found if effect.name in PARAMETER]
    if len(pair) != len(PARAMETER) - 1:
        return current, found
    first, second = pair
    (third,) = PARAMETER.keys() - {first.name, second.name}
    start = {PARAMETER[third]: size_as(third, first.name, current)}
    rest = current.extension.without(first.name).without(second.name).with_effect(third, start)
    fit = fit_model(problem, rest, current.noise, problem.settings.budget.ranked_diffusion)
    scored = replace(first.scored, name=third, parameters=start)
    both = sum(price_of(problem, effect.scored, current) for effect in pair)
    if fit.deviance + price_of(problem, scored, fit) > current.deviance + both:
        return current, found
    one = replace(first, scored=scored, fit=fit, alternatives=())
    return fit, [one if effect is first else effect for effect in found if effect is not second]


def stands_for(names: Collection[str], dropped: Collection[str]) -> bool:
    """Whether ``names`` hold two of these effects and the third is among those that were ``dropped``."""
    return any(PARAMETER.keys() - {one} <= {*names} for one in dropped if one in PARAMETER)


def size_as(third: str, name: str, fit: Fit) -> float:
    """The size of ``third`` that does on its channel what the effect ``name`` of the model does."""
    size = fit.extension.effects[name][PARAMETER[name]]
    return 1 / (1 + size) - 1 if INVERSE in (third, name) else size

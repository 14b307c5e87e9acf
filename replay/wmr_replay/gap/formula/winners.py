"""The best groups of a dictionary beside a model: groups without numbers, and those of the grids."""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.formula.families import SHAPES
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.scores import ScoredGroup, log_n, scored_groups
from wmr_replay.gap.formula.screen import fitted_innovations, screen_of

Rivals = tuple[str, bool]
KINDS = dict.fromkeys(SHAPES, "shape")
"""Kinds that are rivals of one another: the best few of all of them are looked at."""


def winners(problem: Problem, at: Fit, tried: Tried) -> list[ScoredGroup]:
    """The best few of each kind, scored by the filter, the best by gain less price first."""
    found = scored_groups(problem, at, (*tried.groups, *best_of_grids(problem, at, tried)))
    kept: dict[Rivals, list[ScoredGroup]] = {}
    most = dict(problem.settings.formula.rivals)
    for one in found:
        kept.setdefault(rivals_of(one.group), []).append(one)
    firsts = [one for (kind, _), some in kept.items() for one in some[: most.get(kind, 1)]]
    price = log_n(problem)
    return sorted(firsts, key=lambda one: one.group.price(price) - one.gain)


def rivals_of(group: Group) -> Rivals:
    """Among which a group is one of the best, or not: its kind, and whether it may answer a disturbance.
    Efforts, which answer what is there, are no rivals of what they answer.
    """
    return kind_of(group), group.may_answer


def kind_of(group: Group) -> str:
    """The kind of a group: a wave with its constant is no rival of the same wave without."""
    family, along = group.family, {"t": "timed", "yaw": "heading"}
    if family.kind == "edge" and family.along == "t":
        return "switch"
    if family.along in along and family.kind != "edge":
        return along[family.along]
    tilted = any("(yaw)" in factor for carrier in family.carriers for factor in carrier)
    if family.kind == "wave" and family.plain and tilted:
        return "wave and constant"
    return KINDS.get(family.kind, family.kind)


def best_of_grids(problem: Problem, at: Fit, tried: Tried) -> list[Group]:
    """The best of each grid of the more promising ones."""
    if not tried.grids:
        return []
    e = fitted_innovations(problem, at.innovations)[:, :, None]
    screen, price = screen_of(problem, at, e, at.psi), log_n(problem)
    best: dict[Rivals, list[tuple[float, Group]]] = {}
    most = problem.settings.formula.screened
    for grid in tried.grids:
        excess = screen.gains(grid)[:, 0] - tried.prices(grid, price)
        k = int(np.argmax(excess))
        if excess[k] > 0:
            group = tried.group(grid, k)
            best.setdefault(rivals_of(group), []).append((float(excess[k]), group))
    first = (sorted(some, key=lambda one: -one[0])[:most] for some in best.values())
    return [group for some in first for _, group in some]

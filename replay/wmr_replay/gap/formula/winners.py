"""The best groups of a dictionary beside a model: groups without numbers, and those of the grids."""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.formula.grids import Grid
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.scores import ScoredGroup, log_n, scored_groups
from wmr_replay.gap.formula.screen import fitted_innovations, screen_of

T = TypeVar("T")


def winners(problem: Problem, at: Fit, tried: Tried) -> list[ScoredGroup]:
    """The best groups, scored by the filter, few of the same quantities; by gain less price."""
    own = problem.settings.formula
    found = scored_groups(problem, at, (*tried.groups, *best_of_grids(problem, at, tried)))
    return few_alike(found, own.most_alike, own.rivals, lambda one: one.group)


def few_alike(some: Iterable[T], most: int, in_all: int, group_of: Callable[[T], Group]) -> list[T]:
    """The first one of each kind, and the first others, ``in_all`` of them, no more than ``most`` of the same
    quantities.

    A curve has many rivals of its own quantities, which may all be better than any of other quantities at one
    disturbance, and are not at the one that a formula leaves. A bell on a coarse grid promises less than it
    does with its best place.
    """
    alike: Counter[tuple[str, ...]] = Counter()
    kept = []
    for one in kinds_first(some, group_of):
        quantities = group_of(one).quantities
        alike[quantities] += 1
        if alike[quantities] <= most:
            kept.append(one)
        if len(kept) == in_all:
            break
    return kept


def kinds_first(some: Iterable[T], group_of: Callable[[T], Group]) -> list[T]:
    """The first one of each kind, then the others, each in their order."""
    firsts: dict[tuple[str, str], T] = {}
    others = []
    for one in some:
        family = group_of(one).family
        kind = family.kind, "t" if family.along == "t" else ""
        if kind in firsts:
            others.append(one)
        firsts.setdefault(kind, one)
    return [*firsts.values(), *others]


def best_of_grids(problem: Problem, at: Fit, tried: Tried) -> list[Group]:
    """The best of each grid of the more promising ones."""
    if not tried.grids:
        return []
    own, e = problem.settings.formula, fitted_innovations(problem, at.innovations)[:, :, None]
    screen, price = screen_of(problem, at, e, at.psi), log_n(problem)
    best: list[tuple[float, Grid, int]] = []
    for grid in tried.grids:
        excess = screen.gains(grid)[:, 0] - tried.prices(grid, price)
        k = int(np.argmax(excess))
        if excess[k] > 0:
            best.append((float(excess[k]), grid, k))
    best.sort(key=lambda one: -one[0])
    groups = (tried.group(grid, k) for _, grid, k in best)
    return few_alike(groups, own.screened_alike, own.screened, lambda group: group)

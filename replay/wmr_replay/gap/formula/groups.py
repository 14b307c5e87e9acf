"""Groups of terms that enter a formula together: products, curves, and families with numbers."""

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wmr_replay.gap.evidence.excitation import BOTH, torques_of
from wmr_replay.gap.formula.bells import bells
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.grids import Grid, grids_of
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import CURVE_TERMS, FORMULA_TERMS
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import Term

PRODUCT, CURVE = Family("product"), Family("curve")


@dataclass(frozen=True)
class Group:
    """Terms that stand or fall together; ``n_tried`` counts the groups among which it was found."""

    family: Family
    terms: tuple[Term, ...]
    shape: tuple[float, ...] = ()
    n_tried: float = 1

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names."""
        return tuple(term.name for term in self.terms)

    @property
    def columns(self) -> frozenset[str]:
        """The quantities that its terms read."""
        return frozenset(column for term in self.terms for column in term.columns)

    @property
    def answers(self) -> frozenset[str]:
        """The channels of whose efforts it is made, by which a controller answers their disturbances."""
        return frozenset(torques_of(name) for name in self.names) - {BOTH}

    @property
    def may_answer(self) -> bool:
        """Whether it reads the efforts of its own channel."""
        return bool(self.answers)

    def moved(self, shape: F64) -> "Group":
        """The same with other numbers."""
        numbers = tuple(float(value) for value in shape)
        return replace(self, terms=self.family.terms(numbers), shape=numbers)

    def price(self, log_n: float) -> float:
        """BIC's price of its coefficients, and of its numbers or 2 ln of what was tried.

        A grid of shapes and their numbers are the same freedom: the larger price counts.
        """
        tried = 2 * float(np.log(self.n_tried))
        return len(self.terms) * log_n + max(len(self.shape) * log_n, tried)

    @property
    def parts(self) -> tuple["Group", ...]:
        """The terms of a curve, and those of a family that have no numbers, each of which may be spared once
        the group stands; else the group itself.
        """
        if self.family == CURVE:
            tried = self.n_tried ** (1 / len(self.terms))
            return tuple(Group(PRODUCT, (term,), n_tried=tried) for term in self.terms)
        plain = self.family.plain_terms
        if not plain:
            return (self,)
        own = replace(self.family, plain=False)
        shaped = replace(self, family=own, terms=own.terms(self.shape))
        return (shaped, *(Group(PRODUCT, (term,)) for term in self.terms if term in plain))


TWINS = {
    "viscous_drag": ("longitudinal:v",),
    "aerodynamic_drag": ("longitudinal:v*abs(v)", "yaw:yaw_rate*abs(yaw_rate)"),
    "rolling_resistance": ("longitudinal:sgn(v)",),
    "payload": ("longitudinal:effort_sum",),
    "drive_gain": ("longitudinal:effort_sum",),
    "torque_bias_common": ("longitudinal:1",),
    "slope": ("longitudinal:cos(yaw)", "longitudinal:sin(yaw)"),
    "com_offset": ("longitudinal:yaw_rate*yaw_rate", "yaw:v*yaw_rate"),
    "yaw_inertia": ("yaw:effort_diff",),
    "yaw_damping": ("yaw:yaw_rate",),
    "scrub_torque": ("yaw:sgn(yaw_rate)",),
    "torque_imbalance": ("yaw:effort_sum",),
    "torque_bias_differential": ("yaw:1",),
}
"""Effects of the library that are terms of the dictionary: beside one of them its terms are not tried."""


def twins_of(effects: Iterable[str]) -> set[str]:
    """The names of the terms that are a form of the effects."""
    return {UNNAMED_PREFIX + term for name in effects for term in TWINS.get(name, ())}


@dataclass(frozen=True, eq=False)
class Tried:
    """Everything that is tried on a log: groups without numbers, and grids of those with numbers, each for
    every one of ``times`` before it.
    """

    groups: tuple[Group, ...]
    grids: tuple[Grid, ...] = ()
    times: float = 1

    @property
    def shaped(self) -> "Tried":
        """The groups with numbers alone."""
        return Tried((), self.grids)

    @property
    def without_answers(self) -> "Tried":
        """The groups that read no efforts of their own channel."""
        groups = tuple(group for group in self.groups if not group.may_answer)
        return Tried(groups, tuple(grid for grid in self.grids if not self.group(grid, 0).may_answer))

    @cached_property
    def n_grids(self) -> float:
        """How many groups the grids are."""
        return self.times * sum(map(len, self.grids))

    def group(self, grid: Grid, k: int) -> Group:
        """The k-th group of a grid."""
        family, shape = grid.at(k)
        return Group(family, family.terms(shape), shape, self.n_grids)

    def prices(self, grid: Grid, log_n: float) -> F64:
        """The prices (m,) of a grid's groups."""
        firsts = np.cumsum([0, *(len(numbers) for _, numbers in grid.pieces)])[:-1]
        prices = [self.group(grid, int(k)).price(log_n) for k in firsts]
        return np.repeat(prices, [len(numbers) for _, numbers in grid.pieces])

    def with_overtones(self, groups: Iterable[Group], settings: FormulaSettings) -> "Tried":
        """With harmonics of waves that are found: what comes again and again is seldom a sine."""
        waves = (group for group in groups if group.family.kind == "wave" and group.family.along != "yaw")
        more = (one for wave in waves for one in overtones_of(wave, settings.overtones))
        return Tried((*self.groups, *more), self.grids)

    def beside(self, effects: Iterable[str]) -> "Tried":
        """What is no form of the effects: with one of them, its own term does not stand beside a shape."""
        twins = twins_of(effects)
        grids = tuple(bare(grid) if holds(grid, twins) else grid for grid in self.grids)
        return Tried(without_terms(self.groups, twins), grids)


def overtones_of(wave: Group, overtones: Sequence[int]) -> Iterator[Group]:
    """Harmonics of a wave, with the same carriers."""
    family = replace(wave.family, plain=False)
    for times in overtones:
        shape = tuple(times * number for number in wave.shape)
        yield Group(family, family.terms(shape), shape, len(overtones))


def holds(grid: Grid, names: Container[str]) -> bool:
    """Whether one of the terms without numbers is of these names."""
    return any(term.name in names for term in grid.first.plain_terms)


def bare(grid: Grid) -> Grid:
    """The grid without those terms."""
    return Grid(tuple((replace(family, plain=False), numbers) for family, numbers in grid.pieces))


def without_twins(groups: Iterable[Group], effects: Iterable[str]) -> tuple[Group, ...]:
    """The groups that are no form of the effects."""
    return without_terms(groups, twins_of(effects))


def without_terms(groups: Iterable[Group], names: Container[str]) -> tuple[Group, ...]:
    """The groups without these terms; a curve stands while two terms of it are left, a family with numbers
    while those are.
    """
    left = []
    for group in groups:
        terms = tuple(term for term in group.terms if term.name not in names)
        if len(terms) == len(group.terms) or (group.family == CURVE and len(terms) > 1):
            left.append(replace(group, terms=terms))
        elif group.family.plain and not {*group.terms} - {*terms} - {*group.family.plain_terms}:
            bare = replace(group.family, plain=False)
            left.append(replace(group, family=bare, terms=bare.terms(group.shape)))
    return tuple(left)


def groups_of(binned: BinnedLog, settings: FormulaSettings) -> Tried:
    """Everything that is tried on a log."""
    return Tried(plain_groups(), (*grids_of(binned, settings), *bells(binned, settings)))


def plain_groups() -> tuple[Group, ...]:
    """The products and curves, which have no place."""
    products = tuple(Group(PRODUCT, (term,), n_tried=len(FORMULA_TERMS)) for term in FORMULA_TERMS)
    return (*products, *(Group(CURVE, terms, n_tried=len(CURVE_TERMS)) for terms in CURVE_TERMS))

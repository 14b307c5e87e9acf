"""Groups of terms that enter a formula together: products, waves over the place, bells over the plane."""

from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import CURVE_TERMS, FORMULA_TERMS, columns_of
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.placed_factors import bell_text, wave_text
from wmr_schemas.terms import Term, TermChannel


@dataclass(frozen=True)
class Family:
    """Terms of one form.

    ``kind`` is product, curve, wave, bump or hill; a wave runs over ``along``, times ``beside``.
    """

    kind: str
    channel: TermChannel = "longitudinal"
    along: str = ""
    beside: tuple[str, ...] = ()

    def terms(self, shape: tuple[float, ...]) -> tuple[Term, ...]:
        """The terms with these numbers: K of a wave, or X, Y, R of a bell."""
        if self.kind == "wave":
            waves = (wave_text(function, shape[0], self.along) for function in ("sin", "cos"))
            return tuple(Term(self.channel, (wave, *self.beside)) for wave in waves)
        return (Term(self.channel, (bell_text(self.kind, *shape),)),)


PRODUCT, CURVE = Family("product"), Family("curve")
WAVES = (
    Family("wave", "longitudinal", "x", ("cos(yaw)",)),
    Family("wave", "longitudinal", "y", ("sin(yaw)",)),
    Family("wave", "longitudinal", "x"),
    Family("wave", "longitudinal", "y"),
    Family("wave", "longitudinal", "s"),
    Family("wave", "yaw", "x"),
    Family("wave", "yaw", "y"),
    Family("wave", "yaw", "s"),
)
"""Height that waves over x or y pulls along the heading; the others are resistance in places."""
BELLS = (Family("hill"), Family("bump"))


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
        """The terms of a curve, each of which may be spared once it stands; else the group itself."""
        if self.family != CURVE:
            return (self,)
        tried = self.n_tried ** (1 / len(self.terms))
        return tuple(Group(PRODUCT, (term,), n_tried=tried) for term in self.terms)


TWINS = {
    "viscous_drag": ("longitudinal:v",),
    "aerodynamic_drag": ("longitudinal:v*abs(v)",),
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


def without_twins(groups: Iterable[Group], effects: Iterable[str]) -> tuple[Group, ...]:
    """The groups that are no form of the effects."""
    return without_terms(groups, twins_of(effects))


def without_terms(groups: Iterable[Group], names: Container[str]) -> tuple[Group, ...]:
    """The groups without these terms; a curve stands while two terms of it are left."""
    left = []
    for group in groups:
        terms = tuple(term for term in group.terms if term.name not in names)
        if len(terms) == len(group.terms) or (group.family == CURVE and len(terms) > 1):
            left.append(replace(group, terms=terms))
    return tuple(left)


def groups_of(binned: BinnedLog, settings: FormulaSettings) -> tuple[Group, ...]:
    """Everything that is tried on a log."""
    waves = tuple(group for family in WAVES for group in waves_of(family, binned, settings))
    bells = tuple(group for family in BELLS for group in bells_of(family, binned, settings))
    placed = (replace(group, n_tried=len(some)) for some in (waves, bells) for group in some)
    return (*plain_groups(), *placed)


def plain_groups() -> tuple[Group, ...]:
    """The products and curves, which have no place."""
    products = tuple(Group(PRODUCT, (term,), n_tried=len(FORMULA_TERMS)) for term in FORMULA_TERMS)
    return (*products, *(Group(CURVE, terms, n_tried=len(CURVE_TERMS)) for terms in CURVE_TERMS))


def waves_of(family: Family, binned: BinnedLog, settings: FormulaSettings) -> Iterator[Group]:
    """Waves of every length that the path can tell apart: half a turn over its span from one to the next."""
    span_m = float(np.ptp(columns_of(binned)[family.along]))
    shortest, longest = settings.least_length_m, settings.longest_in_spans * span_m
    if family.along == "s":
        shortest, longest = settings.way_lengths_m
        longest = min(longest, span_m)
    if longest <= 2 * shortest:
        return
    first, last = 2 * np.pi / longest, 2 * np.pi / shortest
    n = min(int((last - first) * span_m / np.pi) + 1, settings.most_waves)
    for k in np.linspace(first, last, n):
        yield Group(family, family.terms((float(k),)), (float(k),))


def bells_of(family: Family, binned: BinnedLog, settings: FormulaSettings) -> Iterator[Group]:
    """Bells on a grid of their radius, along the path and beside it, where they are seen at least twice.

    The slope of a hill is steepest a radius from its middle, which need not be passed.
    """
    place = binned.pose[:, :2]
    span_m = float(np.mean(np.ptp(place, axis=0)))
    here, next_to = np.zeros((1, 2)), np.eye(2)
    beside = np.vstack([here, next_to, -next_to]) if family.kind == "hill" else here
    for share in settings.bell_shares:
        radius_m = max(share * span_m, settings.least_radius_m)
        on_path = np.unique(np.rint(place / radius_m), axis=0)
        cells = np.unique((on_path[:, None] + beside).reshape(-1, 2), axis=0)
        for x, y in cells * radius_m:
            if visits_of(binned, (float(x), float(y), radius_m), settings) >= settings.visits:
                shape = (float(x), float(y), radius_m)
                yield Group(family, family.terms(shape), shape)


def visits_of(binned: BinnedLog, shape: tuple[float, ...], settings: FormulaSettings) -> int:
    """How often the path comes onto a bell's flanks, counted anew after some seconds outside."""
    x, y, radius_m = shape
    apart_m = np.hypot(binned.pose[:, 0] - x, binned.pose[:, 1] - y)
    t_s = binned.t_s[apart_m < settings.flank_radii * radius_m]
    return int(len(t_s) > 0) + int(np.sum(np.diff(t_s) > settings.apart_s))

"""Groups of terms that enter a formula together: products, waves over the place, bells over the plane."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import FORMULA_TERMS, columns_of
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.placed_factors import bell_text, wave_text
from wmr_schemas.terms import Term, TermChannel


@dataclass(frozen=True)
class Family:
    """Terms of one form.

    ``kind`` is product, wave, bump or hill; a wave runs over ``along`` and is multiplied by ``beside``.
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


PRODUCT = Family("product")
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
    n_tried: int = 1

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names."""
        return tuple(term.name for term in self.terms)

    def moved(self, shape: F64) -> "Group":
        """The same with other numbers."""
        numbers = tuple(float(value) for value in shape)
        return replace(self, terms=self.family.terms(numbers), shape=numbers)

    def price(self, log_n: float) -> float:
        """BIC's price of its coefficients and numbers, and 2 ln of what was tried."""
        return (len(self.terms) + len(self.shape)) * log_n + 2 * float(np.log(self.n_tried))


TWINS = {
    "viscous_drag": "longitudinal:v",
    "aerodynamic_drag": "longitudinal:v*abs(v)",
    "rolling_resistance": "longitudinal:sgn(v)",
    "payload": "longitudinal:effort_sum",
    "drive_gain": "longitudinal:effort_sum",
    "torque_bias_common": "longitudinal:1",
    "com_offset": "longitudinal:yaw_rate*yaw_rate",
    "yaw_inertia": "yaw:effort_diff",
    "yaw_damping": "yaw:yaw_rate",
    "scrub_torque": "yaw:sgn(yaw_rate)",
    "torque_imbalance": "yaw:effort_sum",
    "torque_bias_differential": "yaw:1",
}
"""Effects of the library that are a term of the dictionary: beside one of them its term is not tried."""


def without_twins(groups: Iterable[Group], effects: Iterable[str]) -> tuple[Group, ...]:
    """The groups that are no form of the effects."""
    twins = {UNNAMED_PREFIX + TWINS[name] for name in effects if name in TWINS}
    return tuple(group for group in groups if not twins & set(group.names))


def groups_of(binned: BinnedLog, settings: FormulaSettings) -> tuple[Group, ...]:
    """Everything that is tried on a log."""
    products = tuple(Group(PRODUCT, (term,)) for term in FORMULA_TERMS)
    waves = tuple(group for family in WAVES for group in waves_of(family, binned, settings))
    bells = tuple(group for family in BELLS for group in bells_of(family, binned, settings))
    return tuple(replace(group, n_tried=len(some)) for some in (products, waves, bells) for group in some)


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
    """Bells on a grid of their radius, where the path comes at least twice."""
    place = binned.pose[:, :2]
    span_m = float(np.mean(np.ptp(place, axis=0)))
    for share in settings.bell_shares:
        radius_m = max(share * span_m, settings.least_radius_m)
        for x, y in np.unique(np.rint(place / radius_m), axis=0) * radius_m:
            if visits_of(binned, (float(x), float(y), radius_m), settings) >= settings.visits:
                shape = (float(x), float(y), radius_m)
                yield Group(family, family.terms(shape), shape)


def visits_of(binned: BinnedLog, shape: tuple[float, ...], settings: FormulaSettings) -> int:
    """How often the path comes within a bell's radius, counted anew after some seconds outside."""
    x, y, radius_m = shape
    t_s = binned.t_s[np.hypot(binned.pose[:, 0] - x, binned.pose[:, 1] - y) < radius_m]
    return int(len(t_s) > 0) + int(np.sum(np.diff(t_s) > settings.apart_s))

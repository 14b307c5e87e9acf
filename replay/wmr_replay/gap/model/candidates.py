"""The candidates of a scan, out of the catalogue's declarations."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wmr_replay.effects.theta import Theta, places_of
from wmr_schemas.effects import (
    EffectDeclaration,
    Parameter,
    built_in,
    catalogue,
    declared,
    named_of,
    own_effects,
)
from wmr_schemas.modes import ContactMode
from wmr_schemas.terms import COEFFICIENT, parse_term

COEFFICIENT_STEP = 1e-4
"""Step of a term's coefficient: terms are of the order of 1, so that it moves the path by millimetres."""
LONG_S = 100.0
"""For each power of the time in a term, a step is so many times smaller: times are of this order."""


@dataclass(frozen=True)
class Candidate:
    """An effect as a scan and a fit look for it."""

    declaration: EffectDeclaration

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.declaration.name

    @cached_property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Bounds of each free parameter."""
        return self.declaration.bounds

    @cached_property
    def most_times(self) -> dict[str, tuple[str, float]]:
        """The parameters that a fit keeps to so many times another one."""
        return self.declaration.most_times

    def bounds_at(self, key: str, parameters: Mapping[str, float]) -> tuple[float, float]:
        """Bounds of a parameter beside the others' values."""
        low, high = self.bounds[key]
        if key not in self.most_times:
            return low, high
        other, times = self.most_times[key]
        return low, min(high, max(low, times * parameters[other]))

    @cached_property
    def steps(self) -> dict[str, float]:
        """Step of each parameter in a difference quotient."""
        return self.declaration.steps

    @property
    def free(self) -> tuple[str, ...]:
        """Names of its parameters."""
        return tuple(key for key, one in self.declaration.parameters.items() if "torque" in one.models)

    @cached_property
    def absent(self) -> dict[str, float]:
        """The parameters that need not be, with their values where they are not."""
        return self.declaration.absent

    def size_of(self, parameters: Mapping[str, float]) -> float:
        """The size of the effect by the parameters that make it one; of two components, their length."""
        return float(np.hypot.reduce([size for key, size in parameters.items() if key not in self.absent]))

    @cached_property
    def places(self) -> tuple[Theta, ...]:
        """Places in θ whose slopes a scan takes; empty where it looks for the effect in another way."""
        if self.declaration.extent != "always":
            return ()
        return places_of(self.name, self.free)

    @property
    def grid(self) -> tuple[float, ...]:
        """Values at which the one parameter is tried; empty without a grid."""
        return self.declaration.search.grid


EVERY = tuple(Candidate(declaration) for declaration in built_in("torque"))
"""What a base model may hold, and what an analysis may name."""
LIBRARY = tuple(candidate for candidate in EVERY if candidate.name in named_of("torque"))
BY_NAME = {candidate.name: candidate for candidate in EVERY}
SKID = "undeclared_skid"
"""An effect only where the modes are given as facts: an identifier calls it skidding."""
LOCAL = tuple(e.name for e in built_in("torque") if e.taken_for == ContactMode.SLIPPING)
"""Losses of traction in a stretch of time or a region, which an identifier may call slipping."""
CONFOUNDED_FORMS = tuple({e.name, *e.other_forms} for e in built_in("torque") if e.other_forms)
"""Forms of one cause: most real lags lie between a lag of one pole and a delay."""


def own_candidates() -> tuple[Candidate, ...]:
    """The effects that users installed."""
    return tuple(Candidate(effect.declaration) for effect in own_effects().values())


def candidate_of(name: str) -> Candidate:
    """A candidate of the library or a user's, or a term of the dictionary. Raises InvalidTerm."""
    return BY_NAME.get(name) or Candidate(declaration_of(name))


def declaration_of(name: str) -> EffectDeclaration:
    """An effect's declaration, or one made for a term of the dictionary. Raises InvalidTerm."""
    if name in catalogue():
        return declared(name)
    term = parse_term(name)
    coefficient = Parameter(term.unit, COEFFICIENT_STEP / LONG_S ** term.factors.count("t"))
    return EffectDeclaration(
        name, term.channel, term.formula, {COEFFICIENT: coefficient}, acts_on="acceleration"
    )


def is_place(name: str, key: str) -> bool:
    """Whether a parameter says when or where its effect acts, and not how large it is."""
    return name in BY_NAME and BY_NAME[name].declaration.parameters[key].role != "size"

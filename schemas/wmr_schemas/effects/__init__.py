"""Effects that a model can carry beyond its base, each declared once; see :mod:`.declaration`.

The catalogue serves ``model.toml``, ``gap.json``, the candidates of the gap analysis, ``--hide`` and the
documentation. A family of effects is a module; its place in ``FAMILIES`` is the order of a scan.
"""

from collections.abc import Mapping

from wmr_schemas.effects import (
    body,
    commands,
    encoders,
    places,
    pose,
    resistance,
    response,
    simulator_only,
    torques,
    tyres,
    wheels,
)
from wmr_schemas.effects.declaration import (
    BaseModel,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre
from wmr_schemas.effects.own import OwnEffect, own_effects

__all__ = [
    "BEYOND",
    "BUILT_IN",
    "EFFECTS",
    "FRICTIONS",
    "UNNAMED_PREFIX",
    "WITHHOLDING",
    "BaseModel",
    "EffectDeclaration",
    "Exact",
    "Manoeuvre",
    "OwnEffect",
    "Parameter",
    "Range",
    "Search",
    "Separable",
    "built_in",
    "catalogue",
    "declared",
    "effects_of",
    "named_of",
    "own_effects",
]

UNNAMED_PREFIX = "unnamed:"
"""Prefix of an effect that only a dictionary term describes, ``unnamed:<channel>:<term>``; see
:mod:`wmr_schemas.terms`.
"""
FAMILIES = (response, resistance, wheels, body, pose, tyres, torques, places, encoders, commands)
BUILT_IN: tuple[EffectDeclaration, ...] = tuple(effect for family in FAMILIES for effect in family.EFFECTS)
"""The built-in effects of every base model, in the order in which a scan looks for them."""


def built_in(base: BaseModel) -> tuple[EffectDeclaration, ...]:
    """The built-in effects of a base model, in the order in which a scan looks for them."""
    return tuple(effect for effect in BUILT_IN if base in effect.models)


def by_number(effects: tuple[EffectDeclaration, ...]) -> dict[str, EffectDeclaration]:
    """Declarations by name, in the order of their numbers."""
    return {effect.name: effect for effect in sorted(effects, key=lambda effect: effect.number)}


EFFECTS: dict[str, EffectDeclaration] = by_number(BUILT_IN)
"""The built-in effects of every base model."""
BEYOND: dict[str, EffectDeclaration] = by_number(simulator_only.EFFECTS)
"""Effects that only the simulator has: no candidate names them, no model file holds them."""


FRICTIONS = ("rolling_resistance", "scrub_torque", "wheel_coulomb", "support_friction")
"""Effects that change their sign over a speed, 2 cm/s unless a model file says another one."""
WITHHOLDING = ("torque_deadzone", "torque_saturation")
"""Effects that hold torques back from a threshold on, unless a model file says over which share of it."""


def effects_of(base: BaseModel) -> dict[str, EffectDeclaration]:
    """The built-in effects of a base model by name, in the order of their numbers."""
    return {name: effect for name, effect in EFFECTS.items() if base in effect.models}


def named_of(base: BaseModel) -> dict[str, EffectDeclaration]:
    """Those of :func:`effects_of` that an analysis may name."""
    return {name: effect for name, effect in effects_of(base).items() if not effect.held_only}


def catalogue() -> Mapping[str, EffectDeclaration]:
    """Every effect that a model file can hold by name: the built-in ones, then those that users installed."""
    return EFFECTS | {name: effect.declaration for name, effect in own_effects().items()}


def declared(name: str) -> EffectDeclaration:
    """The declaration of an effect, also of one that only the simulator has. Raises KeyError."""
    return BEYOND[name] if name in BEYOND else catalogue()[name]

"""Effects that users add from a package of their own.

A package names a class, derived from :class:`OwnEffect`, under the entry point group ``wmr_replay.effects``.
The class holds the declaration and the effect's form in the analysis, as a function of columns; the gap
analysis scans it, the model file holds it, a replay takes it out. A simulated log hides it only in a second
form, which is registered with :func:`wmr_synth.hidden.register_form`.
"""

from abc import ABC
from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import ClassVar

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import register_sources
from wmr_schemas.effects.declaration import EffectDeclaration
from wmr_schemas.errors import InvalidEffect

GROUP = "wmr_replay.effects"
Columns = Mapping[str, F64]
"""Columns (n,): t_s from the log's first pose, x_m, y_m, yaw_rad, v_mps, v_lat_mps, yaw_rate_radps, left_nm,
right_nm; robot conventions, velocities estimated from the poses.
"""
Values = Mapping[str, float]
OWN_ACTS_ON = ("acceleration", "efforts", "pose")
OWN_ACCELERATIONS = ("longitudinal", "yaw")


class OwnEffect(ABC):
    """Base class of a user's effect: the declaration, and the one method that its ``acts_on`` asks for.

    Every method is a pure function of its arguments, row by row: a row's result depends on that row alone.
    """

    declaration: ClassVar[EffectDeclaration]

    def acceleration(self, at: Columns, values: Values) -> F64:
        """The acceleration (n,) in m/s² that the effect adds to dv_long/dt (channel ``longitudinal``) or to
        half_track_m·d(yaw_rate)/dt (channel ``yaw``). For ``acts_on="acceleration"``.
        """
        raise NotImplementedError

    def efforts(self, efforts_nm: F64, values: Values) -> F64:
        """The efforts (2, n) that act, left and right in N·m, out of the commanded ones. For
        ``acts_on="efforts"``.
        """
        raise NotImplementedError

    def pose_error(self, at: Columns, values: Values) -> F64:
        """What the measurement adds to the pose, (3, n): x and y in m, yaw in rad; ``at`` holds t_s and the
        measured x_m, y_m, yaw_rad only. For ``acts_on="pose"``.
        """
        raise NotImplementedError


METHODS = {"acceleration": "acceleration", "efforts": "efforts", "pose": "pose_error"}


@cache
def own_effects() -> Mapping[str, OwnEffect]:
    """The installed users' effects by name. Raises InvalidEffect naming the entry point at fault."""
    found: dict[str, OwnEffect] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value)):
        effect = loaded(entry)
        name = effect.declaration.name
        if name in found:
            raise InvalidEffect(entry.value, f"declares {name}, which another package declares already")
        found[name] = effect
        register_sources(entry.module.partition(".")[0])
    return found


def loaded(entry: EntryPoint) -> OwnEffect:
    """The effect of an entry point, checked. Raises InvalidEffect."""
    try:
        made = entry.load()
        effect = made() if isinstance(made, type) else made
    except Exception as error:
        raise InvalidEffect(entry.value, f"cannot be loaded ({type(error).__name__}: {error})") from error
    if not isinstance(effect, OwnEffect) or not isinstance(
        getattr(effect, "declaration", None), EffectDeclaration
    ):
        raise InvalidEffect(entry.value, "is no OwnEffect with a declaration")
    check_own(entry.value, effect)
    return effect


def check_own(source: str, effect: OwnEffect) -> None:
    """An effect that an analysis can use. Raises InvalidEffect."""
    declared = effect.declaration
    if declared.acts_on not in OWN_ACTS_ON:
        raise InvalidEffect(source, f"acts_on is one of {', '.join(OWN_ACTS_ON)}, not {declared.acts_on!r}")
    if declared.acts_on == "acceleration" and declared.channel not in OWN_ACCELERATIONS:
        raise InvalidEffect(
            source,
            f"an acceleration's channel is one of {', '.join(OWN_ACCELERATIONS)}, not {declared.channel!r}",
        )
    if ":" in declared.name or declared.number >= 0:
        raise InvalidEffect(source, "a name has no colon, and numbers belong to the built-in effects")
    if declared.extent != "always" or declared.followed:
        raise InvalidEffect(source, "acts always: effects in time or space are built in")
    method = METHODS[declared.acts_on]
    if getattr(type(effect), method) is getattr(OwnEffect, method):
        raise InvalidEffect(source, f"lacks the method {method}, which its acts_on asks for")


def as_columns(t_s: F64, pose: F64) -> dict[str, F64]:
    """Stamps (n,) and poses (3, n) as the columns that a pose error reads."""
    return {"t_s": t_s, "x_m": pose[0], "y_m": pose[1], "yaw_rad": pose[2]}


def checked(effect: OwnEffect, value: F64, shape: tuple[int, ...]) -> F64:
    """The column that a method returned. Raises InvalidEffect for another shape."""
    made = np.asarray(value, float)
    if made.shape != shape:
        raise InvalidEffect(
            effect.declaration.name, f"{METHODS[effect.declaration.acts_on]} gave {made.shape} for {shape}"
        )
    return made

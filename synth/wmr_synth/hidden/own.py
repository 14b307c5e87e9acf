"""Accelerations of the forms that are registered for users' effects."""

from collections.abc import Callable

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect
from wmr_synth.hidden.registry import OWN_FORMS
from wmr_synth.plants.motion import Motion

OwnAcceleration = Callable[[Motion], F64]
"""(dv_long/dt, dv_lat/dt, l·d(yaw_rate)/dt) (n, 3) in m/s² at the rows of a motion."""


def own_acceleration(effects: tuple[Effect, ...]) -> OwnAcceleration | None:
    """The sum over the effects that have such a form; None where none has."""
    forms = [(e.name, OWN_FORMS[e.name].acceleration, e.parameters) for e in effects if e.name in OWN_FORMS]
    acting = [(name, form, values) for name, form, values in forms if form is not None]

    def total(motion: Motion) -> F64:
        added = np.zeros((len(motion.t_ns), 3))
        for name, form, values in acting:
            value = np.asarray(form(motion, values), float)
            if value.shape != added.shape or not np.isfinite(value).all():
                raise InvalidSetting(f"the form of {name} must give finite numbers of shape {added.shape}")
            added += value
        return added

    return total if acting else None

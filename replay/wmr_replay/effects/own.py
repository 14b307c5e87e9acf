"""Users' effects, summed over the effects of a model, as functions of columns."""

from collections.abc import Iterable

import numpy as np

from wmr_replay.effects.theta import Values
from wmr_schemas.arrays import F64
from wmr_schemas.effects import OwnEffect, own_effects
from wmr_schemas.effects.own import OWN_ACCELERATIONS, Columns, as_columns, checked

Named = Iterable[tuple[str, Values]]


def acting(effects: Named, acts_on: str) -> list[tuple[OwnEffect, Values]]:
    """The users' effects among ``effects`` that act there, in their order."""
    named = list(effects)
    known = own_effects() if named else {}
    found = [(known[name], values) for name, values in named if name in known]
    return [(effect, values) for effect, values in found if effect.declaration.acts_on == acts_on]


def own_accelerations(effects: Named, at: Columns) -> F64:
    """dv_long/dt and l·d(yaw_rate)/dt (2, n) in m/s² that users' effects add at the rows of ``at``."""
    n = len(at["t_s"])
    total = np.zeros((2, n))
    for effect, values in acting(effects, "acceleration"):
        row = OWN_ACCELERATIONS.index(effect.declaration.channel)
        total[row] += checked(effect, effect.acceleration(at, values), (n,))
    return total


def own_efforts(effects: Named, efforts_nm: F64) -> F64:
    """Efforts (2, n) behind users' effects on the torques, one after the other."""
    for effect, values in acting(effects, "efforts"):
        efforts_nm = checked(effect, effect.efforts(efforts_nm, values), efforts_nm.shape)
    return efforts_nm


def without_own_errors(effects: Named, t_s: F64, pose: F64) -> F64:
    """Measured poses (3, n) without the errors of users' effects, each taken at the measured pose."""
    error = np.zeros_like(pose)
    for effect, values in acting(effects, "pose"):
        error += checked(effect, effect.pose_error(as_columns(t_s, pose), values), pose.shape)
    return pose - error

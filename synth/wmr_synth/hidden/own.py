"""Accelerations of users' effects in the compiled plant, by waveform relaxation.

A form is a function of the whole motion, and the plant's loop is compiled. The motion is therefore simulated
under the accelerations of the motion before, x_{k+1} = plant(a(x_k)), until it no longer changes. The
iteration converges on any finite span (Picard–Lindelöf). Source: Lelarasmee, Ruehli, Sangiovanni-Vincentelli,
IEEE Trans. CAD 1 (1982) 131.
"""

from collections.abc import Callable

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect
from wmr_synth.hidden.registry import OWN_FORMS
from wmr_synth.plants.simulate import Motion

OwnAcceleration = Callable[[I64], F64]
"""Accelerations (n, 3) at instants in ns, each held until the next."""
MOST_ROUNDS, SETTLED_M = 60, 1e-7


def relaxed(simulated: Callable[[OwnAcceleration | None], Motion], effects: tuple[Effect, ...]) -> Motion:
    """The motion under the accelerations that it causes itself; as simulated where no effect has any.

    Raises InvalidSetting where the motion does not settle.
    """
    forms = [(OWN_FORMS[e.name].acceleration, e.parameters) for e in effects if e.name in OWN_FORMS]
    acting = [(form, values) for form, values in forms if form is not None]
    motion = simulated(None)
    for _ in range(MOST_ROUNDS if acting else 0):
        total = np.sum([form(motion, values) for form, values in acting], axis=0)
        new = simulated(held_from(motion.t_ns, total))
        apart = np.hypot(new.x_m - motion.x_m, new.y_m - motion.y_m)
        motion = new
        if apart.max() < SETTLED_M:
            return motion
    if acting:
        raise InvalidSetting(f"the motion does not settle within {MOST_ROUNDS} rounds; is a form unstable?")
    return motion


def held_from(t_ns: I64, acceleration: F64) -> OwnAcceleration:
    """The rows (n, 3) held from ``t_ns`` (n,) on."""
    return lambda at_ns: acceleration[np.maximum(np.searchsorted(t_ns, at_ns, side="right") - 1, 0)]

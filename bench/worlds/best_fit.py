"""The size of the declared form that comes closest to what another plant hides, without noise.

An interval for a hidden effect of another form is asked to hold this size, not the drawn one. The distance is
that of the oracle: innovations in units of their standard deviation.
"""

import numpy as np

from wmr_schemas.arrays import F64
from worlds.case import World
from worlds.oracle_filter import steps_of, whitened
from worlds.oracle_forms import Signals, Trace, signals_of, trace
from worlds.plant_two import equations as eq
from worlds.plant_two.effects import SAME_FORM, SIZES, hidden_of
from worlds.plant_two.world import equations_of, plant_robot

RATIOS = np.linspace(0.7, 1.4, 15)
WITH_MEMORY = ("actuator_lag", "input_delay", "yaw_drift")
"""Forms that are no function of the present state; their drawn sizes stand."""


def plant_trace(world: World, s: Signals) -> Trace:
    """What the plant's form adds to the accelerations along the true motion."""
    robot, hidden, none = plant_robot(world.robot), hidden_of(world.case.effect, world.sizes), eq.Hidden()
    states = np.stack([s.x, s.y, s.yaw, s.v, s.w, s.q, s.left, s.right, s.slips.astype(float)], axis=1)
    calm, out, plant = np.zeros(3), np.zeros((3, len(states))), equations_of(world.case)
    for k, (state, t_s) in enumerate(zip(states, s.t_s, strict=True)):
        with_it = plant.accelerations(state, t_s, calm, robot, hidden)
        out[::2, k] = np.subtract(with_it, plant.accelerations(state, t_s, calm, robot, none))
    return Trace(out, np.zeros_like(out))


def least_at(at: F64, values: F64) -> float:
    """Where a parabola through the least value and its neighbours is least."""
    k = int(np.clip(np.argmin(values), 1, len(at) - 2))
    before, here, behind = values[k - 1 : k + 2]
    bend = before - 2 * here + behind
    shift = 0.5 * (before - behind) / bend if bend > 0 else 0.0
    return float(at[k] + np.clip(shift, -1.0, 1.0) * (at[1] - at[0]))


def fitted_sizes(world: World) -> dict[str, float]:
    """Sizes that an interval should hold: the best fit for another form, else those that were drawn."""
    name = world.case.effect
    if world.case.plant == 1 or name not in SIZES or name in SAME_FORM or name in WITH_MEMORY:
        return world.sizes
    s, parameter = signals_of(world), SIZES[name].parameter
    declared = [trace(name, {parameter: ratio * world.sizes[parameter]}, s) for ratio in RATIOS]
    steps = steps_of(s, world.conditions, world.case.noise_sd)
    columns = whitened(steps, [plant_trace(world, s), *declared])
    left = ((columns[:, 1:] - columns[:, :1]) ** 2).sum(axis=0)
    return {parameter: least_at(RATIOS, left) * world.sizes[parameter]}

"""What a plant's own form of a hidden effect adds along the true motion, as a trace like the declared ones.

It has longitudinal acceleration, l·yaw_acc and measured pose; the tyres' side force is left out.
"""

from collections.abc import Callable
from itertools import product
from types import ModuleType

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.model_file import Effect
from wmr_schemas.modes import ContactMode
from wmr_synth.hidden import plant as first
from wmr_synth.hidden.parameters import hidden_of as first_hidden
from wmr_synth.plants.two_wheeled import coefficients
from worlds.case import World
from worlds.oracle_forms import STEP_S, Signals, Trace, lagged
from worlds.plant_two import equations as eq
from worlds.plant_two.effects import hidden_of
from worlds.plant_two.world import equations_of, plant_robot, seen

FINE = 10
"""Steps of the actuator's equation in one step of the grid."""
ON_BODY = (
    *("rolling_resistance", "viscous_drag", "aerodynamic_drag", "scrub_torque", "yaw_damping", "slope"),
    "com_offset",
)
"""Effects that slipping does not lessen."""
WHEELS = [eq.LEFT, eq.RIGHT]
WITH_MEMORY = ("actuator_lag", "input_delay")
Pair = tuple[F64, F64]
Forces = Callable[[int, bool], tuple[float, float]]


def plant_trace(world: World, s: Signals) -> Trace:
    """The trace of the world's hidden effect, as the world's plant has it."""
    long, turn = of_first(world, s) if world.case.plant == 1 else of_others(world, s)
    name, pose = world.case.effect, np.stack([s.x, s.y, s.yaw])
    moved = seen(name, world.sizes, s.t_s, pose) - pose if world.case.plant != 1 else np.zeros_like(pose)
    return Trace(np.stack([long, np.zeros_like(long), turn]), moved)


def differences(accelerations: Forces, n: int) -> Pair:
    """``accelerations(row, with_it)`` with the effect minus without, ahead and l·yaw_acc, at n rows."""
    rows = ((accelerations(k, True), accelerations(k, False)) for k in range(n))
    found = np.array([np.subtract(*pair) for pair in rows])
    return found[:, 0], found[:, 1]


def of_others(world: World, s: Signals) -> Pair:
    """On the second and third plant."""
    robot, plant, calm = plant_robot(world.robot), equations_of(world.case), np.zeros(3)
    hidden = {True: hidden_of(world.case.effect, world.sizes), False: eq.Hidden()}
    state = np.zeros((len(s.t_s), plant.N_STATES))
    motion = {eq.X: s.x, eq.Y: s.y, eq.YAW: s.yaw, eq.V: s.v, eq.W: s.w, eq.Q: s.q, eq.SLIP: s.slips}
    for place, column in motion.items():
        state[:, place] = column
    commands = np.stack([s.left, s.right], axis=1)
    torques = {False: commands, True: commands}
    if world.case.effect in WITH_MEMORY:
        torques[True] = through_actuator(commands, plant, robot, hidden[True])

    def accelerations(k: int, with_it: bool) -> tuple[float, float]:
        state[k, WHEELS] = torques[with_it][k]
        return plant.accelerations(state[k], s.t_s[k], calm, robot, hidden[with_it])  # type: ignore[no-any-return]

    return differences(accelerations, len(s.t_s))


def through_actuator(commands: F64, plant: ModuleType, robot: eq.Robot, hidden: eq.Hidden) -> F64:
    """The torques (n, 2) behind the plant's delay and actuator, settled at first, as means over each step."""
    late, fine_s = hidden.input_delay, STEP_S / FINE
    calm, torques, out = np.zeros(3), np.zeros(2), np.zeros_like(commands)
    state, rate = np.zeros(plant.N_STATES), np.zeros(plant.N_STATES)
    state[WHEELS] = commands[0]
    for k, j in product(range(len(commands)), range(FINE)):
        at_s = k * STEP_S + (j + 0.5) * fine_s
        for side in range(2):
            torques[side] = plant.delayed(commands[:, side], k, at_s, STEP_S, late)
        if hidden.actuator_lag == 0.0:
            state[WHEELS] = torques
        else:
            plant.rates(state, at_s, 0, torques, calm, robot, hidden, rate)
            state[WHEELS] += fine_s * rate[WHEELS]
        out[k] += state[WHEELS] / FINE
    return out


def of_first(world: World, s: Signals) -> Pair:
    """On the project's simulator: two poles of half the time constant, else by its derivative."""
    name, sizes = world.case.effect, world.sizes
    if name == "actuator_lag":
        half_s = 0.5 * sizes["time_constant_s"]
        left, right = (lagged(lagged(u, half_s), half_s) - u for u in (s.left, s.right))
        return s.long * (right + left), s.turn * (right - left)
    effect, ideal = Effect(name, dict(sizes)), int(ContactMode.IDEAL)
    c = coefficients(world.robot, {ContactMode.IDEAL})
    hidden = {has: first_hidden([effect] if has else [], world.robot, plain=False) for has in (True, False)}
    state, out = np.zeros((len(s.t_s), first.N_EXTENDED)), np.zeros(first.N_EXTENDED)
    motion = {
        first.X: s.x,
        first.Y: s.y,
        first.YAW: s.yaw,
        first.V_LONG: s.v,
        first.TURN: c.half_track_m * s.q,
    }
    for place, column in motion.items():
        state[:, place] = column

    def accelerations(k: int, with_it: bool) -> tuple[float, float]:
        h = hidden[with_it]
        left = first.shaped(s.left[k], h.left_gain, h.bias_left_nm, h)
        right = first.shaped(s.right[k], h.right_gain, h.bias_right_nm, h)
        first.derivative(ideal, s.t_s[k], state[k], (left, right, 0.0, 0.0, 0.0), c, h, out)
        return float(out[first.V_LONG]), float(out[first.TURN])

    long, turn = differences(accelerations, len(s.t_s))
    if name in ON_BODY:
        return long, turn
    return long * s.long / c.alpha, turn * s.turn / c.alpha_yaw

"""A case with a hidden form, on the plants of ``worlds``: the form acts beside their own dynamics."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import ModuleType
from unittest.mock import patch

import numpy as np
from worlds import plant_one
from worlds.case import RATE_HZ, Case, Conditions, RanAway, Truth, World
from worlds.drivers import Drive
from worlds.plant_three import equations as third
from worlds.plant_two import equations as eq
from worlds.plant_two import world as plant_two

from formulas.forms import FORMS, ORDER, PLACED, At
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.robot import RobotParameters
from wmr_synth.plants.motion import Motion

ATTEMPTS = 5
AMPLITUDES = ("c", "size", "height", "rate")
Controller = Callable[[int, F64], F64]
"""Torques (left, right) at an instant and a state."""


@dataclass(frozen=True)
class Hidden:
    """A form with its sizes; without a name nothing is hidden."""

    name: str
    sizes: dict[str, float]

    def __call__(self, at: At) -> F64:
        """The hidden acceleration on the form's channel."""
        return np.asarray(FORMS[self.name].acceleration(at, self.sizes)) if self.name else np.zeros_like(at.t)

    def both(self, at: At) -> tuple[F64, F64]:
        """The same ahead and in yaw."""
        value = self(at)
        ahead = not self.name or FORMS[self.name].channel == "longitudinal"
        return (value, 0 * value) if ahead else (0 * value, value)

    def weaker(self) -> "Hidden":
        """Half of it."""
        return Hidden(self.name, {k: v / 2 if k in AMPLITUDES else v for k, v in self.sizes.items()})


@dataclass(frozen=True, eq=False)
class HiddenWorld:
    """A world with the hidden form in it."""

    world: World
    hidden: Hidden

    def at(self) -> At:
        """The true motion, where the robot drives."""
        truth, robot = self.world.truth, self.world.robot
        return at_of(truth, robot, truth.t_s)


def at_of(truth: Truth | Motion, robot: RobotParameters, t_s: F64) -> At:
    """A motion as the forms take it; slipping wheels pass on a share of what the torques ask for."""
    left, right = (
        (truth.left_nm, truth.right_nm)
        if isinstance(truth, Truth)
        else (truth.effort_left_nm, truth.effort_right_nm)
    )
    alpha, alpha_yaw, l = robot.alpha, robot.alpha_yaw_or_alpha, robot.half_track_m
    assert alpha is not None
    assert alpha_yaw is not None
    assert l is not None
    rate = truth.yaw_rate_radps
    passed = [
        np.where(np.asarray(truth.mode) == eq.SLIPPING, share, 1.0)
        for share in robot.slip_shares or (0.5, 0.5)
    ]
    pull, turn = alpha * (right + left) * passed[0], alpha_yaw * (right - left) * passed[1]
    return At(t_s, truth.x_m, truth.y_m, truth.yaw_rad, truth.v_long_mps, rate, l * rate, pull, turn)


def hidden_world(name: str, case: Case) -> HiddenWorld:
    """The case with the form, halved until the robot keeps to sensible speeds. Raises RanAway."""
    hidden = drawn(name, case)
    for attempt in range(ATTEMPTS):
        try:
            return HiddenWorld(PLANTS[case.plant](case, hidden), hidden)
        except (RanAway, InvalidSignal):  # a pose beyond all numbers is no signal
            if attempt == ATTEMPTS - 1:
                raise RanAway(case.key) from None
            hidden = hidden.weaker()
    raise AssertionError


def drawn(name: str, case: Case) -> Hidden:
    """The form's sizes for the case's seed; places as shares of the area that is driven without it."""
    if not name:
        return Hidden("", {})
    sizes = FORMS[name].drawn(case.stream("size", ORDER.index(name)))
    if name in PLACED:
        driven = PLANTS[case.plant](case, Hidden("", {})).truth
        spans = [(float(np.quantile(u, 0.02)), float(np.quantile(u, 0.98))) for u in (driven.x_m, driven.y_m)]
        for key, (low, high) in zip(("x", "y"), spans, strict=True):
            sizes[key] = low + sizes[key] * (high - low)
        sizes["radius"] *= float(np.mean([high - low for low, high in spans]))
    return Hidden(name, sizes)


def on_plant_one(case: Case, hidden: Hidden) -> World:
    """The project's own simulator; the form is held from one instant to the next."""

    def acceleration(motion: Motion) -> F64:
        at = at_of(motion, case.robot(), motion.t_ns / NS_PER_S)
        ahead, turning = hidden.both(at)
        return np.stack([ahead, np.zeros_like(ahead), turning], axis=1)

    own = None if not hidden.name else acceleration
    with patch("wmr_synth.hidden.world.own_acceleration", return_value=own):
        return plant_one.world_of(replace(case, effect=""))


def on_other_plants(case: Case, hidden: Hidden) -> World:
    """The benchmark's second or third plant, integrated here step by step with the form as a disturbance."""

    def moved(
        case: Case, drive: Drive, robot: RobotParameters, around: Conditions, _none: eq.Hidden
    ) -> plant_two.Motion:
        plant = plant_two.equations_of(case)
        n, per = round(case.duration_s * RATE_HZ), plant.STEPS_PER_COMMAND
        fine_s = np.arange(n * per) / (RATE_HZ * per)
        rows = np.searchsorted(drive.modes.t_ns / NS_PER_S, fine_s + 1e-9, side="right") - 1
        noise = plant_two.coloured(n + 1, 1 / RATE_HZ, around.disturbance_s, case.stream("disturbance"))
        disturbance = around.disturbance_mps2 * noise
        references = np.stack(drive.path(np.arange(n) / RATE_HZ))
        modes = drive.modes.mode[rows].astype(np.int64)
        states, commands = driven(plant, drive.start, references, modes, disturbance, robot, hidden)
        plant_two.check_stable(case, states[:, eq.V], states[:, eq.Q])
        return plant_two.Motion(np.append(fine_s, case.duration_s), states, commands)

    with patch("worlds.plant_two.world.moved", moved):
        return plant_two.world_of(replace(case, effect=""))


def driven(
    plant: ModuleType,
    start: tuple[float, float],
    references: F64,
    modes: F64,
    noise: F64,
    robot: RobotParameters,
    hidden: Hidden,
) -> tuple[F64, F64]:
    """States (n·per + 1, states) and commands (2, n), as ``drive`` of the equations gives them."""
    body, control, nothing = plant_two.plant_robot(robot), plant_two.control_of(robot), eq.Hidden()
    n = references.shape[1]
    per, h = len(modes) // n, control.period_s / (len(modes) // n)
    states, commands = np.empty((n * per + 1, plant.N_STATES)), np.zeros((2, n))
    work, between = np.empty((5, plant.N_STATES)), np.empty((2, 3))
    command = CONTROLLERS[plant](start, references, body, control)
    state = np.zeros(plant.N_STATES)
    state[eq.V], state[eq.Q] = start
    states[0] = state
    for k in range(n):
        commands[:, k] = torques = np.array(command(k, state))
        state[[eq.LEFT, eq.RIGHT]] = torques
        for j in range(per):
            t = k * control.period_s + j * h
            ahead, turning = hidden.both(at_state(t, state, torques, body))
            for end in range(2):
                share = (j + end) / per
                between[end] = (1 - share) * noise[k] + share * noise[k + 1]
                between[end] += (float(ahead), 0.0, float(turning))
            plant.step(state, t, h, modes[k * per + j], torques, between, body, nothing, work)
            states[k * per + j + 1] = state
    return states, commands


def second_controller(
    _start: tuple[float, float], references: F64, body: eq.Robot, control: eq.Control
) -> Controller:
    """The second plant's."""
    integral = np.zeros(2)
    return lambda k, state: eq.command(state, k, references, integral, control, body)


def third_controller(
    start: tuple[float, float], references: F64, body: eq.Robot, control: eq.Control
) -> Controller:
    """The third plant's, which filters what it feeds back."""
    integral, felt = np.zeros(2), np.array(start)

    def command(k: int, state: F64) -> F64:
        felt[:] += control.period_s / third.FEEDBACK_S * (state[[eq.V, eq.Q]] - felt)
        before = references[:, max(k - 1, 0)]
        return third.command(references[:, k], before, felt, integral, control, body)  # type: ignore[no-any-return]

    return command


CONTROLLERS = {eq: second_controller, third: third_controller}


def at_state(t: float, state: F64, torques: F64, plant: eq.Robot) -> At:
    """A state of the second or third plant as the forms take it; ``torques`` are left and right."""
    left, right = torques
    pull = plant.alpha * (right + left) * (1 - state[eq.SLIP] * (1 - plant.share_long))
    turn = plant.alpha_yaw * (right - left) * (1 - state[eq.SLIP] * (1 - plant.share_yaw))
    x, y, yaw, v, q = (state[i] for i in (eq.X, eq.Y, eq.YAW, eq.V, eq.Q))
    return At(np.float64(t), x, y, yaw, v, q, plant.half_track_m * q, pull, turn)


PLANTS: dict[int, Callable[[Case, Hidden], World]] = {
    1: on_plant_one,
    2: on_other_plants,
    3: on_other_plants,
}

"""A simulated world beyond the base model: effects, their form, and a disturbance."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wmr_schemas.arrays import I64
from wmr_schemas.effects import BaseModel, declared
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_synth.driving.drivers import Commands
from wmr_synth.driving.plan import Plan
from wmr_synth.hidden.disturbance import NO_DISTURBANCE, Disturbance, from_model
from wmr_synth.hidden.drawing import check_sizes, draw_effect, stream_number
from wmr_synth.hidden.measurement import MEASURED
from wmr_synth.hidden.own import own_acceleration
from wmr_synth.hidden.parameters import CHANGES, hidden_of
from wmr_synth.hidden.parse import parse_hide
from wmr_synth.hidden.placing import PATCH_SHARE, is_open, placed_at
from wmr_synth.hidden.registry import OWN_FORMS, words_of
from wmr_synth.hidden.rolling import ROLLING_CHANGES
from wmr_synth.hidden.simulate import simulate_hidden
from wmr_synth.plants.motion import Motion
from wmr_synth.sensors import stream

KNOWN = {*CHANGES, *ROLLING_CHANGES, *MEASURED, "pose_delay"}


@dataclass(frozen=True)
class World:
    """Effects, each at most once, in their hidden form or the candidates' (``plain``), and a disturbance."""

    effects: tuple[Effect, ...] = ()
    plain: bool = False
    disturbance: Disturbance = NO_DISTURBANCE

    def __post_init__(self) -> None:
        names = [effect.name for effect in self.effects]
        for name in names:
            if name not in KNOWN and name not in OWN_FORMS:
                raise InvalidSetting(f"the simulator has no effect {name!r}")
            if names.count(name) > 1:
                raise InvalidSetting(f"{name} is given twice")
        for effect in self.effects:
            check_sizes(effect)

    def check_base(self, base: BaseModel) -> None:
        """Raises InvalidSetting naming an effect that robots of the base model do not have."""
        for effect in self.effects:
            if base not in declared(effect.name).models:
                other = "wheel speeds" if base == "torque" else "wheel torques"
                raise InvalidSetting(f"{effect.name} is an effect of robots that {other} drive")

    @property
    def extends(self) -> bool:
        """Whether there is anything beyond the base model."""
        return bool(self.effects) or self.disturbance.acts


def drawn_world(
    hide: Iterable[str], seed: int, robot: RobotParameters, duration_s: float, disturbance: Disturbance
) -> World:
    """The effects of ``--hide``, their open parameters drawn from a stream of the seed for each effect."""
    effects = []
    for name, given in map(parse_hide, hide):
        rng = stream(seed, "hide", stream_number(name))
        effects.append(draw_effect(name, given, rng, robot, duration_s))
    return World(tuple(effects), disturbance=disturbance)


def model_world(model: Model) -> World:
    """The world as an extended model has it."""
    return World(model.effects, plain=True, disturbance=from_model(model.noise))


def describe_effects(world: World, base: BaseModel = "torque") -> list[dict[str, Any]]:
    """The effects for ``<stem>.truth.json``: catalogue names and parameters, and the form really used."""
    return [
        {
            "name": effect.name,
            "parameters": effect.parameters,
            "form": declared(effect.name).formula_of(base) if world.plain else words_of(effect.name, base),
        }
        for effect in world.effects
    ]


def move_in(
    world: World,
    robot: RobotParameters,
    plan: Plan,
    commands: Commands,
    instants: tuple[I64, I64],
    seed: int,
) -> tuple[World, Motion]:
    """The plan's motion in the world, and the world with every place decided; ``instants``: torque, pose."""
    if plan.friction is not None:
        raise InvalidSetting("effects and disturbances do not go with a traction-limited scenario")
    settled, lying = world, [effect for effect in world.effects if is_open(effect)]
    start = plan.v_long_mps, plan.yaw_rate_radps

    def motion(effects: tuple[Effect, ...]) -> Motion:
        hidden = hidden_of(effects, robot, plain=world.plain)
        noise = world.disturbance, stream(seed, "disturbance")
        own = own_acceleration(effects)
        return simulate_hidden(robot, plan.modes, commands, instants, start, hidden, noise, own)

    if lying:
        others = tuple(effect for effect in world.effects if not is_open(effect))
        placed = place(lying[0], motion(others), stream(seed, "patch"))
        settled = replace(world, effects=tuple(placed if e is lying[0] else e for e in world.effects))
    return settled, motion(settled.effects)


def place(effect: Effect, motion: Motion, rng: np.random.Generator) -> Effect:
    """The effect where the robot is at a time drawn from the quarter with the largest torques."""
    first, last = np.searchsorted(motion.t_ns, np.array(PATCH_SHARE) * motion.t_ns[-1])
    torque = np.abs(motion.effort_left_nm + motion.effort_right_nm)[first : last + 1]
    row = int(first + rng.choice(np.flatnonzero(torque >= np.quantile(torque, 0.75))))
    return placed_at(effect, float(motion.x_m[row]), float(motion.y_m[row]))

"""A log of a robot that wheel speeds drive: what it does, and what its sensors record of it."""

from dataclasses import asdict, dataclass, replace
from math import isinf
from typing import Any

import numpy as np

from wmr_schemas.arrays import I64, NS_PER_S
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import CommandTrack
from wmr_synth.hidden.disturbance import GRID_NS, unit_ou
from wmr_synth.hidden.measurement import as_seen
from wmr_synth.hidden.placing import PATCH_SHARE, is_open, placed_at
from wmr_synth.hidden.rolling import rolling_hidden
from wmr_synth.hidden.world import World
from wmr_synth.plants.motion import Motion
from wmr_synth.sensors import sampling_instants, stream
from wmr_synth.wheel_speed.chassis import WheelRobot
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import Ground
from wmr_synth.wheel_speed.loop import Outside, simulate_rolling
from wmr_synth.wheel_speed.plan import RollingPlan
from wmr_synth.wheel_speed.torques import Drivetrain, drawn_drivetrain, true_alpha


@dataclass(frozen=True, eq=False)
class RollingDrive:
    """A simulated drive: the robot, the world with every place decided, the motion at all instants, and when
    each sensor looks (ns since the start).
    """

    robot: WheelRobot
    world: World
    ground: Ground
    motion: Motion
    commands: CommandTrack
    pose_ns: I64
    wheel_ns: I64
    stated: RobotParameters
    drivetrain: Drivetrain | None = None

    def seen(self) -> Motion:
        """The motion as a pose sensor reports it at the pose instants."""
        looked_at = np.maximum(self.pose_ns - delay_of(self.world.effects), 0)
        at_pose = self.motion.take(np.searchsorted(self.motion.t_ns, looked_at))
        return as_seen(replace(at_pose, t_ns=self.pose_ns), self.world.effects)

    def commands_from(self, start_ns: int) -> CommandTrack:
        """The commands, with stamps from ``start_ns`` on."""
        c = self.commands
        return CommandTrack(start_ns + c.t_ns, c.left_radps, c.right_radps)

    def facts(self) -> dict[str, Any]:
        """What the truth file states of the robot and the ground.

        ``calibration`` holds what the base model's own parameters are in truth, by the effects' names.
        """
        r, g = self.robot, self.ground
        true = {key: None if isinstance(v, float) and isinf(v) else v for key, v in asdict(r).items()}
        calibration = {
            "wheel_scale": {"ratio": r.wheel_radius_m / r.stated_radius_m - 1},
            "effective_track": {"ratio": r.half_track_m / r.stated_half_track_m - 1},
            "icr_offset": {"offset_m": r.icr_offset_m},
            "lateral_slip": {"seconds": r.lateral_slip_s},
        }
        keys = ("t_s", "left", "right", "sideways")
        rows = np.column_stack([g.t_ns / NS_PER_S, g.left, g.right, g.sideways]).tolist()
        friction = [{k: None if isinf(v) else v for k, v in zip(keys, row, strict=True)} for row in rows]
        facts = {"base_model": "wheel_speed", "true_robot": true, "calibration": calibration}
        if self.drivetrain is not None:
            facts |= {"drivetrain": asdict(self.drivetrain) | {"alpha": true_alpha(self.drivetrain, r)}}
        return facts | {"friction": friction}


def drive(
    plan: RollingPlan,
    nominal: RobotParameters,
    world: World,
    sensors: EncoderSensors,
    duration_s: float,
    seed: int,
) -> RollingDrive:
    """The plan driven by one robot with the ``nominal`` lengths in a world.

    A world out of a model file has the robot that the model says. Its dry ground, like that of a textbook
    robot, holds any force.
    """
    command_ns = sampling_instants(duration_s, sensors.command_rate_hz, 0.0, stream(seed, "scenario", 1))
    pose_ns = sampling_instants(duration_s, sensors.rate_hz, sensors.jitter_s, stream(seed, "pose_jitter"))
    wheel_ns = sampling_instants(
        duration_s, sensors.wheel_rate_hz, sensors.jitter_s, stream(seed, "torque_jitter")
    )
    reference = plan.reference(duration_s, command_ns, stream(seed, "scenario"))
    robot = robot_of(plan, nominal, world, seed)
    outside = outside_of(plan, world, robot, duration_s, seed)
    stated, drivetrain = robot.nominal, None
    if plan.torques != "none":
        stated = nominal.overridden_by(stated)
        drivetrain, stated = drawn_drivetrain(robot, stated, stream(seed, "drivetrain"))

    def moved(effects: tuple[Effect, ...]) -> tuple[Motion, Any]:
        looked_at = np.unique(np.maximum(pose_ns - delay_of(effects), 0))
        hidden = rolling_hidden(effects, plain=world.plain)
        seen = pose_ns, wheel_ns, looked_at
        return simulate_rolling(robot, reference, outside, seen, hidden, drivetrain)

    settled = settle(world, lambda effects: moved(effects)[0], seed)
    motion, sent = moved(settled.effects)
    commands = CommandTrack(command_ns, *np.ascontiguousarray(sent.T))
    return RollingDrive(
        robot, settled, outside.ground, motion, commands, pose_ns, wheel_ns, stated, drivetrain
    )


def robot_of(plan: RollingPlan, nominal: RobotParameters, world: World, seed: int) -> WheelRobot:
    """One robot of the plan's kind, or the one that a model says."""
    if world.plain:
        return plan.chassis.exact(nominal)
    rng, error = stream(seed, "robot"), plan.nominal_error
    return plan.chassis.drawn(rng, nominal, nominal_error=error, textbook=plan.textbook)


def outside_of(plan: RollingPlan, world: World, robot: WheelRobot, duration_s: float, seed: int) -> Outside:
    """Ground, unevenness and disturbance of a drive."""
    ground = plan.floor.drawn(duration_s, stream(seed, "ground"))
    if plan.textbook or world.plain:
        ground = ground.holding()
    t_ns = np.arange(0, round(duration_s * NS_PER_S), GRID_NS)
    rough = np.zeros((len(t_ns), 3))
    if robot.roughness > 0:
        steps = np.full(len(t_ns) - 1, GRID_NS / NS_PER_S / plan.floor.uneven_tau_s)
        rough = plan.floor.uneven * unit_ou(steps, stream(seed, "roughness"))
    return Outside(ground, t_ns, rough, world.disturbance.held(t_ns, stream(seed, "disturbance")))


def settle(world: World, motion: Any, seed: int) -> World:
    """The world with the open place of a patch decided: where the robot drives fast without it."""
    lying = next((effect for effect in world.effects if is_open(effect)), None)
    if lying is None:
        return world
    others = motion(tuple(effect for effect in world.effects if effect is not lying))
    first, last = np.searchsorted(others.t_ns, np.array(PATCH_SHARE) * others.t_ns[-1])
    speed = np.abs(others.v_long_mps)[first : last + 1]
    rows = np.flatnonzero(speed >= np.quantile(speed, 0.75))
    row = int(first + stream(seed, "patch").choice(rows))
    there = placed_at(lying, float(others.x_m[row]), float(others.y_m[row]))
    return replace(world, effects=tuple(there if e is lying else e for e in world.effects))


def delay_of(effects: tuple[Effect, ...]) -> int:
    """By how much the pose is late, ns."""
    late = (effect.parameters["delay_s"] for effect in effects if effect.name == "pose_delay")
    return round(sum(late) * NS_PER_S)

"""From a scenario to the signals that a recorder sees, and to the truth that only the simulator knows."""

import difflib
import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.effects import BaseModel
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.messages.codec import WheelAngles
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack
from wmr_synth.driving.drivers import Commands
from wmr_synth.driving.plan import Plan
from wmr_synth.hidden.disturbance import DEFAULT_DISTURBANCE, Disturbance
from wmr_synth.hidden.measurement import as_seen
from wmr_synth.hidden.world import World, describe_effects, move_in
from wmr_synth.plants.limited_traction import TYRE
from wmr_synth.plants.limited_traction_loop import simulate_limited, switches_of
from wmr_synth.plants.motion import Motion, union_of_sorted
from wmr_synth.plants.two_wheeled_loop import simulate
from wmr_synth.scenarios import DRIVE_SUFFIX, SCENARIOS, Scenario, scenario_of_drive
from wmr_synth.sensors import Sensors, measure_pose, measure_torque, sampling_instants, stream
from wmr_synth.wheel_speed.encoders import (
    OF_TORQUES,
    EncoderSensors,
    measure_efforts,
    measure_wheels,
    rates_hz,
)
from wmr_synth.wheel_speed.log import drive
from wmr_synth.wheel_speed.plan import CommandsAs, RollingPlan
from wmr_synth.wheel_speed.torques import TorquesAs

MIN_DURATION_S = 0.001
MAX_MESSAGES = 50_000_000
START_NS = 1_700_000_000 * NS_PER_S
"""Every synthetic log starts here, so that one seed gives one file."""


@dataclass(frozen=True, eq=False)
class SimulatedLog:
    """A log and its truth.

    ``truth`` is the noise-free motion at the logged pose stamps; ``wheel_angles_rad`` (left, right) belong to
    the rows of torques, or of wheel speeds; ``facts`` is what ``<stem>.truth.json`` says: scenario, seed,
    options, parameters, switches. ``commands_as`` is how a file holds the commands.
    """

    log: Log
    truth: Motion
    wheel_angles_rad: WheelAngles
    facts: dict[str, object]
    commands_as: CommandsAs = "wheels"


def find_scenario(name: str) -> Scenario:
    """The scenario of that name, or of a drive file (``….toml``).

    Raises InvalidSetting with the known names and the nearest, InvalidFile for a file that is no drive.
    """
    if name in SCENARIOS:
        return SCENARIOS[name]
    if name.endswith(DRIVE_SUFFIX):
        return scenario_of_drive(Path(name))
    near = difflib.get_close_matches(name, SCENARIOS, n=2)
    hint = f"did you mean {' or '.join(near)}? " if near else ""
    raise InvalidSetting(f"no scenario {name!r}; {hint}known are {', '.join(SCENARIOS)}")


def synthesise(  # noqa: PLR0913 – one call says what a log is
    scenario: str | Scenario,
    *,
    seed: int = 0,
    duration_s: float | None = None,
    sensors: Sensors | None = None,
    robot: RobotParameters | None = None,
    world: World | None = None,
    wrong_modes: float = 0.0,
    nominal_error: float | None = None,
    commands_as: CommandsAs | None = None,
    torques_as: TorquesAs | None = None,
) -> SimulatedLog:
    """Simulate a scenario and measure it, by itself with the scenario's own duration, sensors and robot.

    ``world`` holds what the robot's parameters do not say (effects, disturbance); without one a disturbed
    scenario has its disturbance. ``wrong_modes`` is the share of pose samples at which the mode channel errs.
    ``nominal_error``, ``commands_as`` and ``torques_as`` change the plan of a robot that wheel speeds drive,
    whose nominal lengths are those of ``robot``. The same arguments give the same log, bit for bit. Raises
    InvalidSetting for an unknown scenario, a duration below 1 ms or beyond memory, a negative seed, or a
    robot that lacks what the modes need.
    """
    chosen = find_scenario(scenario) if isinstance(scenario, str) else scenario
    sensors = chosen.sensors if sensors is None else sensors
    robot = chosen.robot if robot is None else robot
    world = default_world(chosen) if world is None else world
    duration_s = chosen.duration_s if duration_s is None else duration_s
    check_size(seed, duration_s, sensors)
    if isinstance(chosen.plan, RollingPlan):
        rolling = changed_plan(chosen.plan, nominal_error, commands_as, torques_as)
        return rolling_log(chosen.name, rolling, robot, world, sensors, duration_s, seed, wrong_modes)
    if nominal_error is not None or commands_as is not None:
        raise InvalidSetting(f"{chosen.name} is driven by torques: it has no commands and no nominal error")
    if torques_as is not None:
        raise InvalidSetting(f"{chosen.name} is driven by torques: its log always holds them")
    world.check_base("torque")
    plan = chosen.plan(duration_s, stream(seed, "scenario"))
    pose_ns = sampling_instants(duration_s, sensors.rate_hz, sensors.jitter_s, stream(seed, "pose_jitter"))
    torque_ns = sampling_instants(
        duration_s, sensors.torque_rate_hz, sensors.jitter_s, stream(seed, "torque_jitter")
    )
    commands = plan.driver.commands(torque_ns / NS_PER_S)
    if world.extends:
        world, motion = move_in(world, robot, plan, commands, (torque_ns, pose_ns), seed)
        switches = plan.modes
    else:
        motion, switches = move(robot, plan, commands, torque_ns, pose_ns)
    modes = ModeTrack(START_NS + switches.t_ns, switches.mode)
    facts = describe(chosen.name, seed, duration_s, sensors, robot, modes) | describe_ground(plan)
    facts |= describe_world(world) | ({"wrong_modes": wrong_modes} if wrong_modes else {})
    labels = mislabelled(modes, START_NS + pose_ns, wrong_modes, stream(seed, "labels"))
    return measure(motion, (torque_ns, pose_ns), sensors, seed, labels, robot, facts, world.effects)


def changed_plan(
    plan: RollingPlan,
    nominal_error: float | None,
    commands: CommandsAs | None,
    torques: TorquesAs | None,
) -> RollingPlan:
    """The plan with another nominal error and other ways to hold commands and torques, where given."""
    if nominal_error is not None and not 0 <= nominal_error < 0.5:
        raise InvalidSetting(f"the nominal error is a share from 0 to 0.5, not {nominal_error}")
    error = plan.nominal_error if nominal_error is None else nominal_error
    return replace(
        plan,
        nominal_error=error,
        commands=commands or plan.commands,
        torques=torques or plan.torques,
    )


def rolling_log(
    name: str,
    plan: RollingPlan,
    robot: RobotParameters,
    world: World,
    sensors: Sensors,
    duration_s: float,
    seed: int,
    wrong_modes: float,
) -> SimulatedLog:
    """The log of a robot that wheel speeds drive; ``robot`` holds its nominal lengths."""
    world.check_base("wheel_speed")
    if not isinstance(sensors, EncoderSensors):
        raise InvalidSetting(f"{name} needs EncoderSensors: it records wheel speeds")
    driven = drive(plan, robot, world, sensors, duration_s, seed)
    switches, robot = switches_of(driven.motion), driven.stated
    modes = ModeTrack(START_NS + switches.t_ns, switches.mode)
    facts = describe(name, seed, duration_s, sensors, robot, modes) | driven.facts()
    facts |= describe_world(driven.world, "wheel_speed") | {"commands": plan.commands}
    facts |= {"wrong_modes": wrong_modes} if wrong_modes else {}
    labels = mislabelled(modes, START_NS + driven.pose_ns, wrong_modes, stream(seed, "labels"))
    pose, kept = measure_pose(driven.seen(), sensors, seed, START_NS)
    at_wheels = driven.motion.at(driven.wheel_ns)
    wheels, angles = measure_wheels(at_wheels, sensors, seed, START_NS)
    torque = None
    if plan.torques != "none":
        together = plan.torques == "together"
        torque = measure_efforts(at_wheels, wheels, sensors, seed, together=together)
    sent = None if plan.commands == "none" else driven.commands_from(START_NS)
    log = Log(pose, torque, labels, robot, wheels, sent)
    return SimulatedLog(log, driven.motion.at(driven.pose_ns).take(kept), angles, facts, plan.commands)


def default_world(scenario: Scenario) -> World:
    """The base model's world, with a disturbance where the scenario has one."""
    return World(disturbance=DEFAULT_DISTURBANCE if scenario.disturbed else Disturbance())


def mislabelled(modes: ModeTrack, t_ns: I64, share: float, rng: np.random.Generator) -> ModeTrack:
    """The modes as a label that errs at a share of the instants ``t_ns``, each by itself.

    Raises InvalidSetting for a share outside [0, 1].
    """
    if not 0 <= share <= 1:
        raise InvalidSetting(f"the share of wrong modes must lie between 0 and 1, not {share}")
    if share == 0:
        return modes
    stamps = union_of_sorted(t_ns, modes.t_ns)
    mode = modes.mode[np.searchsorted(modes.t_ns, stamps, side="right") - 1]
    errs = np.isin(stamps, t_ns) & (rng.uniform(0.0, 1.0, len(stamps)) < share)
    label = np.where(errs, (mode + rng.integers(1, 3, len(stamps))) % 3, mode).astype(np.int8)
    kept = np.flatnonzero(np.diff(label, prepend=-1))
    return ModeTrack(stamps[kept], label[kept])


def move(
    robot: RobotParameters, plan: Plan, commands: Commands, torque_ns: I64, pose_ns: I64
) -> tuple[Motion, ModeTrack]:
    """The plan's motion on its plant, and the true mode."""
    start = plan.v_long_mps, plan.yaw_rate_radps
    if plan.friction is None:
        return simulate(robot, plan.modes, commands, torque_ns, pose_ns, start), plan.modes
    motion = simulate_limited(robot, plan.modes, plan.friction, commands, torque_ns, pose_ns, start)
    return motion, switches_of(motion)


def describe_ground(plan: Plan) -> dict[str, object]:
    """Friction and tyre, where they limit traction."""
    if plan.friction is None:
        return {}
    rows = zip((plan.friction.t_ns / NS_PER_S).tolist(), plan.friction.coefficient.tolist(), strict=True)
    return {"friction": [{"t_s": t_s, "coefficient": mu} for t_s, mu in rows], "tyre": asdict(TYRE)}


def describe_world(world: World, base: BaseModel = "torque") -> dict[str, object]:
    """Effects and disturbance; the latter only where there is one."""
    facts: dict[str, object] = {"effects": describe_effects(world, base)}
    return facts | ({"disturbance": asdict(world.disturbance)} if world.disturbance.acts else {})


def check_size(seed: int, duration_s: float, sensors: Sensors) -> None:
    """The log has a length, and fits into memory."""
    if seed < 0:
        raise InvalidSetting(f"the seed must not be negative, not {seed}")
    if not (math.isfinite(duration_s) and duration_s >= MIN_DURATION_S):
        raise InvalidSetting(f"the duration must be at least {MIN_DURATION_S} s, not {duration_s}")
    n_messages = duration_s * sum(rates_hz(sensors))
    if n_messages > MAX_MESSAGES:
        raise InvalidSetting(
            f"{n_messages:.0f} messages are more than the {MAX_MESSAGES:.0f} that one log may have; "
            "shorten the duration or lower the rates"
        )


def measure(
    motion: Motion,
    instants: tuple[I64, I64],
    sensors: Sensors,
    seed: int,
    modes: ModeTrack,
    robot: RobotParameters,
    facts: dict[str, object],
    effects: tuple[Effect, ...] = (),
) -> SimulatedLog:
    """The log that sensors record of a motion at the ``instants`` of torque and pose."""
    torque_ns, pose_ns = instants
    at_pose = motion.at(pose_ns)
    at_torque = at_pose if np.array_equal(pose_ns, torque_ns) else motion.at(torque_ns)
    pose, pose_kept = measure_pose(as_seen(at_pose, effects), sensors, seed, START_NS)
    torque, torque_kept = measure_torque(at_torque, sensors, seed, START_NS)
    angles: tuple[F64, F64] = at_torque.left_rad[torque_kept], at_torque.right_rad[torque_kept]
    return SimulatedLog(Log(pose, torque, modes, robot), at_pose.take(pose_kept), angles, facts)


def describe(
    name: str, seed: int, duration_s: float, sensors: Sensors, robot: RobotParameters, modes: ModeTrack
) -> dict[str, object]:
    """The facts of ``<stem>.truth.json``."""
    unused = OF_TORQUES if isinstance(sensors, EncoderSensors) else ()
    switches = [
        {"t_s": (t_ns - START_NS) / NS_PER_S, "mode": mode}
        for t_ns, mode in zip(modes.t_ns.tolist(), modes.mode.tolist(), strict=True)
    ]
    return {
        "scenario": name,
        "seed": seed,
        "start_ns": START_NS,
        "duration_s": duration_s,
        "sensors": {key: value for key, value in asdict(sensors).items() if key not in unused},
        "robot": robot.known(),
        "modes": switches,
    }


def truth_columns(motion: Motion, start_ns: int = START_NS) -> dict[str, np.ndarray]:
    """The columns of ``<stem>.truth.parquet``, by name."""
    columns = {
        name: column for name, column in vars(motion).items() if not name.startswith(("left", "right"))
    }
    return {**columns, "t_ns": start_ns + motion.t_ns}

"""Tests of a channel for the roles wheel speed and command, by schema and content, each with a rank."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.channels.first_rows import first_rows
from wmr_replay.ingest.channels.frames import Frames
from wmr_replay.ingest.channels.named import COMMANDED
from wmr_replay.ingest.channels.roles import Rank, check_fields, stamp_of
from wmr_replay.ingest.channels.torque_bindings import Wheels
from wmr_replay.ingest.channels.wheel_bindings import (
    FieldSides,
    InterfaceSides,
    JointSides,
    PositionBinding,
    Sides,
    SpeedBinding,
    TwistBinding,
    Values,
    WheelPair,
)
from wmr_replay.ingest.decoding.bindings import Binding, NotConcerned
from wmr_replay.ingest.decoding.layout import Undecodable
from wmr_schemas.mapping_file import Joints, LogMapping
from wmr_schemas.units import RIM_SPEED, TURN_UNITS
from wmr_schemas.wheel_fields import CommandFields, WheelSpeedFields

NOTHING = "no wheel speeds"
_JOINTS = {"JointState", "DynamicJointState", "JointTrajectoryControllerState"}
_TWISTS = {"Odometry", "TwistStamped", "TwistWithCovarianceStamped", "Twist", "TwistWithCovariance"}
_COMMANDS = {*_JOINTS, "MultiDOFCommand", "JointJog", "TwistStamped", "Twist"}
_SPEEDS = (("name", "velocity"), ("joint_names", "feedback.velocities"), ("joint_names", "actual.velocities"))
_POSITIONS = (
    ("name", "position"),
    ("joint_names", "feedback.positions"),
    ("joint_names", "actual.positions"),
)
_WANTED = (("joint_names", "reference.velocities"), ("joint_names", "desired.velocities"))
_WANTED_BY_TOPIC = (("name", "velocity"), ("dof_names", "values"), ("joint_names", "velocities"))
"""Forms that hold measured values too: commands where the topic says so."""
_TWIST_STEMS = ("twist.twist.", "twist.", "")
_BY_WHEELS = re.compile(r"wheel|encoder|odom|diff_?drive", re.I)
_NOT_BY_WHEELS = re.compile(
    r"filtered|ekf|ukf|fus(ed|ion)|local(?!host)|global|visual|vio|vins|vslam|rgbd|stereo|zed|camera|t265"
    r"|realsense|lidar|laser|icp|slam|loam|lio|gps|gnss|rtk|truth|mocap|vicon|optitrack|imu|radar|flow",
    re.I,
)
"""Odometry that is not, or not only, of the wheels."""
_LAST = re.compile(r"cmd_vel_out$", re.I)
_INPUT_OF_A_MUX = re.compile(r"nav|teleop|joy|key|web|raw|smooth|input|unlimited|monitor|collision", re.I)

MOST_WHEELS = 8
"""On one side, of which each has a column of positions."""
BY_SPEEDS, BY_POSITIONS, BY_TWIST = range(3)


def wheel_speed_role(candidate: Candidate, mapping: LogMapping, frames: Frames) -> tuple[Binding, Rank]:
    """Speeds of wheels before positions before the twist of odometry that is the wheels'."""
    topic = candidate.channel.topic
    named = mapping.wheel_speed_topic is not None or mapping.wheel_speeds.name_values
    if not named:
        if not _may_hold(candidate, _JOINTS | _TWISTS):
            raise DoesNotServe(NOTHING)
        if COMMANDED.search(topic):
            raise DoesNotServe("by its topic commands, no measured wheel speeds")
    bindings = _wheel_bindings(candidate, mapping)
    binding, kind = _first_that_serves(candidate, bindings, lenient=named)
    if kind == BY_TWIST and not (named or _is_of_wheels(candidate)):
        raise DoesNotServe("by its topic a speed that is not of the wheels alone")
    return binding, (kind, candidate.is_slow, not _BY_WHEELS.search(topic), -candidate.n_messages)


def _is_of_wheels(candidate: Candidate) -> bool:
    """Whether a twist is wheel odometry by its name."""
    topic = candidate.channel.topic
    return bool(_BY_WHEELS.search(f"{topic} {candidate.short_name}")) and not _NOT_BY_WHEELS.search(topic)


def command_role(candidate: Candidate, mapping: LogMapping, frames: Frames) -> tuple[Binding, Rank]:
    """Commanded wheel speeds before twists; of twists the one that is nearest to the drive."""
    topic = candidate.channel.topic
    named = mapping.command_topic is not None or mapping.commands.name_values
    if not named and not _may_hold(candidate, _COMMANDS):
        raise DoesNotServe(NOTHING)
    bindings = _command_bindings(candidate, mapping, anyway=named or bool(COMMANDED.search(topic)))
    binding, kind = _first_that_serves(candidate, bindings, lenient=named)
    return binding, (
        kind,
        not _LAST.search(topic),
        bool(_INPUT_OF_A_MUX.search(topic)),
        candidate.is_slow,
        -candidate.n_messages,
    )


def _may_hold(candidate: Candidate, names: set[str]) -> bool:
    """Whether a schema may hold such values, as a cheap first test."""
    schemaless = candidate.schema is None and (candidate.mentions(b"veloc") or candidate.mentions(b"linear"))
    return candidate.short_name in names or schemaless


def _first_that_serves(
    candidate: Candidate, bindings: Iterator[tuple[Binding, int]], *, lenient: bool
) -> tuple[Binding, int]:
    """The first binding whose values are known in the first messages; ``lenient``: that fits them."""
    problem = NOTHING
    for binding, kind in bindings:
        try:
            candidate.try_out(binding)
        except DoesNotServe as reason:
            problem = str(reason) if problem == NOTHING else problem
            continue
        if lenient or holds_values(candidate, binding):
            return binding, kind
        problem = "its first messages hold no value of a left and a right wheel"
    raise DoesNotServe(problem)


def holds_values(candidate: Candidate, binding: Binding) -> bool:
    """Whether one of the first messages holds every value of the binding."""
    rows = first_rows(candidate.definition, binding, candidate.samples)
    return bool(np.isfinite(rows.values[:, rows.used]).all(axis=0).any())


def _wheel_bindings(candidate: Candidate, mapping: LogMapping) -> Iterator[tuple[Binding, int]]:
    """What a channel's messages may hold of wheel speeds, best first."""
    wanted, pair = mapping.wheel_speeds, WheelPair.of(mapping.robot)
    wheels = _wheels(mapping.wheel_speed_joints, mapping)
    if wanted.name_values or wanted.are_positions:
        yield _wanted_wheels(candidate, wanted, wheels, pair)
        return
    for sides in _joint_sides(candidate, wheels, wanted.names, _SPEEDS, "velocity"):
        yield _speeds(candidate, sides, wanted, pair), BY_SPEEDS
    radians = replace(wanted, unit="rad")
    for sides in _joint_sides(candidate, wheels, wanted.names, _POSITIONS, "position"):
        yield positions(candidate, sides, radians, pair), BY_POSITIONS
    yield from _twists(candidate, wanted, pair)


def _wanted_wheels(
    candidate: Candidate, wanted: WheelSpeedFields, wheels: Wheels, pair: WheelPair
) -> tuple[Binding, int]:
    """What the mapping names. Raises DoesNotServe."""
    if wanted.linear and wanted.angular:
        return _twist(candidate, wanted.linear, wanted.angular, wanted, pair), BY_TWIST
    usual = _POSITIONS if wanted.are_positions else _SPEEDS
    sides = _wanted_sides(
        candidate, wanted, wheels, usual, "position" if wanted.are_positions else "velocity"
    )
    if wanted.are_positions:
        return positions(candidate, sides, wanted, pair), BY_POSITIONS
    return _speeds(candidate, sides, wanted, pair), BY_SPEEDS


def _speeds(candidate: Candidate, sides: Sides, wanted: CommandFields, pair: WheelPair) -> SpeedBinding:
    """Speeds in the unit that the mapping gives."""
    radius_m = pair.parameters().get("wheel_radius_m") if wanted.unit == RIM_SPEED else None
    return SpeedBinding(stamp_of(candidate), sides, wanted.gains(pair.radius_m), radius_m)


def _command_bindings(
    candidate: Candidate, mapping: LogMapping, *, anyway: bool
) -> Iterator[tuple[Binding, int]]:
    """What a channel's messages may hold of commands, best first; ``anyway``: its name says so."""
    wanted, pair = mapping.commands, WheelPair.of(mapping.robot)
    wheels = _wheels(mapping.command_joints, mapping)
    if wanted.linear and wanted.angular:
        yield _twist(candidate, wanted.linear, wanted.angular, wanted, pair), BY_TWIST
        return
    forms = (*_WANTED, *_WANTED_BY_TOPIC) if anyway else _WANTED
    if wanted.left_fields or wanted.values:
        sides = _wanted_sides(candidate, wanted, wheels, forms, "velocity")
        yield _speeds(candidate, sides, wanted, pair), BY_SPEEDS
        return
    interface = "velocity" if anyway else None
    for found in _joint_sides(candidate, wheels, wanted.names, forms, interface):
        yield _speeds(candidate, found, wanted, pair), BY_SPEEDS
    if anyway:
        yield from _twists(candidate, wanted, pair)


def _wheels(own: Joints, mapping: LogMapping) -> Wheels:
    """The wheels by the joints that the section names, else the torques' section, else by their names."""
    return Wheels(*own) if any(own) else Wheels(mapping.left_joints, mapping.right_joints)


def _joint_sides(
    candidate: Candidate,
    wheels: Wheels,
    names: str | None,
    forms: tuple[tuple[str, str], ...],
    interface: str | None,
) -> Iterator[Sides]:
    """The forms of values by joints that the messages have."""
    if interface and candidate.has("joint_names", "interface_values"):
        yield InterfaceSides(wheels, interface)
    for usual, array in forms:
        if candidate.has(names or usual, array):
            yield JointSides(wheels, names or usual, array)


def _wanted_sides(
    candidate: Candidate,
    wanted: CommandFields,
    wheels: Wheels,
    forms: tuple[tuple[str, str], ...],
    interface: str,
) -> Sides:
    """The fields, the array or the interface that the mapping names. Raises DoesNotServe."""
    if wanted.left_fields:
        check_fields(candidate, *wanted.left_fields, *wanted.right_fields)
        return FieldSides(wanted.left_fields, wanted.right_fields)
    if candidate.has("joint_names", "interface_values"):
        return InterfaceSides(wheels, wanted.values or interface)
    if wanted.values:
        usual = next((n for n, _ in forms if candidate.has(n)), "name")
        names = wanted.names or usual
        check_fields(candidate, names, wanted.values)
        return JointSides(wheels, names, wanted.values)
    sides = next(_joint_sides(candidate, wheels, wanted.names, forms, None), None)
    if sides is None:
        raise DoesNotServe(f"no array of {interface} by joints: name values, or left_fields and right_fields")
    return sides


def _twists(
    candidate: Candidate, wanted: CommandFields, pair: WheelPair
) -> Iterator[tuple[TwistBinding, int]]:
    """The twist of a message, at the usual place."""
    for stem in _TWIST_STEMS:
        linear, angular = f"{stem}linear.x", f"{stem}angular.z"
        if candidate.has(linear, angular):
            yield _twist(candidate, linear, angular, wanted, pair), BY_TWIST


def _twist(
    candidate: Candidate, linear: str, angular: str, wanted: CommandFields, pair: WheelPair
) -> TwistBinding:
    """A twist at two paths. Raises DoesNotServe."""
    check_fields(candidate, linear, angular)
    return TwistBinding(stamp_of(candidate), linear, angular, pair, wanted.scale)


def positions(
    candidate: Candidate, sides: Sides, wanted: WheelSpeedFields, pair: WheelPair
) -> PositionBinding:
    """Positions of as many wheels as the first message has that fits. Raises DoesNotServe."""
    left, right = _first_values(candidate, sides)
    if max(len(left), len(right)) > MOST_WHEELS:
        raise DoesNotServe(f"positions of {max(len(left), len(right))} wheels on one side")
    leaves = [leaf for column in (*left, *right) for leaf, _ in column.terms]
    ranges = {counter_range(leaf.dtype) for leaf in leaves}
    own = next(iter(ranges)) if len(ranges) == 1 else None
    turn = None
    if wanted.unit in TURN_UNITS:
        turn = TURN_UNITS["rev"] / TURN_UNITS[wanted.unit] / wanted.scale
    return PositionBinding(
        stamp_of(candidate),
        sides,
        (len(left), len(right)),
        wanted.gains(pair.radius_m),
        wanted.wraps_at or own,
        turn,
    )


def _first_values(candidate: Candidate, sides: Sides) -> Values:
    """The wheels' values in the first message that has them. Raises DoesNotServe."""
    problem = "its first messages hold no wheels"
    for sample in candidate.samples:
        try:
            return sides.values(candidate.definition.layout(sample.data))
        except (NotConcerned, Undecodable) as reason:
            problem = str(reason)
    raise DoesNotServe(problem)


def counter_range(dtype: str) -> float | None:
    """The range of an integer of up to 32 bits, after which a counter begins again; None for others."""
    try:
        kind = np.dtype(dtype)
    except TypeError:
        return None
    return float(2 ** (8 * kind.itemsize)) if kind.kind in "iu" and kind.itemsize <= 4 else None

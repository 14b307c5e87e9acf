"""Measured and commanded wheel speeds out of the messages in which robots record them.

A robot drives with wheel speeds that are known at every instant; each log holds them in another form, beside
a pose of another source. What is read has to be these speeds, whatever the form.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from mcap.writer import Writer

import wmr_replay as wr
from wmr_replay.cli.info import command as info
from wmr_replay.ingest import Between
from wmr_replay.ingest import open_log as open_reader
from wmr_replay.ingest.tracks import read_whole
from wmr_schemas import CommandTrack, Log, PoseTrack, RobotParameters, WheelSpeedTrack
from wmr_schemas.errors import ChannelNotFound, LogUnusable
from wmr_schemas.mapping_file import LogMapping, read_mapping
from wmr_schemas.wheel_fields import WheelSpeedFields
from wmr_synth import write_mcap

N, STEP_NS, T0 = 300, 20_000_000, 1_700_000_000_000_000_000
T_NS = T0 + np.arange(N) * STEP_NS
AT_S = (T_NS - T0) / 1e9
LEFT, RIGHT = 3 + np.sin(0.7 * AT_S), 3.5 + np.cos(0.9 * AT_S)
"""Wheel speeds in rad/s at the stamps."""
ANGLES = (3 * AT_S - np.cos(0.7 * AT_S) / 0.7 + 1.3, 3.5 * AT_S + np.sin(0.9 * AT_S) / 0.9)
"""Their integrals."""
R, L = 0.2, 0.3
ROBOT = RobotParameters(wheel_radius_m=R, half_track_m=L)
MAP = LogMapping(robot=ROBOT)
BAR = "=" * 80
POINT = (
    f"{BAR}\nMSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\n"
    f"float64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n"
    f"{BAR}\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"
)
INTERFACES = "string[] interface_names\nfloat64[] values\n"
ENCODERS = "std_msgs/Header header\nint16[] ticks\nint64 left\nint64 right\nfloat64[] erpm\n"
NO_POINT = {
    "positions": [],
    "velocities": [],
    "accelerations": [],
    "effort": [],
    "time_from_start": {"sec": 0, "nanosec": 0},
}


@pytest.fixture(scope="module")
def types(real_shapes):
    """Names and definitions of the messages."""
    header = real_shapes.HEADER
    stamped_twist = f"std_msgs/Header header\ngeometry_msgs/Twist twist\n{real_shapes.TWIST}{header}"
    pose = f"std_msgs/Header header\ngeometry_msgs/Pose pose\n{real_shapes.POSE}{header}"
    state = "JointTrajectoryPoint reference\ntrajectory_msgs/JointTrajectoryPoint feedback\n"
    return {
        "pose": ("geometry_msgs/msg/PoseStamped", pose),
        "joints": ("sensor_msgs/msg/JointState", real_shapes.JOINT_STATE),
        "odometry": ("nav_msgs/msg/Odometry", real_shapes.ODOMETRY),
        "twist": (
            "geometry_msgs/msg/Twist",
            f"geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n{real_shapes.VECTOR}",
        ),
        "stamped_twist": ("geometry_msgs/msg/TwistStamped", stamped_twist),
        "dynamic": (
            "control_msgs/msg/DynamicJointState",
            "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
            f"{BAR}\nMSG: control_msgs/InterfaceValue\n{INTERFACES}{header}",
        ),
        "controller": (
            "control_msgs/msg/JointTrajectoryControllerState",
            f"std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/{state}{POINT}{header}",
        ),
        "encoders": ("my_msgs/msg/Encoders", f"{ENCODERS}{header}"),
    }


@pytest.fixture(scope="module")
def write_log(types, real_shapes, tmp_path_factory):
    """``write_log({topic: (type, fields of row k)})``: a log of a pose at every stamp and these channels."""

    def write(channels: dict, pose: np.ndarray | None = None) -> Path:
        path = tmp_path_factory.mktemp("wheels") / "log.mcap"
        entries = []
        for k, t_ns in enumerate(T_NS.tolist()):
            x, y, yaw = (0.01 * k, 0.0, 0.001 * k) if pose is None else pose[:, k]
            place = {"position": real_shapes.vector(x, y), "orientation": real_shapes.turned(yaw)}
            entries.append((t_ns, "/mocap/pose", {"header": real_shapes.stamped(t_ns), "pose": place}))
            for topic, (_, fields) in channels.items():
                if (row := fields(k)) is not None:
                    entries.append((t_ns, topic, row))
        kinds = {"/mocap/pose": types["pose"]} | {topic: types[kind] for topic, (kind, _) in channels.items()}
        return real_shapes.write(path, kinds, entries)

    return write


@pytest.fixture(scope="module")
def rows(real_shapes):
    """Fields of row k of each form."""
    stamped, vector = real_shapes.stamped, real_shapes.vector

    def joints(names, velocity=(), position=(), effort=()):
        def fields(k):
            arrays = {"velocity": velocity, "position": position, "effort": effort}
            return {"header": stamped(T_NS[k]), "name": list(names)} | {
                name: [float(column[k]) for column in columns] for name, columns in arrays.items()
            }

        return fields

    def twist(v, turn):
        return lambda k: {"linear": vector(v[k]), "angular": vector(z=turn[k])}

    def stamped_twist(v, turn):
        return lambda k: {"header": stamped(T_NS[k]), "twist": twist(v, turn)(k)}

    def odometry(v, turn):
        def fields(k):
            pose = {"position": vector(), "orientation": real_shapes.turned(0.0)}
            return {
                "header": stamped(T_NS[k]),
                "child_frame_id": "base_link",
                "pose": {"pose": pose, "covariance": [0.0] * 36},
                "twist": {"twist": twist(v, turn)(k), "covariance": [0.0] * 36},
            }

        return fields

    return {"joints": joints, "twist": twist, "stamped_twist": stamped_twist, "odometry": odometry}


V, TURN = R * (LEFT + RIGHT) / 2, R * (RIGHT - LEFT) / (2 * L)
PAIR = ("left_wheel_joint", "right_wheel_joint")


def whole(path: Path, mapping: LogMapping = MAP, need="wheel_speed"):
    return read_whole(path, mapping, Between(), need=need)


def assert_speeds(track, left=LEFT, right=RIGHT, atol=1e-9, rows=slice(None)):
    """The track holds these speeds at the stamps of the log."""
    np.testing.assert_array_equal(track.t_ns, T_NS[rows])
    np.testing.assert_allclose(track.left_radps, left[rows], rtol=0, atol=atol)
    np.testing.assert_allclose(track.right_radps, right[rows], rtol=0, atol=atol)


def test_four_joints_without_efforts_are_averaged_by_side_and_no_torque_is_claimed(write_log, rows):
    names = ("front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel", "arm_joint")
    columns = (LEFT + 0.2, RIGHT - 0.1, LEFT - 0.2, RIGHT + 0.1, 0 * LEFT)
    log = write_log({"/joint_states": ("joints", rows["joints"](names, columns))})
    read = whole(log).log
    assert_speeds(read.wheels)
    assert (read.torque, read.commands) == (None, None)
    with pytest.raises(LogUnusable, match="no row has an effort for both wheels"):
        whole(log, need="torque")


def test_efforts_keep_their_road_and_give_the_wheel_speeds_too(write_log, rows):
    log = write_log({"/joint_states": ("joints", rows["joints"](PAIR, (LEFT, RIGHT), (), (LEFT, RIGHT)))})
    for need in ("torque", "wheel_speed"):
        read = whole(log, need=need).log
        np.testing.assert_array_equal(read.torque.right_nm, RIGHT)
        assert_speeds(read.wheels)
    info = wr.open_log(log).info()
    assert info.used["torque"] == info.used["wheel_speed"]
    assert info.used["command"] is None


def test_positions_of_joints_without_speeds_are_differences_stamped_in_the_middle(write_log, rows):
    log = write_log({"/joint_states": ("joints", rows["joints"](PAIR, (), ANGLES))})
    wheels = whole(log).log.wheels
    np.testing.assert_array_equal(wheels.t_ns, T_NS[1:] - STEP_NS // 2)
    middle_s = (wheels.t_ns - T0) / 1e9
    np.testing.assert_allclose(wheels.left_radps, 3 + np.sin(0.7 * middle_s), atol=1e-3)
    signals = wr.open_log(log).signals()
    np.testing.assert_array_equal(signals.wheels["t_ns"], T_NS[1:])
    info = wr.open_log(log).info()
    assert info.used["wheel_speed"]["read_as"] == "differences of positions"


def test_positions_that_are_kept_within_a_turn_are_unwrapped(write_log, rows):
    within = tuple(np.remainder(angle + np.pi, 2 * np.pi) - np.pi for angle in ANGLES)
    plain, wrapped = (
        whole(write_log({"/joint_states": ("joints", rows["joints"](PAIR, (), angles))})).log.wheels
        for angles in (ANGLES, within)
    )
    np.testing.assert_allclose(wrapped.left_radps, plain.left_radps, atol=1e-9)


def test_ticks_of_sixteen_bits_wrap_around_and_four_wheels_share_two_sides(write_log, real_shapes, tmp_path):
    ticks = np.floor(np.stack([ANGLES[0], ANGLES[1], ANGLES[0] + 1, ANGLES[1] + 2]) / (2 * np.pi) * 20480)
    wrapped = (np.remainder(ticks + 2**15, 2**16) - 2**15).astype(int)
    assert (np.abs(np.diff(wrapped, axis=1)) > 2**15).any()

    def encoders(k):
        counts = {"ticks": wrapped[:, k].tolist(), "left": int(ticks[0, k]), "right": int(ticks[1, k])}
        return {"header": real_shapes.stamped(T_NS[k]), "erpm": []} | counts

    log = write_log({"/encoders": ("encoders", encoders)})
    path = tmp_path / "robot.toml"
    fields = '[wheel_speeds]\ntopic = "/encoders"\nticks_per_rev = 20480\n'
    for left, right in (('"ticks[0]", "ticks[2]"', '"ticks[1]", "ticks[3]"'), ('"left"', '"right"')):
        path.write_text(f"{fields}left_fields = [{left}]\nright_fields = [{right}]\n")
        wheels = whole(log, read_mapping(path)).log.wheels
        middle_s = (wheels.t_ns - T0) / 1e9
        quantum = 2 * np.pi / 20480 / 0.02
        np.testing.assert_allclose(wheels.left_radps, 3 + np.sin(0.7 * middle_s), atol=1.1 * quantum)
        np.testing.assert_allclose(wheels.right_radps, 3.5 + np.cos(0.9 * middle_s), atol=1.1 * quantum)


def test_electrical_rpm_have_a_scale_a_unit_and_signs(write_log, real_shapes, tmp_path):
    pole_pairs, gear = 7, 20
    erpm = np.stack([LEFT, -RIGHT]) / (2 * np.pi) * 60 * gear * pole_pairs

    def motors(k):
        counts = {"ticks": [], "left": 0, "right": 0, "erpm": erpm[:, k].tolist()}
        return {"header": real_shapes.stamped(T_NS[k])} | counts

    log = write_log({"/motors": ("encoders", motors)})
    path = tmp_path / "robot.toml"
    path.write_text(
        '[wheel_speeds]\ntopic = "/motors"\nleft_fields = "erpm[0]"\nright_fields = "erpm[1]"\n'
        'right_sign = -1\nunit = "rpm"\nscale = 0.14285714285714285\ngear_ratio = 20\n'
    )
    assert_speeds(whole(log, read_mapping(path)).log.wheels)


def test_a_controllers_state_holds_speeds_and_commands_in_one_channel(write_log, real_shapes):
    def state(k):
        header = {"header": real_shapes.stamped(T_NS[k]), "joint_names": list(PAIR)}
        wanted = NO_POINT | {"velocities": [LEFT[k] + 1, RIGHT[k] + 2]}
        return header | {"reference": wanted, "feedback": NO_POINT | {"velocities": [LEFT[k], RIGHT[k]]}}

    log = write_log({"/wheels/state": ("controller", state)})
    read = whole(log, need="commands").log
    assert_speeds(read.wheels)
    assert_speeds(read.commands, LEFT + 1, RIGHT + 2)
    channel = wr.open_log(log).info().channels[-1]
    assert set(channel["serves_as"]) == {"wheel speed", "command"}


def test_interfaces_of_joints_hold_speeds_without_efforts(write_log, real_shapes):
    def state(k):
        values = [{"interface_names": ["position", "velocity"], "values": [0.0, c[k]]} for c in (RIGHT, LEFT)]
        return {
            "header": real_shapes.stamped(T_NS[k]),
            "joint_names": ["right_wheel_joint", "left_wheel_joint"],
            "interface_values": values,
        }

    assert_speeds(whole(write_log({"/dynamic_joint_states": ("dynamic", state)})).log.wheels)


def test_the_twist_of_wheel_odometry_becomes_wheel_speeds_by_the_robots_lengths(write_log, rows):
    log = write_log({"/diff_drive_controller/odom": ("odometry", rows["odometry"](V, TURN))})
    assert_speeds(whole(log).log.wheels)


def test_the_wheels_of_an_unknown_robot_are_made_up_and_said(write_log, rows):
    log = write_log({"/odom": ("odometry", rows["odometry"](V, TURN))})
    found = whole(log, LogMapping())
    made_up = found.log.robot
    assert (made_up.wheel_radius_m, made_up.half_track_m) == (1.0, 0.5)
    assert_speeds(found.log.wheels, V - TURN / 2, V + TURN / 2)
    assert any("wheel_radius_m 1, half_track_m 0.5, which is made up" in note for note in found.notes)


def test_joints_come_before_odometry_and_odometry_of_other_sources_is_left_alone(write_log, rows):
    both = {
        "/odom": ("odometry", rows["odometry"](9 * V, TURN)),
        "/joint_states": ("joints", rows["joints"](PAIR, (LEFT, RIGHT))),
    }
    assert_speeds(whole(write_log(both)).log.wheels)
    fused = write_log({"/odometry/filtered": ("odometry", rows["odometry"](V, TURN))})
    with pytest.raises(ChannelNotFound, match="a speed that is not of the wheels alone"):
        whole(fused)


def test_odometry_that_serves_as_the_pose_gives_no_wheel_speeds(real_shapes, rows, tmp_path):
    fields = rows["odometry"](V, TURN)
    entries = [(int(t_ns), "/odom", fields(k)) for k, t_ns in enumerate(T_NS)]
    kinds = {"/odom": ("nav_msgs/msg/Odometry", real_shapes.ODOMETRY)}
    log = real_shapes.write(tmp_path / "odometry.mcap", kinds, entries)
    with pytest.raises(ChannelNotFound, match="in use as pose"):
        whole(log)
    with pytest.raises(ChannelNotFound, match="in use as pose"):
        whole(log, replace(MAP, wheel_speed_topic="/odom"))


@pytest.mark.parametrize(("kind", "form"), [("twist", "twist"), ("stamped_twist", "stamped_twist")])
def test_a_commanded_twist_becomes_wheel_speeds_and_the_last_of_the_road_is_taken(
    kind, form, write_log, rows
):
    log = write_log({
        "/nav/cmd_vel": (kind, rows[form](3 * V, TURN)),
        "/cmd_vel": (kind, rows[form](V, TURN)),
        "/joint_states": ("joints", rows["joints"](PAIR, (LEFT - 1, RIGHT - 1))),
    })  # fmt: skip
    read = whole(log, need="commands").log
    assert_speeds(read.commands)
    assert_speeds(read.wheels, LEFT - 1, RIGHT - 1)
    signals, info = wr.open_log(log, mapping=MAP).signals(), wr.open_log(log).info()
    assert (info.used["command"]["topic"], info.used["command"]["read_as"]) == ("/cmd_vel", "from a twist")
    np.testing.assert_allclose(signals.commands["left_radps"], LEFT)
    np.testing.assert_allclose(signals.wheels["right_radps"], RIGHT - 1)


def test_info_names_both_and_writes_them_to_a_mapping(write_log, rows, tmp_path):
    log = write_log({
        "/odom": ("odometry", rows["odometry"](V, TURN)),
        "/cmd_vel": ("twist", rows["twist"](V, TURN)),
    })  # fmt: skip
    arguments = [str(log), "--write-map", str(tmp_path / "robot.toml")]
    said = CliRunner().invoke(info, arguments, catch_exceptions=False).output
    assert "wheels  /odom (from a twist): header stamp" in said
    assert "command /cmd_vel (from a twist): publish time (its messages carry no stamp)" in said
    assert "wheel_radius_m 1, half_track_m 0.5, which is made up" in said
    assert "wheel speeds /odom; commands /cmd_vel" in said
    mapping = read_mapping(tmp_path / "robot.toml")
    assert (mapping.wheel_speed_topic, mapping.wheel_speeds.linear) == ("/odom", "twist.twist.linear.x")
    assert (mapping.command_topic, mapping.commands.angular) == ("/cmd_vel", "angular.z")
    assert mapping.robot is None


def test_a_limited_command_comes_before_the_one_that_was_asked_for(write_log, rows):
    log = write_log({
        "/cmd_vel": ("stamped_twist", rows["stamped_twist"](3 * V, TURN)),
        "/base/cmd_vel_out": ("stamped_twist", rows["stamped_twist"](V, TURN)),
    })  # fmt: skip
    assert_speeds(whole(log, need="commands").log.commands)


def test_commands_of_made_up_wheels_stand_alone(write_log, rows):
    log = write_log({
        "/cmd_vel": ("stamped_twist", rows["stamped_twist"](V, TURN)),
        "/joint_states": ("joints", rows["joints"](PAIR, (LEFT, RIGHT))),
    })  # fmt: skip
    found = whole(log, LogMapping(), need="commands")
    assert found.log.wheels is None
    assert_speeds(found.log.commands, V - TURN / 2, V + TURN / 2)
    assert (found.log.robot.wheel_radius_m, found.log.robot.half_track_m) == (1.0, 0.5)
    measured = whole(log, LogMapping()).log
    assert measured.commands is None
    assert measured.robot.wheel_radius_m is None


def test_a_joint_states_commands_are_no_measured_speeds(write_log, rows):
    log = write_log({"/wheel_commands": ("joints", rows["joints"](PAIR, (LEFT, RIGHT)))})
    assert_speeds(whole(log, need="commands").log.commands)
    with pytest.raises(ChannelNotFound, match="by its topic commands"):
        whole(log)


def test_a_log_without_commands_says_what_there_is(write_log, rows):
    log = write_log({"/joint_states": ("joints", rows["joints"](PAIR, (LEFT, RIGHT)))})
    with pytest.raises(ChannelNotFound) as caught:
        whole(log, need="commands")
    assert "/joint_states" in str(caught.value)
    assert "[commands] of --map FILE" in str(caught.value)


def test_wheel_speeds_beside_torques_without_them_come_from_a_channel_of_their_own(write_log, rows):
    log = write_log({
        "/joint_states": ("joints", rows["joints"](PAIR, (), (), (LEFT, RIGHT))),
        "/wheels": ("joints", rows["joints"](PAIR, (LEFT, RIGHT))),
    })  # fmt: skip
    mapping = replace(MAP, wheel_speed_topic="/wheels")
    read = whole(log, mapping).log
    assert_speeds(read.wheels)
    np.testing.assert_array_equal(read.torque.left_nm, LEFT)
    assert np.isnan(read.torque.left_radps).all()
    assert_speeds(whole(log).log.wheels)


def test_commands_by_another_clock_are_left_out_and_said(write_log, rows, real_shapes):
    hour_ns = 3_600_000_000_000

    def late(k):
        return {"header": real_shapes.stamped(T_NS[k] + hour_ns), "twist": rows["twist"](V, TURN)(k)}

    log = write_log({
        "/cmd_vel": ("stamped_twist", late),
        "/joint_states": ("joints", rows["joints"](PAIR, (LEFT, RIGHT))),
    })  # fmt: skip
    assert whole(log).log.commands is None
    with pytest.raises(ChannelNotFound, match="seconds off the pose's"):
        whole(log, need="commands")


def test_a_log_in_json_and_what_is_hostile_in_it(tmp_path):
    path = tmp_path / "hostile.mcap"
    rng = np.random.default_rng(3)
    odd = [float("nan"), 1e308, -1e308, 1e13, None, "x", [], 2**63]
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        pose = writer.register_channel("/pose", "json", 0)
        wheels = writer.register_channel("/wheel_states", "json", 0)
        for k, t_ns in enumerate(T_NS.tolist()):
            stamp = {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}
            place = {
                "position": {"x": 0.01 * k, "y": 0, "z": 0},
                "orientation": {"x": 0, "y": 0, "z": 0, "w": 1},
            }
            message = json.dumps({"timestamp": stamp, "pose": place}).encode()
            writer.add_message(pose, t_ns, message, t_ns)
            values = [LEFT[k], RIGHT[k]]
            if k % 50 == 49:
                values[int(rng.integers(2))] = odd[(k // 50) % len(odd)]
            joints = {"timestamp": stamp, "name": list(PAIR), "velocity": values}
            writer.add_message(wheels, t_ns, json.dumps(joints).encode(), t_ns)
        writer.finish()
    track = whole(path).log.wheels
    known = np.isfinite(track.left_radps) & np.isfinite(track.right_radps)
    at = np.searchsorted(T_NS, track.t_ns[known])
    assert known.sum() == N - N // 50
    np.testing.assert_array_equal(track.left_radps[known], LEFT[at])


@pytest.mark.parametrize("encoding", ["ros2", "protobuf", "json"])
@pytest.mark.parametrize("commands_as", ["wheels", "twist"])
def test_every_encoding_gives_the_same(encoding, commands_as, tmp_path):
    pose = PoseTrack(T_NS, 0.1 * AT_S, 0 * AT_S, 0.1 * AT_S)
    wheels, commands = (
        WheelSpeedTrack(T_NS + 1000, LEFT, RIGHT),
        CommandTrack(T_NS[::5], RIGHT[::5], LEFT[::5]),
    )
    log = Log(pose, None, None, ROBOT, wheels, commands)
    write_mcap(log, tmp_path / "log.mcap", encoding=encoding, angles=ANGLES, commands_as=commands_as)
    read = whole(tmp_path / "log.mcap", LogMapping(), need="commands").log
    np.testing.assert_array_equal(read.wheels.t_ns, T_NS + 1000)
    np.testing.assert_array_equal(read.wheels.left_radps, LEFT)
    np.testing.assert_array_equal(read.commands.t_ns, T_NS[::5])
    np.testing.assert_allclose(read.commands.left_radps, RIGHT[::5], atol=1e-12)
    np.testing.assert_allclose(read.commands.right_radps, LEFT[::5], atol=1e-12)


def test_rim_speeds_of_unknown_wheels_are_those_of_wheels_of_one_metre(write_log, rows):
    log = write_log({"/joint_states": ("joints", rows["joints"](PAIR, (R * LEFT, R * RIGHT)))})
    mapping = replace(MAP, wheel_speeds=WheelSpeedFields(unit="m/s"))
    assert_speeds(whole(log, mapping).log.wheels)
    unknown = whole(log, replace(mapping, robot=None)).log
    assert_speeds(unknown.wheels, R * LEFT, R * RIGHT)
    assert (unknown.robot.wheel_radius_m, unknown.robot.half_track_m) == (1.0, None)


def test_a_message_of_countless_wheels_is_left_alone(write_log, rows):
    names = [f"{side}_wheel_{k}" for k in range(9) for side in ("left", "right")]
    log = write_log({"/joint_states": ("joints", rows["joints"](names, (), [ANGLES[0]] * 18))})
    with pytest.raises(LogUnusable, match="no row has a speed of both wheels"):
        whole(log)


def test_positions_that_jump_repeat_stamps_or_run_backwards_give_no_invented_speed(real_shapes):
    from wmr_replay.ingest.channels.position_steps import PositionSteps
    from wmr_replay.ingest.channels.wheel_bindings import FieldSides, PositionBinding

    binding = PositionBinding(None, FieldSides(("a",), ("b",)), (1, 1), (1.0, 1.0))
    t_ns = np.array([0, 1, 1, 3, 2, 4, 30]) * 100_000_000
    place = np.array([0.0, 0.1, 9.0, 0.5, 7.0, 0.6, 5.0])
    for cuts in ([], [1], [2, 3], [1, 2, 3, 4, 5, 6]):
        stage = PositionSteps(binding, 0)
        parts = np.split(np.arange(7), cuts)
        left, right = np.concatenate([stage.push(t_ns[p], np.stack([place[p], -place[p]])) for p in parts], 1)
        np.testing.assert_allclose(left, [np.nan, 1.0, 1.0, 2.0, np.nan, 1.0, np.nan])
        np.testing.assert_allclose(right, -left)


def test_keys_without_a_topic_are_heeded_beside_torques_too(write_log, rows):
    efforts = (LEFT, RIGHT)
    log = write_log({"/joint_states": ("joints", rows["joints"](PAIR, (LEFT, -RIGHT), (), efforts))})
    mapping = replace(MAP, wheel_speeds=WheelSpeedFields(right_sign=-1.0, unit="rpm", scale=30 / np.pi))
    for need in ("torque", "wheel_speed"):
        read = whole(log, mapping, need=need).log
        assert_speeds(read.wheels)
        np.testing.assert_array_equal(read.torque.left_nm, LEFT)
    with pytest.raises(ChannelNotFound, match="no field left"):
        whole(log, replace(MAP, wheel_speeds=WheelSpeedFields(left_fields=("left",), right_fields=("r",))))


@pytest.mark.parametrize(
    ("fields", "code"),
    [({}, None), ({"scale": 10.0}, "wheel_speed_unit"), ({"left_sign": -1.0}, "wheel_speed_sign")],
)
def test_units_and_signs_are_judged_whatever_the_source(fields, code, write_log, rows):
    path_m, yaw = np.cumsum(V) * STEP_NS / 1e9, np.cumsum(TURN) * STEP_NS / 1e9
    x, y = (np.cumsum(V * part(yaw)) * STEP_NS / 1e9 for part in (np.cos, np.sin))
    assert path_m[-1] > 3
    log = write_log(
        {"/joint_states": ("joints", rows["joints"](PAIR, (), ANGLES))}, pose=np.stack([x, y, yaw])
    )
    mapping = replace(MAP, wheel_speeds=WheelSpeedFields(unit="rad", **fields))
    found = {finding["code"] for finding in wr.open_log(log, mapping=mapping).info().findings}
    assert found - {"coloured_noise"} == ({code} if code else set())


def test_what_was_found_is_written_to_a_mapping_and_found_again_by_it(write_log, rows, real_shapes, tmp_path):
    def state(k):
        header = {"header": real_shapes.stamped(T_NS[k]), "joint_names": list(PAIR)}
        speeds = NO_POINT | {"velocities": [LEFT[k], RIGHT[k]]}
        return header | {"reference": speeds, "feedback": speeds}

    logs = (
        {"/joint_states": ("joints", rows["joints"](PAIR, (), ANGLES))},
        {"/odom": ("odometry", rows["odometry"](V, TURN)), "/cmd_vel": ("twist", rows["twist"](V, TURN))},
        {"/wheels/state": ("controller", state)},
    )
    for number, channels in enumerate(logs):
        log, path = write_log(channels), tmp_path / f"{number}.toml"
        opened = wr.open_log(log, mapping=MAP)
        opened.write_mapping(path)
        again = wr.open_log(log, mapping=path)
        assert again.mapping() == opened.mapping()
        assert again.signals().wheels.equals(opened.signals().wheels)
        assert again.signals().commands.equals(opened.signals().commands)
        assert len(opened.signals().wheels) >= N - 1


def test_a_replay_takes_wheel_speeds_and_leaves_commands_alone(write_log, rows):
    log = write_log({
        "/odom": ("odometry", rows["odometry"](V, TURN)),
        "/cmd_vel": ("twist", rows["twist"](V, TURN)),
    })  # fmt: skip
    (batch,) = open_reader(log, MAP).batches()
    np.testing.assert_allclose(batch.torque.values[2:], [LEFT, RIGHT])
    assert np.isnan(batch.torque.values[:2]).all()
    assert (len(batch.wheels), len(batch.command)) == (0, 0)

"""Messages of the canonical log: hand-written wire bytes, and decoding by independent libraries."""

import json
import struct

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given
from hypothesis import strategies as st
from mcap_ros2._dynamic import generate_dynamic

from wmr_schemas import ModeTrack, PoseTrack, TorqueTrack
from wmr_schemas.messages import jsonmsg, proto, ros2
from wmr_schemas.messages.codec import Codec, MessageSchema

SEC, NSEC = 1_700_000_000, 123_456_789
T_NS = np.array([SEC * 10**9 + NSEC, (SEC + 1) * 10**9], np.int64)
POSE = PoseTrack(T_NS, np.array([1.5, -2.0]), np.array([0.25, 1e-9]), np.array([0.0, 3.0]))
TORQUE = TorqueTrack(T_NS, *(np.array([k, -k - 0.5]) for k in (1.0, 2.0, 3.0, 4.0)))
ANGLES = (np.array([0.1, 0.2]), np.array([0.3, 0.4]))
MODE = ModeTrack(T_NS, np.array([0, 3], np.int8))
EFFORT_ONLY = TorqueTrack(T_NS, TORQUE.left_nm, TORQUE.right_nm, np.full(2, np.nan), np.full(2, np.nan))


def decode_ros2(schema: MessageSchema, data: bytes):
    decoder = generate_dynamic(schema.name, schema.definition.decode())[schema.name]
    return decoder(data)


def decode_protobuf(schema: MessageSchema, data: bytes):
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.definition)
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return kind.FromString(data)


def test_pose_stamped_is_cdr_to_the_byte():
    expected = b"\x00\x01\x00\x00" + struct.pack("<iII4s", SEC, NSEC, 4, b"map\0")
    expected += struct.pack("<7d", 1.5, 0.25, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert ros2.encode_pose(POSE)[0] == expected


def test_contact_mode_is_cdr_to_the_byte():
    assert ros2.encode_mode(MODE)[1] == b"\x00\x01\x00\x00" + struct.pack("<iIIBB", SEC + 1, 0, 1, 0, 3)


def test_joint_state_is_read_by_the_ros2_library():
    for row, data in enumerate(ros2.encode_torque(TORQUE, ANGLES)):
        message = decode_ros2(ros2.CODEC.torque, data)
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == T_NS[row]
        assert list(message.name) == ["left_wheel_joint", "right_wheel_joint"]
        assert list(message.position) == [ANGLES[0][row], ANGLES[1][row]]
        assert list(message.velocity) == [TORQUE.left_radps[row], TORQUE.right_radps[row]]
        assert list(message.effort) == [TORQUE.left_nm[row], TORQUE.right_nm[row]]


def test_pose_in_frame_is_read_by_the_protobuf_library():
    for row, data in enumerate(proto.encode_pose(POSE)):
        message = decode_protobuf(proto.CODEC.pose, data)
        assert message.timestamp.ToNanoseconds() == T_NS[row]
        assert message.frame_id == "map"
        assert (message.pose.position.x, message.pose.position.y) == (POSE.x_m[row], POSE.y_m[row])
        turn = 2 * np.arctan2(message.pose.orientation.z, message.pose.orientation.w)
        assert turn == pytest.approx(POSE.yaw_rad[row], abs=1e-15)


def test_joint_state_is_read_by_the_protobuf_library():
    for row, data in enumerate(proto.encode_torque(TORQUE, ANGLES)):
        message = decode_protobuf(proto.CODEC.torque, data)
        assert message.timestamp.ToNanoseconds() == T_NS[row]
        assert list(message.name) == ["left_wheel_joint", "right_wheel_joint"]
        assert list(message.position) == [ANGLES[0][row], ANGLES[1][row]]
        assert list(message.effort) == [TORQUE.left_nm[row], TORQUE.right_nm[row]]


def test_json_holds_numbers_exactly_and_the_foxglove_fields():
    message = json.loads(jsonmsg.encode_pose(POSE)[1])
    assert message["timestamp"] == {"sec": SEC + 1, "nsec": 0}
    assert message["pose"]["position"] == {"x": -2.0, "y": 1e-9, "z": 0.0}
    assert message["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": np.sin(1.5), "w": np.cos(1.5)}
    assert json.loads(jsonmsg.encode_torque(TORQUE, ANGLES)[0])["effort"] == [1.0, 2.0]


def test_unknown_wheel_signals_are_empty_arrays_in_every_encoding():
    cdr = decode_ros2(ros2.CODEC.torque, ros2.encode_torque(EFFORT_ONLY)[0])
    buffer = decode_protobuf(proto.CODEC.torque, proto.encode_torque(EFFORT_ONLY)[0])
    text = json.loads(jsonmsg.encode_torque(EFFORT_ONLY)[0])
    for message in (vars_of(cdr), vars_of(buffer), text):
        assert list(message["position"]) == []
        assert list(message["velocity"]) == []
        assert list(message["effort"]) == [1.0, 2.0]


def vars_of(message):
    return {name: getattr(message, name) for name in ("position", "velocity", "effort")}


def test_modes_arrive_in_every_encoding():
    assert [decode_ros2(ros2.CODEC.mode, data).mode for data in ros2.encode_mode(MODE)] == [0, 3]
    assert [decode_protobuf(proto.CODEC.mode, data).mode for data in proto.encode_mode(MODE)] == [0, 3]
    assert [json.loads(data)["mode"] for data in jsonmsg.encode_mode(MODE)] == [0, 3]


@pytest.mark.parametrize("codec", [ros2.CODEC, proto.CODEC, jsonmsg.CODEC], ids=lambda codec: codec.name)
def test_no_rows_make_no_messages(codec: Codec):
    none = np.empty(0)
    assert codec.encode_pose(PoseTrack(np.empty(0, np.int64), none, none, none)) == []


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(x=finite, y=finite, yaw=st.floats(-1e6, 1e6), t_ns=st.integers(0, 2**31 * 10**9 - 1))
def test_any_pose_survives_every_encoding(x, y, yaw, t_ns):
    pose = PoseTrack(np.array([t_ns]), np.array([x]), np.array([y]), np.array([yaw]))
    cdr = decode_ros2(ros2.CODEC.pose, ros2.encode_pose(pose)[0])
    buffer = decode_protobuf(proto.CODEC.pose, proto.encode_pose(pose)[0])
    text = json.loads(jsonmsg.encode_pose(pose)[0])
    assert (cdr.pose.position.x, cdr.pose.position.y) == (x, y)
    assert (buffer.pose.position.x, buffer.pose.position.y) == (x, y)
    assert (text["pose"]["position"]["x"], text["pose"]["position"]["y"]) == (x, y)
    assert cdr.header.stamp.sec * 10**9 + cdr.header.stamp.nanosec == t_ns
    assert buffer.timestamp.ToNanoseconds() == t_ns
    assert text["timestamp"]["sec"] * 10**9 + text["timestamp"]["nsec"] == t_ns

"""Hostile logs, one function a case: made up in the shapes that once crashed or hung the toolkit.

Most hold an ordinary pose and torque channel too, so that a tool that refuses the hostile channel still has a
log to read.
"""

import json
import struct
from collections.abc import Callable, Iterator

from container import T0_NS, channel, chunk, log, message, metadata, record, schema
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet

STEP_NS = 20_000_000
N = 300
POSE, JOINTS = "geometry_msgs/msg/PoseStamped", "sensor_msgs/msg/JointState"
RULE = "=" * 80
HEADER_TYPE = f"""{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
POSE_TYPE = f"""{RULE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{RULE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
POSE_FIELDS = "std_msgs/Header header\ngeometry_msgs/Pose pose\n"
POSE_DEFINITION = f"{POSE_FIELDS}{HEADER_TYPE}{POSE_TYPE}"
JOINT_DEFINITION = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{HEADER_TYPE}"""
ROBOT = {"alpha": "0.0255", "half_track_m": "1.0", "wheel_radius_m": "0.35"}
CASES: dict[str, Callable[[], bytes]] = {}


def case(function: Callable[[], bytes]) -> Callable[[], bytes]:
    """Enter a function among the cases."""
    CASES[function.__name__] = function
    return function


# Ordinary signals ----------------------------------------


def header(t_ns: int, frame: bytes = b"map") -> bytes:
    """A std_msgs/Header in CDR with its representation in front, padded to eight bytes of payload."""
    content = struct.pack("<iII", t_ns // 10**9, t_ns % 10**9, len(frame) + 1) + frame + b"\0"
    return b"\0\1\0\0" + content + bytes(-len(content) % 8)


def pose(k: int, x: float = 0.0, y: float = 0.0) -> bytes:
    """The k-th pose of a robot that drives ahead at 1 m/s."""
    t_ns = T0_NS + k * STEP_NS
    return header(t_ns) + struct.pack("<7d", x + k * 0.02, y, 0.0, 0.0, 0.0, 0.0, 1.0)


def joints(k: int, effort: float = 1.0) -> bytes:
    """The k-th joint state."""
    out = header(T0_NS + k * STEP_NS)[4:]
    names = (b"left_wheel_joint\0", b"right_wheel_joint\0")
    out += struct.pack("<I", 2)
    for name in names:
        out += bytes(-len(out) % 4) + struct.pack("<I", len(name)) + name
    for values in ((0.1 * k, 0.1 * k), (3.0, 3.0), (effort, 1.0)):
        out += bytes(-len(out) % 4) + struct.pack("<I", 2)
        out += bytes(-len(out) % 8) + struct.pack("<2d", *values)
    return b"\0\1\0\0" + out


def signals(
    poses: dict[int, bytes] | None = None, states: dict[int, bytes] | None = None, robot: dict | None = None
) -> Iterator[bytes]:
    """The records of an ordinary log; ``poses`` and ``states`` stand in for the messages of these numbers."""
    yield metadata("wmr_replay", ROBOT if robot is None else robot)
    records = [
        schema(1, POSE, "ros2msg", POSE_DEFINITION.encode()),
        schema(2, JOINTS, "ros2msg", JOINT_DEFINITION.encode()),
        channel(1, 1, "/pose", "cdr"),
        channel(2, 2, "/wheel_torques", "cdr"),
    ]
    for k in range(N):
        t_ns = T0_NS + k * STEP_NS
        records.append(message(1, t_ns, (poses or {}).get(k, pose(k))))
        records.append(message(2, t_ns, (states or {}).get(k, joints(k))))
    yield chunk(b"".join(records))


@case
def clean() -> bytes:
    """No fault at all: what the others are compared with."""
    return log(*signals())


# Numbers without a meaning ----------------------------------------


def _effort(value: float, at: int = 150) -> bytes:
    return log(*signals(states={at: joints(at, value)}))


def _position(value: float, at: int = 150) -> bytes:
    return log(*signals(poses={at: pose(at, value)}))


for _name, _value in (("1e200", 1e200), ("1e300", 1e300), ("infinite", float("inf")), ("1e9", 1e9)):
    CASES[f"effort_{_name}"] = lambda value=_value: _effort(value)
    CASES[f"efforts_{_name}"] = lambda value=_value: log(
        *signals(states={k: joints(k, value) for k in range(N)})
    )
for _name, _value in (("1p7e308", 1.7e308), ("1e200", 1e200), ("1e30", 1e30), ("1e12", 1e12)):
    CASES[f"position_{_name}"] = lambda value=_value: _position(value)
    CASES[f"positions_{_name}"] = lambda value=_value: log(
        *signals(poses={k: pose(k, value * (-1) ** k) for k in range(N)})
    )
    CASES[f"first_position_{_name}"] = lambda value=_value: _position(value, 1)


for _key in ("alpha", "half_track_m", "average_speed_mps"):
    for _value in (
        "nan",
        "1e-320",
        "1e-200",
        "1e200",
        "1e308",
        "inf",
        "-1",
        "0",
        "0x1",
        "auto",
        "\x00",
        "1" * 400,
    ):
        CASES[f"metadata_{_key}_{_value[:8].strip(chr(0)) or 'nul'}"] = lambda key=_key, value=_value: log(
            *signals(robot={**ROBOT, key: value})
        )
for _key in ROBOT:
    CASES[f"metadata_without_{_key}"] = lambda key=_key: log(
        *signals(robot={k: v for k, v in ROBOT.items() if k != key})
    )
CASES["metadata_not_utf8"] = lambda: log(*signals(robot={"alpha": b"0.02\xff5", "half_track_m": "1.0"}))


@case
def stamps_at_the_ends_of_time() -> bytes:
    """Stamps of −2³¹ s and 2³¹ s, log times of 0 and 2⁶⁴ − 1."""
    far = [
        b"\0\1\0\0" + struct.pack("<iI", sec, 10**9 - 1) + pose(k)[12:]
        for k, sec in ((50, -(1 << 31)), (51, (1 << 31) - 1))
    ]
    late = message(1, (1 << 64) - 1, pose(60)) + message(1, 0, pose(61)) + message(2, 1 << 63, joints(61))
    return log(*signals(poses={50: far[0], 51: far[1]}), chunk(late))


CASES |= {
    "records_of_no_type": lambda: log(*signals(), record(0x81, b"") * 700_000),
    "records_of_indexes": lambda: log(*signals(), record(7, bytes(6)) * 700_000),
}


# JSON ----------------------------------------


def json_pose(k: int, frame: bytes = b"map") -> bytes:
    """The k-th pose as JSON."""
    t_ns = T0_NS + k * STEP_NS
    content = {
        "header": {"stamp": {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}, "frame_id": "FRAME"},
        "pose": {
            "position": {"x": 0.02 * k, "y": 0.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    return json.dumps(content).encode().replace(b"FRAME", frame)


def json_log(messages: dict[int, bytes], n: int = N) -> bytes:
    """Poses in JSON, some of them replaced."""
    records = [schema(1, POSE, "", b""), channel(1, 1, "/pose", "json")]
    records += [message(1, T0_NS + k * STEP_NS, messages.get(k, json_pose(k))) for k in range(n)]
    return log(metadata("wmr_replay", ROBOT), chunk(b"".join(records)))


CASES |= {
    "json_text_not_utf8": lambda: json_log({9: json_pose(9, b"\xff\xfe"), 150: json_pose(150, b"m\xc3p")}),
    "json_key_not_utf8": lambda: json_log({150: json_pose(150).replace(b"header", b"he\xe9der")}),
    "json_utf16_bom": lambda: json_log({150: b"\xff\xfe{\0", 151: b"\xfe\xff\0{", 152: b"\xef\xbb\xbf{}"}),
    "json_never_utf8": lambda: json_log({k: json_pose(k, b"\xff") for k in range(N)}),
    "json_nested": lambda: json_log({0: b"[" * 100_000, 150: b'{"a":' * 100_000, 151: b'{"a":[' * 90 + b"1"}),
    "json_nested_well": lambda: json_log(
        {k: json_pose(k)[:-1] + b', "a":' + b"[" * d + b"]" * d + b"}" for k, d in ((0, 300), (150, 900))}
    ),
    "json_long_array": lambda: json_log(
        {k: json_pose(k)[:-1] + b', "a":[' + b"0," * 1_000_000 + b"0]}" for k in range(30)}
    ),
    "json_long_number": lambda: json_log(
        {150: json_pose(150).replace(b'"y": 0.0', b'"y": ' + b"9" * 1_000_000)}
    ),
    "json_numbers_of_many_digits": lambda: json_log(
        {k: json_pose(k).replace(b'"sec": 17', b'"sec": ' + b"9" * 5000) for k in range(N)}
    ),
    "json_every_message_another_key": lambda: json_log(
        {k: json_pose(k)[:-1] + b', "k%d": 1}' % k for k in range(20_000)}, 20_000
    ),
    "json_empty_messages": lambda: log(
        *signals(),
        chunk(schema(7, POSE, "", b"") + channel(7, 7, "/p", "json") + message(7, T0_NS, b"") * 1_000_000),
    ),
}


# Definitions ----------------------------------------


def with_channel(
    definition: str | bytes,
    data: bytes,
    *,
    encoding: str = "ros2msg",
    how: str = "cdr",
    name: str = POSE,
    n: int = 3,
) -> bytes:
    """An ordinary log beside a channel of that definition with ``n`` equal messages."""
    raw = definition if isinstance(definition, bytes) else definition.encode()
    records = schema(7, name, encoding, raw) + channel(7, 7, "/hostile_pose", how)
    return log(*signals(), chunk(records + message(7, T0_NS, data) * n))


def laughing(depth: int, width: int, leaf: str, plural: str = "") -> str:
    """A pose with a field of types nested ``depth`` deep, each with ``width`` fields of the next."""
    out = f"std_msgs/Header header\ngeometry_msgs/Pose pose\nlol/L0{plural} laugh\n{HEADER_TYPE}{POSE_TYPE}"
    for level in range(depth):
        inner = f"lol/L{level + 1}{plural}" if level + 1 < depth else leaf
        fields = "".join(f"{inner} f{k}\n" for k in range(width))
        out += f"{RULE}\nMSG: lol/L{level}\n{fields}"
    return out


def arrays_of_arrays(fields: str) -> str:
    """A pose behind an array of arrays of arrays of structs with these fields, which take no bytes."""
    out = f"a/A[] a\n{POSE_FIELDS}{HEADER_TYPE}{POSE_TYPE}"
    for outer, inner in (("A", "B"), ("B", "C"), ("C", "D")):
        out += f"{RULE}\nMSG: a/{outer}\na/{inner}[90] x\n"
    return f"{out}{RULE}\nMSG: a/D\n{fields}"


CASES |= {
    "laughing_5_10_numbers": lambda: with_channel(laughing(5, 10, "uint8"), pose(0) + bytes(200_000)),
    "laughing_5_10_short": lambda: with_channel(laughing(5, 10, "uint8"), pose(0)),
    "laughing_5_10_arrays": lambda: with_channel(laughing(5, 10, "uint8[0]"), pose(0) + bytes(100)),
    "laughing_5_10_sequences": lambda: with_channel(laughing(5, 10, "uint8", "[]"), pose(0) + bytes(10_000)),
    "laughing_20_10": lambda: with_channel(laughing(20, 10, "uint8"), pose(0)),
    "laughing_20_10_wide": lambda: with_channel(laughing(20, 10, "wstring"), pose(0)),
    "laughing_ros1": lambda: with_channel(
        laughing(9, 10, "uint8"), pose(0)[4:], encoding="ros1msg", how="ros1"
    ),
    "nested_900": lambda: with_channel(laughing(900, 1, "uint8"), pose(0) + bytes(8)),
    "nested_900_ros1": lambda: with_channel(
        laughing(900, 1, "uint8"), pose(0)[4:] + bytes(8), encoding="ros1msg", how="ros1"
    ),
    "nested_20000": lambda: with_channel(laughing(20_000, 1, "uint8"), pose(0) + bytes(8)),
    "nested_in_itself": lambda: with_channel(
        f"{POSE_FIELDS}a/B[] b\n{HEADER_TYPE}{POSE_TYPE}{RULE}\nMSG: a/B\na/B[] b\n", pose(0) + bytes(100)
    ),
    "definition_of_a_megabyte": lambda: with_channel(POSE_DEFINITION + "# x\n" * 250_000, pose(0)),
    "definition_of_many_fields": lambda: with_channel(
        POSE_DEFINITION + f"{RULE}\nMSG: a/B\n" + "".join(f"uint8 f{k}\n" for k in range(100_000)), pose(0)
    ),
    "definition_of_many_types": lambda: with_channel(
        POSE_DEFINITION + "".join(f"{RULE}\nMSG: a/B{k}\nuint8 f\n" for k in range(30_000)), pose(0)
    ),
    "definition_array_of_absurd_size": lambda: with_channel(
        "std_msgs/Header header\ngeometry_msgs/Pose pose\nuint8[99999999999999999999] a\n"
        + HEADER_TYPE
        + POSE_TYPE,
        pose(0) + bytes(100),
    ),
    "definition_open_brackets": lambda: with_channel("uint8[" * 10_000, pose(0)),
    "idl_open_comments": lambda: with_channel("/*" * 20_000, pose(0), encoding="ros2idl"),
    "idl_nested_modules": lambda: with_channel(
        "module a { " * 2_000 + "};" * 2_000, pose(0), encoding="ros2idl"
    ),
    "idl_long_expression": lambda: with_channel(
        "module a { const long X = " + "(" * 5_000 + "1" + ")" * 5_000 + "; };", pose(0), encoding="ros2idl"
    ),
    "empty_structs_ros1": lambda: with_channel(
        arrays_of_arrays(""), struct.pack("<I", 90) + bytes(180), encoding="ros1msg", how="ros1"
    ),
    "empty_structs_cdr": lambda: with_channel(
        arrays_of_arrays("uint8[0] e\n"), b"\0\1\0\0" + struct.pack("<I", 90) + bytes(180)
    ),
    "empty_structs_cdr_flat": lambda: with_channel(
        f"a/A[] a\n{POSE_FIELDS}{HEADER_TYPE}{POSE_TYPE}{RULE}\nMSG: a/A\nuint8[0] e\n",
        b"\0\1\0\0" + struct.pack("<I", 5_000_000) + bytes(5_000_010),
        n=20,
    ),
}


# Messages that unfold ----------------------------------------


def _many_poses(count: int) -> bytes:
    definition = (
        f"a/S[] poses\n{POSE_FIELDS}{HEADER_TYPE}{POSE_TYPE}{RULE}\nMSG: a/S\ngeometry_msgs/Pose pose\n"
    )
    data = b"\0\1\0\0" + struct.pack("<I", count) + bytes(4) + bytes(56 * count) + pose(0)[4:]
    return with_channel(definition, data, n=1)


def _transforms(count: int) -> bytes:
    definition = (
        f"geometry_msgs/TransformStamped[] transforms\n{RULE}\nMSG: geometry_msgs/TransformStamped\n"
        f"std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n{RULE}\n"
        "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
        f"{RULE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n{HEADER_TYPE}{POSE_TYPE}"
    )
    one = struct.pack("<iII4sI4s7d", 0, 0, 1, bytes(4), 1, bytes(4), *[0.0] * 7)
    return with_channel(
        definition, b"\0\1\0\0" + struct.pack("<I", count) + one * count, n=1, name="tf2_msgs/msg/TFMessage"
    )


def _names(count: int) -> bytes:
    """A joint state of so many joints, again and again."""
    data = header(T0_NS) + struct.pack("<I", count) + struct.pack("<II", 1, 0) * count
    records = schema(7, JOINTS, "ros2msg", JOINT_DEFINITION.encode()) + channel(7, 7, "/joints", "cdr")
    return log(*signals(), chunk(records + message(7, T0_NS, data + bytes(16)) * 3))


def _always_another_length(n: int, extra: int) -> bytes:
    """Every pose has a frame of another length: a layout for each."""
    records = [schema(1, POSE, "ros2msg", POSE_DEFINITION.encode()), channel(1, 1, "/pose", "cdr")]
    for k in range(n):
        t_ns = T0_NS + k * STEP_NS
        data = header(t_ns, b"m" * (k % extra)) + struct.pack("<7d", k * 0.02, 0, 0, 0, 0, 0, 1)
        records.append(message(1, t_ns, data))
    return log(metadata("wmr_replay", ROBOT), chunk(b"".join(records)))


def _layouts_of_many_fields(n: int, count: int) -> bytes:
    """The channel in use has a long array beside the pose, of another length each time."""
    definition = f"std_msgs/Header header\ngeometry_msgs/Pose pose\nstring[] more\n{HEADER_TYPE}{POSE_TYPE}"
    records = [schema(1, POSE, "ros2msg", definition.encode()), channel(1, 1, "/pose", "cdr")]
    for k in range(n):
        more = count - k % 500 if k > 40 else 0
        records.append(message(1, T0_NS + k * STEP_NS, pose(k) + struct.pack("<I", more) + bytes(4 * more)))
    return log(metadata("wmr_replay", ROBOT), chunk(b"".join(records)))


def _undecodable(n: int) -> bytes:
    """So many messages of the pose's channel that are none."""
    return log(*signals(), chunk(message(1, T0_NS, b"\0\1\0\0") * n))


def _empty_messages(how: str, encoding: str, definition: bytes, n: int = 1_000_000) -> bytes:
    records = schema(7, POSE, encoding, definition) + channel(7, 7, "/p", how)
    return log(*signals(), chunk(records + message(7, T0_NS, b"") * n))


def _empty_in_use(n: int = 1_000_000) -> bytes:
    """Empty messages on the pose's own channel."""
    return log(*signals(), chunk(message(1, T0_NS, b"") * n))


def _many_good(n: int) -> bytes:
    """The same good pose so many times: one stamp."""
    return log(*signals(), chunk(message(1, T0_NS + N * STEP_NS, pose(N)) * n))


CASES |= {
    "million_poses": lambda: _many_poses(1_000_000),
    "million_poses_in_part": lambda: _many_poses(70_000),
    "million_transforms": lambda: _transforms(600_000),
    "million_joint_names": lambda: _names(2_000_000),
    "always_another_length": lambda: _always_another_length(40_000, 1_000),
    "layouts_of_many_fields": lambda: _layouts_of_many_fields(2_000, 4_000),
    "undecodable_messages": lambda: _undecodable(1_000_000),
    "empty_messages_cdr": lambda: _empty_messages("cdr", "ros2msg", POSE_DEFINITION.encode()),
    "empty_messages_ros1": lambda: _empty_messages("ros1", "ros1msg", POSE_DEFINITION.encode()),
    "empty_messages_protobuf": lambda: _empty_messages("protobuf", "protobuf", b""),
    "empty_messages_in_use": _empty_in_use,
    "million_equal_poses": lambda: _many_good(400_000),
}


# Containers that unfold ----------------------------------------

MIB = 1 << 20
CASES |= {
    "zeros_256_mib_zstd": lambda: log(*signals(), chunk(bytes(256 * MIB))),
    "zeros_256_mib_lz4": lambda: log(*signals(), chunk(bytes(256 * MIB), "lz4")),
    "zeros_60_mib_30_times": lambda: log(*signals(), *[chunk(bytes(60 * MIB))] * 30),
    "message_of_256_mib": lambda: log(*signals(), chunk(message(1, T0_NS, bytes(256 * MIB)))),
    "large_messages_of_many_channels": lambda: log(
        *signals(),
        *[
            chunk(channel(k, 0, f"/p{k}", "json") + message(k, T0_NS, bytes(30 * MIB)) * 2)
            for k in range(10, 30)
        ],
    ),
    "large_schemas": lambda: log(
        *signals(), *[chunk(schema(k, "", "", bytes(60 * MIB))) for k in range(10, 30)]
    ),
    "message_of_60_mib": lambda: log(*signals(), chunk(message(1, T0_NS, bytes(60 * MIB)))),
    "descriptions_again_and_again": lambda: log(*signals(), chunk(channel(1, 1, "/pose", "cdr") * 1_500_000)),
    "schemas_again_and_again": lambda: log(*signals(), chunk(schema(9, "", "", b"") * 2_000_000)),
    "malformed_descriptions": lambda: log(
        *signals(), chunk((b"\4" + struct.pack("<Q", 1) + b"\0") * 5_000_000)
    ),
    "short_messages": lambda: log(*signals(), chunk((b"\5" + bytes(8)) * 6_000_000)),
    "plain_malformed_descriptions": lambda: log(*signals(), (b"\4" + bytes(8)) * 300_000),
    "many_channels": lambda: log(
        *signals(),
        chunk(
            b"".join(
                schema(k, POSE, "ros2msg", (POSE_DEFINITION + f"# {k}\n").encode())
                + channel(k, k, f"/p{k}", "cdr")
                + message(k, T0_NS, pose(0))
                for k in range(10, 8_010)
            )
        ),
    ),
    "many_channels_of_many_types": lambda: log(
        *signals(),
        chunk(
            b"".join(
                schema(k, POSE, "ros2msg", (POSE_DEFINITION + f"uint8 X={k}\n").encode())
                + channel(k, k, f"/p{k}", "cdr")
                + message(k, T0_NS, pose(0))
                for k in range(10, 8_010)
            )
        ),
    ),
    "many_channels_without_schema": lambda: log(
        *signals(),
        chunk(
            b"".join(
                channel(k, 0, "/p", "json") + message(k, T0_NS, b'{"effort": [], "name": []}')
                for k in range(10, 30_010)
            )
        ),
    ),
    "many_chunks": lambda: log(*signals(), *[chunk(b"", "")] * 20_000),
    "metadata_again_and_again": lambda: log(*signals(), *[metadata("wmr_replay", {"alpha": "1"})] * 30_000),
    "metadata_of_many_keys": lambda: log(*signals(robot={f"k{k}": "" for k in range(200_000)} | ROBOT)),
}


# Protobuf ----------------------------------------


def proto_pose(depth: int = 0, *extra: FieldDescriptorProto) -> bytes:
    """A FileDescriptorSet of a pose, with a message that contains itself and further fields."""
    kind = FieldDescriptorProto
    file = FileDescriptorProto(name="p.proto", package="made", syntax="proto3")

    def add(name: str, *fields: tuple[str, int, int, int, str]) -> None:
        entry = file.message_type.add(name=name)
        for label, number, type_, repeated, type_name in fields:
            field = entry.field.add(name=label, number=number, type=type_, label=repeated)
            if type_name:
                field.type_name = type_name

    one, many, double, message_type = 1, 3, kind.TYPE_DOUBLE, kind.TYPE_MESSAGE
    add("V", *((axis, k + 1, double, one, "") for k, axis in enumerate("xyzw")))
    add("P", ("position", 1, message_type, one, ".made.V"), ("orientation", 2, message_type, one, ".made.V"))
    add(
        "PoseStamped",
        ("pose", 1, message_type, one, ".made.P"),
        ("self", 2, message_type, many, ".made.PoseStamped"),
        ("packed", 3, double, many, ""),
        ("varints", 4, kind.TYPE_UINT64, many, ""),
        ("texts", 5, kind.TYPE_STRING, many, ""),
    )
    return FileDescriptorSet(file=[file]).SerializeToString()


def sized(tag: int, content: bytes) -> bytes:
    """A protobuf field with a length."""
    return bytes([tag << 3 | 2]) + varint(len(content)) + content


def varint(value: int) -> bytes:
    """Base 128, least significant group first."""
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes(out) + bytes([value])


def proto_log(data: bytes, n: int = 3) -> bytes:
    """An ordinary log beside a protobuf channel."""
    return with_channel(proto_pose(), data, encoding="protobuf", how="protobuf", name="made.PoseStamped", n=n)


def _proto_nested(depth: int) -> bytes:
    data = b""
    for _ in range(depth):
        data = sized(2, data)
    return data


def _proto_chain(n: int) -> bytes:
    """Files that depend on each other in a chain."""
    files = [
        FileDescriptorProto(name=f"f{k}", dependency=[f"f{k + 1}"] if k + 1 < n else []) for k in range(n)
    ]
    return FileDescriptorSet(file=files).SerializeToString()


CASES |= {
    "protobuf_nested": lambda: proto_log(_proto_nested(5_000)),
    "protobuf_packed_numbers": lambda: proto_log(sized(3, bytes(4_000_000))),
    "protobuf_varints": lambda: proto_log(sized(4, bytes(5_000_000))),
    "protobuf_texts": lambda: proto_log(sized(5, b"") * 1_000_000),
    "protobuf_empty_selves": lambda: proto_log(sized(2, b"") * 2_000_000),
    "protobuf_chain_of_files": lambda: with_channel(
        _proto_chain(3_000), b"", encoding="protobuf", how="protobuf", name="made.PoseStamped"
    ),
    "protobuf_descriptor_damaged": lambda: with_channel(
        proto_pose()[:-40] + bytes(40), b"", encoding="protobuf", how="protobuf", name="made.PoseStamped"
    ),
}

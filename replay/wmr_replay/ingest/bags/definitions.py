"""Definitions of ROS 2 messages for bags that hold none, as those written before ROS 2 Iron."""

from functools import lru_cache

from wmr_replay.ingest.mcap.records import Schema
from wmr_schemas.messages import ros2

_SEPARATOR = "=" * 80
_DYNAMIC_JOINT_STATE = f"""\
std_msgs/Header header
string[] joint_names
control_msgs/InterfaceValue[] interface_values
{_SEPARATOR}
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_OWN = {
    "control_msgs/msg/DynamicJointState": _DYNAMIC_JOINT_STATE.encode(),
    ros2.CODEC.mode.name: ros2.CODEC.mode.definition,
}


def standard_schema(schema_id: int, name: str) -> Schema:
    """The schema of a type as ROS 2 Humble defines it, the last release whose bags hold no definitions.

    The schema of any other type has no encoding: its channels serve for nothing.
    """
    text = _OWN.get(name) or _of_humble(name)
    return Schema(schema_id, name, "ros2msg" if text else "", text)


@lru_cache(maxsize=256)
def _of_humble(name: str) -> bytes:
    """The definition in ``ros2msg``; empty for a type that is not among ROS's own."""
    from rosbags.typesys import Stores, TypesysError, get_typestore  # noqa: PLC0415 – takes a third of a second

    try:
        return get_typestore(Stores.ROS2_HUMBLE).generate_msgdef(name, ros_version=2)[0].encode()
    except (TypesysError, KeyError):
        return b""

"""Writes the messages of a canonical log (ROS 2, MCAP) into ROS bags, with rosbags' writers."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

MODE = "wmr_msgs/msg/ContactMode"


def messages(log: Path) -> Iterator[tuple[str, str, str, int, bytes]]:
    """Topic, type, definition, log time and data of the log's messages in the file's order."""
    with log.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            assert schema is not None
            yield channel.topic, schema.name, schema.data.decode(), message.log_time, message.data


def store(kind: Stores, log: Path) -> Typestore:
    """The standard types, and those of the log that are none."""
    types = get_typestore(kind)
    for _, name, text, _, _ in messages(log):
        if name not in types.fielddefs:
            types.register({name: get_types_from_msg(text, name)[name]})
    return types


def as_ros2(log: Path, folder: Path, *, compression: tuple[Any, Any] | None = None) -> Path:
    """The log as a rosbag2 directory with one ``.db3``."""
    types, connections = store(Stores.ROS2_HUMBLE, log), {}
    writer = Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3)
    if compression:
        writer.set_compression(*compression)
    with writer:
        for topic, name, _, log_ns, data in messages(log):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=types)
            writer.write(connections[topic], log_ns, data)
    return folder


def as_ros1(log: Path, path: Path, *, compression: Any = None, chunk_bytes: int = 1 << 16) -> Path:
    """The log as a ROS 1 bag; every other message of a topic comes from a second publisher."""
    theirs, types = store(Stores.ROS2_HUMBLE, log), store(Stores.ROS1_NOETIC, log)
    connections: dict[tuple[str, int], Any] = {}
    writer = Ros1Writer(path)
    writer.chunk_threshold = chunk_bytes
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        for k, (topic, name, _, log_ns, data) in enumerate(messages(log)):
            key = topic, k % 2
            if key not in connections:
                connections[key] = writer.add_connection(
                    topic, name, typestore=types, callerid=f"/node{k % 2}"
                )
            writer.write(connections[key], log_ns, ros1_message(theirs, types, name, data))
    return path


def ros1_message(theirs: Typestore, types: Typestore, name: str, data: bytes) -> bytes:
    """A CDR message in ROS 1's wire form, whose header has a number more."""
    message = theirs.deserialize_cdr(data, name)
    if hasattr(message, "header"):
        kinds, head = types.types, message.header
        stamp = kinds["builtin_interfaces/msg/Time"](head.stamp.sec, head.stamp.nanosec)
        object.__setattr__(message, "header", kinds["std_msgs/msg/Header"](0, stamp, head.frame_id))
    return bytes(types.serialize_ros1(message, name))

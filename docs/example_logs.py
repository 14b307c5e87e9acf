"""Logs that pages speak of: ``python docs/example_logs.py FOLDER``, for ``docs/run_commands.py``.

``my_robot.mcap`` has a pose on /vicon/pose, the same as transforms from map to base_link on /tf, and the
efforts of four wheels on /joint_states, or of those that ``--wheels`` names. ``drive.csv`` has poses
and wheel speeds as columns.
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from heapq import merge
from operator import itemgetter
from pathlib import Path

import numpy as np
from mcap_ros2.writer import Writer

import wmr_replay as wr
from wmr_schemas.signals import Log


def definition(*parts: str) -> str:
    """A message definition of ROS 2: its own fields, then each type that it uses, by name and fields."""
    return f"\n{80 * '='}\nMSG: ".join(parts)


HEADER = (
    "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
    "builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
)
XYZ = "float64 x\nfloat64 y\nfloat64 z"
QUATERNION = f"geometry_msgs/Quaternion\n{XYZ}\nfloat64 w"
DEFINITIONS = {
    "geometry_msgs/PoseStamped": definition(
        "std_msgs/Header header\ngeometry_msgs/Pose pose",
        "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
        f"geometry_msgs/Point\n{XYZ}",
        QUATERNION,
        *HEADER,
    ),
    "sensor_msgs/JointState": definition(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
        *HEADER,
    ),
    "tf2_msgs/TFMessage": definition(
        "geometry_msgs/TransformStamped[] transforms",
        "geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
        "geometry_msgs/Transform transform",
        "geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
        f"geometry_msgs/Vector3\n{XYZ}",
        QUATERNION,
        *HEADER,
    ),
}
WHEELS = ("wheel_fl", "wheel_rl", "wheel_fr", "wheel_rr")


def header(t_ns: int, frame: str) -> dict[str, object]:
    """A header's stamp and frame."""
    return {"stamp": {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}, "frame_id": frame}


def pose_messages(log: Log) -> Iterator[tuple[int, str, str, dict[str, object]]]:
    """Each pose as a message and as a transform: stamp, topic, type, content."""
    pose = log.pose
    for t, x, y, yaw in zip(pose.t_ns.tolist(), pose.x_m, pose.y_m, pose.yaw_rad, strict=True):
        place = {"x": float(x), "y": float(y), "z": 0.0}
        turn = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
        moved = {"translation": place, "rotation": turn}
        link = {"header": header(t, "map"), "child_frame_id": "base_link", "transform": moved}
        seen = {"header": header(t, "map"), "pose": {"position": place, "orientation": turn}}
        yield t, "/vicon/pose", "geometry_msgs/PoseStamped", seen
        yield t, "/tf", "tf2_msgs/TFMessage", {"transforms": [link]}


def joint_messages(log: Log, wheels_of: Sequence[str]) -> Iterator[tuple[int, str, str, dict[str, object]]]:
    """Efforts and speeds of the wheels, the left ones first; the wheels of a side share its torque."""
    assert log.torque is not None
    wheels = log.torque
    columns = [wheels.left_nm, wheels.right_nm, wheels.left_radps, wheels.right_radps]
    for t, *values in zip(wheels.t_ns.tolist(), *columns, strict=True):
        left, right, left_radps, right_radps = map(float, values)
        state = {"header": header(t, ""), "name": list(wheels_of), "position": []}
        each = len(wheels_of) // 2
        speeds = [left_radps] * each + [right_radps] * each
        efforts = [left / each] * each + [right / each] * each
        yield t, "/joint_states", "sensor_msgs/JointState", state | {"velocity": speeds, "effort": efforts}


def write_robot(log: Log, path: Path, wheels: Sequence[str]) -> None:
    """``my_robot.mcap``."""
    with path.open("wb") as file:
        writer = Writer(file)
        schemas = {name: writer.register_msgdef(name, text) for name, text in DEFINITIONS.items()}
        for t, topic, name, message in merge(
            pose_messages(log), joint_messages(log, wheels), key=itemgetter(0)
        ):
            writer.write_message(topic, schemas[name], message, t)
        writer.finish()


def write_csv(log: Log, path: Path) -> None:
    """``drive.csv``: poses and wheel speeds."""
    pose, wheels = log.pose, log.torque or log.wheels
    assert wheels is not None
    n = min(len(pose), len(wheels))
    speeds = wheels.left_radps[:n], wheels.right_radps[:n]
    columns = [pose.t_ns[:n] / 1e9, pose.x_m[:n], pose.y_m[:n], pose.yaw_rad[:n], *speeds]
    names = "t,x,y,yaw,w_left,w_right"
    np.savetxt(path, np.stack(columns, axis=1), delimiter=",", header=names, comments="")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--wheels", default=",".join(WHEELS), help="Names of the wheels, the left ones first."
    )
    parser.add_argument("--scenario", default="paper-acceleration")
    asked = parser.parse_args()
    made = wr.synthesise(asked.scenario, duration_s=25, rate_hz=100, noise="mocap").log
    if made.torque is not None:
        write_robot(made, asked.folder / "my_robot.mcap", asked.wheels.split(","))
    write_csv(made, asked.folder / "drive.csv")

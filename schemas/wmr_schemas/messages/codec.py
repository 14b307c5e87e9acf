"""What the encodings share: a codec, and messages of one length written as rows of a byte matrix."""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.signals import ModeTrack, PoseTrack, TorqueTrack

WheelAngles: TypeAlias = tuple[F64, F64]
"""Angles of the left and the right wheel in rad, each of shape (n,)."""

JointGroups: TypeAlias = tuple[list[F64], list[F64], list[F64]]
"""Position, velocity and effort of (left, right), as in a JointState; an empty list where nothing is
known.
"""


@dataclass(frozen=True)
class MessageSchema:
    """A schema record: its exact name, and the definition in the codec's schema encoding."""

    name: str
    definition: bytes


Joints = tuple[str, ...]


class EncodeJoints(Protocol):
    """Stamps, groups of columns, and the joints that these are of."""

    def __call__(self, t_ns: I64, groups: JointGroups, joints: Joints = ...) -> list[bytes]:
        """A message of each row."""


@dataclass(frozen=True)
class Codec:
    """One encoding of the canonical log; the encoders turn n rows into n messages."""

    name: str
    profile: str
    schema_encoding: str
    message_encoding: str
    pose: MessageSchema
    torque: MessageSchema
    mode: MessageSchema
    encode_pose: Callable[[PoseTrack], list[bytes]]
    encode_torque: Callable[[TorqueTrack, WheelAngles | None], list[bytes]]
    encode_mode: Callable[[ModeTrack], list[bytes]]
    encode_joints: EncodeJoints
    """Stamps and groups as messages of the schema ``torque``."""
    twist: MessageSchema
    encode_twist: Callable[[I64, F64, F64], list[bytes]]
    """Stamps, v in m/s and yaw rate in rad/s."""


class Template:
    """A message whose length does not depend on its values: constant bytes, and slots filled from columns."""

    def __init__(self, origin: int = 0) -> None:
        self.content = bytearray()
        self.slots: list[int] = []
        self.origin = origin

    def raw(self, data: bytes) -> "Template":
        """Constant bytes."""
        self.content += data
        return self

    def align(self, size: int) -> "Template":
        """Zero bytes up to the next multiple of ``size``, counted from the origin."""
        return self.raw(bytes(-(len(self.content) - self.origin) % size))

    def slot(self, size: int) -> "Template":
        """``size`` bytes that differ from message to message."""
        self.slots.append(len(self.content))
        return self.raw(bytes(size))

    def double(self, value: float = 0.0) -> "Template":
        """A constant little-endian double."""
        return self.raw(struct.pack("<d", value))

    def fill(self, n: int, *columns: np.ndarray) -> list[bytes]:
        """The n messages: column k, viewed as bytes, goes into slot k."""
        if n == 0:
            return []
        matrix = np.tile(np.frombuffer(bytes(self.content), np.uint8), (n, 1))
        for offset, column in zip(self.slots, columns, strict=True):
            cells = np.ascontiguousarray(column).view(np.uint8).reshape(n, -1)
            matrix[:, offset : offset + cells.shape[1]] = cells
        messages: list[bytes] = matrix.view(f"V{matrix.shape[1]}").ravel().tolist()
        return messages


def split_stamp(t_ns: I64) -> tuple[I64, I64]:
    """Whole seconds and the nanoseconds that remain."""
    return t_ns // NS_PER_S, t_ns % NS_PER_S


def yaw_quaternion(yaw_rad: F64) -> tuple[F64, F64]:
    """The z and w components of a rotation by ``yaw_rad`` about z; x and y are 0."""
    return np.sin(yaw_rad / 2), np.cos(yaw_rad / 2)


def wheel_columns(torque: TorqueTrack, angles: WheelAngles | None) -> JointGroups:
    """Position, velocity and effort of (left, right), as in a JointState; empty where nothing is known."""
    position = [] if angles is None else list(angles)
    speeds = [torque.left_radps, torque.right_radps]
    velocity = [] if any(np.isnan(speed).all() for speed in speeds) else speeds
    return position, velocity, [torque.left_nm, torque.right_nm]

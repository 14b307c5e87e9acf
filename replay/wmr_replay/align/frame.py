"""The rigid motion that undoes all jumps of the pose so far."""

import math

from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean


@lean
def carry_back(frame: F64, measured: F64, pose: F64) -> None:
    """Transform a measured pose by ``frame`` (3,), turn and shift, into ``pose`` (3,)."""
    pose[0], pose[1], pose[2] = measured[0], measured[1], measured[2]
    if frame[0] != 0.0 or frame[1] != 0.0 or frame[2] != 0.0:
        cos, sin = math.cos(frame[0]), math.sin(frame[0])
        pose[0] = measured[0] * cos - measured[1] * sin + frame[1]
        pose[1] = measured[0] * sin + measured[1] * cos + frame[2]
        pose[2] = measured[2] + frame[0]


@lean
def take_out(frame: F64, pose: F64, step: F64) -> None:
    """Change the frame so that ``pose`` becomes ``pose − step`` and the motion from there on turns by
    −step[2].
    """
    cos, sin = math.cos(step[2]), math.sin(step[2])
    x, y = frame[1] - pose[0], frame[2] - pose[1]
    for k in range(3):
        pose[k] -= step[k]
    frame[0] -= step[2]
    frame[1], frame[2] = x * cos + y * sin + pose[0], y * cos - x * sin + pose[1]

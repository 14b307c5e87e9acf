"""The robot at the cursor: a body that turns with the measured yaw, and arrows of heading and velocity.

Body and arrows keep their size on the screen's plane by static scales, which follow the path's frame: neither
is to scale with the robot, which would be a dot on most paths.
"""

from dataclasses import dataclass

import numpy as np
import polars as pl
import rerun as rr

from wmr_replay.timeline import colours
from wmr_replay.timeline.path import Frame
from wmr_schemas.arrays import F64

POSE_HZ, VELOCITY_HZ = 20.0, 10.0
"""Most poses and velocities a second."""
BODY = ((-0.5, -0.36), (0.26, -0.36), (0.56, 0.0), (0.26, 0.36), (-0.5, 0.36), (-0.5, -0.36))
WHEELS = (((-0.24, -0.46), (0.24, -0.46)), ((-0.24, 0.46), (0.24, 0.46)))
"""Outlines in body lengths, x forward, y left."""
BODY_SHARE, ARROW_SHARE = 0.05, 0.16
"""Body length, and arrow of the highest speed, as shares of the frame's longer side."""
ORDER = 30.0
POSE = ("x_m", "y_m", "yaw_rad")
VELOCITY = ("v_long_mps", "v_lat_mps")


@dataclass(frozen=True)
class Scales:
    """Length of the body in m, and of the velocity's arrow in m for 1 m/s."""

    body_m: float
    arrow_s: float

    @classmethod
    def of(cls, frame: Frame, fastest_mps: float) -> "Scales":
        """Scales for a path inside ``frame``; the arrow's is a round number."""
        side = float(frame.sides().max())
        wanted = ARROW_SHARE * side / max(fastest_mps, 1e-3)
        power = 10.0 ** np.floor(np.log10(wanted))
        return cls(BODY_SHARE * side, float(power * max(f for f in (1, 2, 5) if f * power <= wanted * 1.001)))


def log_robot(recording: rr.RecordingStream) -> None:
    """Log what does not move with time: outlines and pens."""
    place, line = "/path/robot", rr.Radius.ui_points
    body = rr.LineStrips2D([BODY], colors=colours.ROBOT, radii=line(1.0), draw_order=ORDER)
    wheels = rr.LineStrips2D(WHEELS, colors=colours.ROBOT, radii=line(1.75), draw_order=ORDER)
    heading = rr.Arrows2D(
        vectors=[(1.5, 0.0)], origins=[(0.0, 0.0)], colors=colours.ROBOT, radii=line(1.5), draw_order=ORDER
    )
    for name, shape in (("outline", body), ("wheels", wheels), ("heading", heading)):
        recording.log(f"{place}/body/{name}", shape, static=True)
    arrow = rr.Arrows2D.from_fields(colors=colours.VELOCITY, radii=line(4.0), draw_order=ORDER - 1)
    recording.log(f"{place}/velocity", arrow, static=True)


def log_scales(recording: rr.RecordingStream, scales: Scales) -> None:
    """Log the sizes of body and arrows, in place of those logged before."""
    for name, scale in (("body", scales.body_m), ("velocity", scales.arrow_s)):
        recording.log(f"/path/robot/{name}", rr.Transform3D(scale=[scale] * 3), static=True)


def pose_columns(rows: pl.DataFrame) -> rr.ComponentColumnList:
    """Where the robot is, out of :data:`POSE`."""
    x_m, y_m, yaw_rad = rows.select(POSE).to_numpy().T
    none = np.zeros_like(x_m)
    turned = np.stack([none, none, np.sin(yaw_rad / 2), np.cos(yaw_rad / 2)], axis=1)
    return rr.Transform3D.columns(translation=np.stack([x_m, y_m, none], axis=1), quaternion=turned)


def velocity_columns(rows: pl.DataFrame) -> rr.ComponentColumnList:
    """The velocity in the robot's frame in m/s, out of :data:`VELOCITY`; no arrow where it is unknown."""
    return rr.Arrows2D.columns(vectors=velocities(rows))


def velocities(rows: pl.DataFrame) -> F64:
    """Velocities (n, 2) in the robot's frame, zero where unknown."""
    return np.asarray(np.nan_to_num(rows.select(pl.col(VELOCITY).cast(pl.Float64)).to_numpy()))

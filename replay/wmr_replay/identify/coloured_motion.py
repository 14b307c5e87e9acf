"""Standard deviations of the body's motion under noise of the pose that is correlated in time."""

import math

import numpy as np

from wmr_replay.identify.motion import Derived, Motion, put_deviations
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean


@lean
def fill_deviations(
    rows: Derived, speeds: tuple[F64, F64], noises: F64, part: tuple[int, int], out: F64
) -> None:
    """``out`` (5, n) ← the deviations of :class:`Motion`, in its order, of the rows of a ``part``, first and
    end; ``speeds``: v_long and v_lat.

    The formulas of :func:`~wmr_replay.identify.motion.body_motion`, with s² G_ab of position and of yaw each
    times its own factor, and the window's bias on top. ``noises`` (2, 7): of position and of yaw the factors
    for (a, b) = (0, 0), (0, 1), (1, 1), (2, 2), and the biases' mean squares of the orders 0, 1, 2.
    """
    of_position, of_yaw = noises[0], noises[1]
    for i in range(part[0], part[1]):
        v_long, rate, g11, g22 = speeds[0][i], rows.yaw_rate[i], rows.g11[i], rows.g22[i]
        cos, sin = math.cos(rows.yaw[i]), math.sin(rows.yaw[i])
        motion = v_long, speeds[1][i], rate, rows.a_y[i] * cos - rows.a_x[i] * sin - rate * v_long
        position = (
            of_position[2] * rows.position[i] * g11 + of_position[5],
            of_position[3] * rows.position[i] * g22 + of_position[6],
        )
        yaw = (
            of_yaw[0] * rows.heading[i] * rows.g00[i] + of_yaw[4],
            of_yaw[1] * rows.heading[i] * rows.g01[i],
            of_yaw[2] * rows.heading[i] * g11 + of_yaw[5],
            of_yaw[3] * rows.heading[i] * g22 + of_yaw[6],
        )
        put_deviations(out, i, motion, position, yaw)


class Deviations:
    """A motion whose deviations are found anew in some of its rows."""

    def __init__(self, motion: Motion, rows: Derived) -> None:
        self._motion, self._rows = motion, rows
        self._found: F64 | None = None

    def widen(self, rows: slice, noises: F64) -> None:
        """Of these rows, by ``noises`` (2, 7)."""
        if self._found is None:
            self._found = np.stack(self._motion[5:])
        fill_deviations(self._rows, self._motion[:2], noises, (rows.start, rows.stop), self._found)

    @property
    def motion(self) -> Motion:
        """The motion with what was found."""
        return self._motion if self._found is None else Motion(*self._motion[:5], *self._found)

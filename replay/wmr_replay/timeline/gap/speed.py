"""The speed along the heading, out of a path."""

import numpy as np

from wmr_schemas.arrays import F64

SPEED_S = 0.4
"""The stretch of time over which a speed is taken."""


def speed(t_s: F64, pose: F64, pieces: list[tuple[int, int]]) -> F64:
    """Speed (n,) in m/s of a path (n, 3) x, y, yaw: the difference over 0.4 s about each row, along the
    heading there; NaN within 0.2 s of the ends of each piece [a, b), and where the path is unknown.
    """
    found = np.full(len(t_s), np.nan)
    for a, b in pieces:
        rows = slice(a, b)
        inside = (t_s[rows] >= t_s[a] + SPEED_S / 2) & (t_s[rows] <= t_s[b - 1] - SPEED_S / 2)
        at = t_s[rows][inside]
        before, after = (
            np.stack([np.interp(at + half, t_s[rows], pose[rows, k]) for k in (0, 1)])
            for half in (-SPEED_S / 2, SPEED_S / 2)
        )
        dx, dy = (after - before) / SPEED_S
        yaw = pose[rows, 2][inside]
        found[np.flatnonzero(inside) + a] = dx * np.cos(yaw) + dy * np.sin(yaw)
    return found

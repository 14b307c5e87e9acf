"""Where swivel casters may be swinging round: the motion has turned, and they have not followed yet.

A caster trails. Rolling the distance s past the point that carries it, the direction h that it has followed
so far nears the direction of motion u, both unit vectors in the robot's frame:

    dh/ds = (u − h)/L

A reversal leaves |u − h|/2 = 1, a turn by 90° .7, and each L of travel 1/e of it. Which way round a caster
swings, and how hard it pushes meanwhile, hangs on yaw rates below what poses show; that it may push does
not. Carriers lie about as far ahead of the axle, or behind it, as the wheels to its sides: at (l, 0) the
velocity is (v, l·yaw_rate), and at (−l, 0) as much turns.
"""

import math

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of, slope_sd, window_of
from wmr_replay.gap.settings.filter import SwingSettings
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean


def swings(binned: BinnedLog, half_track_m: float) -> F64:
    """How much of a swing may act in each step (n,), 0 to 1; in full where |u − h|/2 is ``full`` or more."""
    own, columns = binned.settings.swing, columns_of(binned)
    velocity = np.stack([columns["v"], half_track_m * columns["yaw_rate"]], axis=1)
    left = np.zeros(len(binned))
    behind(velocity, binned.step_s, least_speed(binned, half_track_m, own), own.length_m, left)
    return np.minimum(left / own.full, 1.0)


def least_speed(binned: BinnedLog, half_track_m: float, own: SwingSettings) -> float:
    """The speed in m/s from which on the poses show a direction of motion."""
    ahead, _, yaw = np.median(binned.variances, axis=0)
    step_s = float(np.median(binned.step_s[1:]))
    sd_mps = slope_sd(step_s, window_of(binned)) * math.sqrt(max(ahead, half_track_m**2 * yaw))
    return max(own.least_speed_mps, own.seen_sd * sd_mps)


@lean
def behind(velocity: F64, step_s: F64, least_mps: float, length_m: float, out: F64) -> None:
    """``out`` (n,) ← |u − h|/2 before each step of a ``velocity`` (n, 2); held where the robot stands."""
    h_x, h_y, left, known = 0.0, 0.0, 0.0, False
    for k in range(len(velocity)):
        speed = math.hypot(velocity[k, 0], velocity[k, 1])
        if speed >= least_mps:
            u_x, u_y = velocity[k, 0] / speed, velocity[k, 1] / speed
            if not known:
                h_x, h_y, known = u_x, u_y, True
            left = math.hypot(u_x - h_x, u_y - h_y) / 2
            share = 1.0 - math.exp(-speed * step_s[k] / length_m)
            h_x += share * (u_x - h_x)
            h_y += share * (u_y - h_y)
        out[k] = left

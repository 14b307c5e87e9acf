"""∂step/∂z and ∂measured/∂z in closed form: the chain rule through the midpoint rule of :mod:`.dynamics`."""

import math

import numpy as np

from wmr_replay.effects.measurement import arm_slopes
from wmr_replay.effects.motion import is_held, pull_in_skid
from wmr_replay.gap.model.dynamics import (
    D_LAT,
    D_LONG,
    D_YAW,
    LEAST_SPEED_MPS,
    N_STATE,
    V_LAT,
    YAW,
    Base,
    Row,
    V,
    W,
    X,
    Y,
    held_back,
    kept_lateral,
    skid_rate,
    skids,
    skids_unseen,
    slopes_of_accelerations,
    through,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

Five = tuple[float, float, float, float, float]
UNIT = np.eye(N_STATE)
MOVING = (YAW, V, W, V_LAT, D_LONG, D_YAW)
"""The states that act on more than v_lat and, by that, the place."""


@lean
def fall_of_rate(v: float, v_lat: float, w: float, base: Base) -> float:
    """The factor q in ∂rate/∂speed = −q·rate·speed, for each of the speeds; 0 where v̄ is constant."""
    squared = v**2 + v_lat**2 + w**2
    return 1.0 / squared if base.speed_mps <= 0.0 and squared > LEAST_SPEED_MPS**2 else 0.0


@lean
def slopes_of_lateral(z: F64, v: float, w: float, row: F64, theta: F64, base: Base) -> Five:
    """∂next_lateral/∂(yaw, v, w, v_lat, disturbance)."""
    dt, l, v_lat = row[Row.DT], base.half_track_m, z[V_LAT]
    if not skids(row[Row.MODE], theta):
        kept = kept_lateral(row, base)
        if not (skids_unseen(row[Row.MODE], theta) and base.skid_decay_mps2 > 0.0):
            return 0.0, 0.0, 0.0, kept, 0.0
        q = fall_of_rate(v, 0.0, w, base)
        lost = (1.0 - kept) / l / skid_rate(v, 0.0, w, row, theta, base)
        return 0.0, -lost * w * (1.0 + q * v**2), -lost * v * (1.0 + q * w**2), kept, 0.0
    rate = skid_rate(v, v_lat, w, row, theta, base)
    kept, least = math.exp(-rate * dt), max(rate, 1e-9)
    downhill, by_yaw = pull_in_skid(z[YAW], theta)
    reach, push = (1.0 - kept) / least, -v * w / l + z[D_LAT] + downhill
    by_rate = push * (dt * kept - reach) / least - dt * kept * v_lat
    fall = -fall_of_rate(v, v_lat, w, base) * rate * by_rate
    return reach * by_yaw, fall * v - reach * w / l, fall * w - reach * v / l, kept + fall * v_lat, reach


@lean
def jacobian(
    z: F64,
    gains: tuple[float, float],
    row: F64,
    theta: F64,
    base: Base,
    moved: F64,
    middle: F64,
    F: F64,
) -> None:
    """``F`` (9, 9) ← ∂step/∂z; ``moved`` is step(z), ``middle`` the state half-way there.

    ``gains`` are the responses to the efforts.
    """
    dt, half, held = row[Row.DT], row[Row.DT] / 2, is_held(z[V], z[W], theta)
    turn, half_turn = dt / base.half_track_m, half / base.half_track_m / 2
    first = slopes_of_accelerations(z, gains, row, theta, base)
    second = slopes_of_accelerations(middle, gains, row, theta, base)
    lateral = slopes_of_lateral(z, (z[V] + moved[V]) / 2, (z[W] + moved[W]) / 2, row, theta, base)
    ahead, aside = math.cos(middle[YAW]) * dt, math.sin(middle[YAW]) * dt
    dx, dy = moved[X] - z[X], moved[Y] - z[Y]
    for i in range(N_STATE):
        for j in range(N_STATE):
            F[i, j] = UNIT[i, j]
    for j in MOVING:
        e = UNIT[j]
        yaw, v, w, v_lat = e[YAW], e[V], e[W], e[V_LAT]
        if held:
            dv, dw = first[0] * yaw + second[3] * v_lat, 0.0
        else:
            dv, dw = through(first, yaw, v, w, v_lat)
        v_1, w_1 = v + (dv + e[D_LONG]) * half, w + (dw + e[D_YAW]) * half
        if held:
            v_1, w_1 = held_back(second, half, v_1, w_1)
        yaw_1 = yaw + (w + w_1) * half_turn
        dv, dw = through(second, yaw_1, v_1, w_1, v_lat)
        dv, dw = dv + e[D_LONG], dw + e[D_YAW]
        v_2, w_2 = v + dv * half, w + dw * half
        F[V_LAT, j] = lateral[0] * yaw + lateral[1] * v_2 + lateral[2] * w_2 + lateral[3] * v_lat
        across = (v_lat + F[V_LAT, j]) / 2
        F[X, j] = v_2 * ahead - across * aside - dy * yaw_1
        F[Y, j] = v_2 * aside + across * ahead + dx * yaw_1
        F[YAW, j], F[V, j], F[W, j] = yaw + w_2 * turn, v + dv * dt, w + dw * dt
    F[V_LAT, D_LAT] = lateral[4]
    F[X, D_LAT], F[Y, D_LAT] = -lateral[4] / 2 * aside, lateral[4] / 2 * ahead


@lean
def slopes_of_measurement(z: F64, theta: F64, H: F64) -> None:
    """``H`` (3, 3) ← ∂measured/∂(x, y, yaw)."""
    for i in range(3):
        for j in range(3):
            H[i, j] = UNIT[i, j]
    H[X, YAW], H[Y, YAW] = arm_slopes(z[YAW], theta)

"""∂step/∂z and ∂measured/∂z in closed form: the chain rule through the midpoint rule of :mod:`.dynamics`."""

import math
from typing import NamedTuple

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
    Seven,
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
from wmr_schemas.compiled.lean import inlined, lean

Two = tuple[float, float]
Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
Five = tuple[float, float, float, float, float]
UNIT = np.eye(N_STATE)
UNCOUPLED = (X, Y, D_LONG, D_LAT, D_YAW)
"""The states that a step leaves, but for what the motion adds."""
NOT_MOVED = (0.0, 0.0, 0.0, 0.0)
NOT_PUSHED = (0.0, 0.0)


@lean
def fall_of_rate(v: float, v_lat: float, w: float, base: Base) -> float:
    """The factor q in ∂rate/∂speed = −q·rate·speed, for each of the speeds; 0 where v̄ is constant."""
    squared = v**2 + v_lat**2 + w**2
    return 1.0 / squared if base.speed_mps <= 0.0 and squared > LEAST_SPEED_MPS**2 else 0.0


@inlined
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


class Chain(NamedTuple):
    """What takes the slopes of a state half-way to those of the step.

    Slopes of the accelerations half-way and of v_lat, half a step and a whole one in s, a step over l, and
    what a step moves by: (cos ψ, sin ψ) times its length, and (dx, dy).
    """

    accelerations: Seven
    lateral: Five
    half: float
    dt: float
    turn: float
    heading: Two
    place: Two


@inlined
def jacobian(  # noqa: PLR0913, PLR0917 – compiled
    z: F64,
    gains: tuple[float, float],
    row: F64,
    theta: F64,
    base: Base,
    moved: F64,
    middle: F64,
    towards: tuple[float, float],
    F: F64,
) -> None:
    """``F`` (9, 9) ← ∂step/∂z; ``moved`` is step(z), ``middle`` the state half-way there.

    ``gains`` are the responses to the efforts, ``towards`` is the heading half-way. ``F`` holds zeros or an
    earlier Jacobian: what is always 0 is not written.
    """
    dt, half = row[Row.DT], row[Row.DT] / 2
    half_turn = half / base.half_track_m / 2
    first = slopes_of_accelerations(z, gains, row, theta, base)
    second = slopes_of_accelerations(middle, gains, row, theta, base)
    lateral = slopes_of_lateral(z, (z[V] + moved[V]) / 2, (z[W] + moved[W]) / 2, row, theta, base)
    ahead, aside = towards[0] * dt, towards[1] * dt
    place = moved[X] - z[X], moved[Y] - z[Y]
    chain = Chain(second, lateral, half, dt, dt / base.half_track_m, (ahead, aside), place)
    for i in UNCOUPLED:
        F[i, i] = 1.0
    if is_held(z[V], z[W], theta):
        by_yaw = held_back(second, half, first[0] * half, first[6] * half)
        by_v, by_w = held_back(second, half, 1.0, 0.0), held_back(second, half, 0.0, 1.0)
        by_lateral = held_back(second, half, second[3] * half, 0.0)
        by_long, by_turning = held_back(second, half, half, 0.0), held_back(second, half, 0.0, half)
    else:
        by_yaw, by_lateral = (first[0] * half, first[6] * half), (first[3] * half, 0.0)
        by_v, by_w = (1.0 + first[1] * half, first[4] * half), (first[2] * half, 1.0 + first[5] * half)
        by_long, by_turning = (half, 0.0), (0.0, half)
    column(F, YAW, (1.0 + by_yaw[1] * half_turn, *by_yaw), (1.0, 0.0, 0.0, 0.0), NOT_PUSHED, chain)
    column(F, V, (by_v[1] * half_turn, *by_v), (0.0, 1.0, 0.0, 0.0), NOT_PUSHED, chain)
    column(F, W, ((1.0 + by_w[1]) * half_turn, *by_w), (0.0, 0.0, 1.0, 0.0), NOT_PUSHED, chain)
    by_lateral_3 = (by_lateral[1] * half_turn, *by_lateral)
    column(F, V_LAT, by_lateral_3, (0.0, 0.0, 0.0, 1.0), NOT_PUSHED, chain)
    column(F, D_LONG, (by_long[1] * half_turn, *by_long), NOT_MOVED, (1.0, 0.0), chain)
    column(F, D_YAW, (by_turning[1] * half_turn, *by_turning), NOT_MOVED, (0.0, 1.0), chain)
    F[V_LAT, D_LAT] = lateral[4]
    F[X, D_LAT], F[Y, D_LAT] = -lateral[4] / 2 * aside, lateral[4] / 2 * ahead


@inlined
def column(F: F64, j: int, halfway: Three, at: Four, pushed: Two, chain: Chain) -> None:
    """Column ``j`` of ``F`` (9, 9), its first six rows: the slopes by one number of the state.

    ``halfway`` are the slopes of (yaw, v_long, w) half-way, ``at`` those of (yaw, v_long, w, v_lat) before
    the step, and ``pushed`` those of the disturbances ahead and in yaw: 1 or 0.
    """
    (yaw_1, v_1, w_1), (yaw, v, w, v_lat), lateral = halfway, at, chain.lateral
    dv, dw = through(chain.accelerations, yaw_1, v_1, w_1, v_lat)
    dv, dw = dv + pushed[0], dw + pushed[1]
    v_2, w_2 = v + dv * chain.half, w + dw * chain.half
    by_lateral = lateral[0] * yaw + lateral[1] * v_2 + lateral[2] * w_2 + lateral[3] * v_lat
    across, (ahead, aside), (dx, dy) = (v_lat + by_lateral) / 2, chain.heading, chain.place
    F[X, j] = v_2 * ahead - across * aside - dy * yaw_1
    F[Y, j] = v_2 * aside + across * ahead + dx * yaw_1
    F[YAW, j], F[V, j], F[W, j] = yaw + w_2 * chain.turn, v + dv * chain.dt, w + dw * chain.dt
    F[V_LAT, j] = by_lateral


@lean
def slopes_of_measurement(z: F64, theta: F64, H: F64) -> None:
    """``H`` (3, 3) ← ∂measured/∂(x, y, yaw)."""
    for i in range(3):
        for j in range(3):
            H[i, j] = UNIT[i, j]
    H[X, YAW], H[Y, YAW] = arm_slopes(z[YAW], theta)

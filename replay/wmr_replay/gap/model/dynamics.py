"""The robot's motion with every effect of the catalogue, as one step of a state.

State z (9,): x, y [m], yaw [rad], v_long, w = l·yaw_rate, v_lat [m/s], and the disturbances of v_long, v_lat
and w [m/s²]. Parameters θ: see :class:`~wmr_replay.effects.theta.Theta`; all 0 is the base model. Written in
robot conventions (REP 103) after the paper's (3) to (5). The effects' own formulas stand in
:mod:`wmr_replay.effects`.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from wmr_replay.effects.measurement import moved, yaw_error
from wmr_replay.effects.motion import (
    Carried,
    downhill_left,
    is_held,
    pull_in_skid,
    turning_arm,
    wheel_losses,
    wheel_slopes,
    with_body_effects,
    with_body_slopes,
)
from wmr_replay.effects.response import Weights, response, with_stiffness
from wmr_replay.effects.swivels import by_swivels, slopes_by_swivels
from wmr_replay.effects.theta import Theta
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import inlined, lean
from wmr_schemas.modes import ContactMode

N_STATE = 9
X, Y, YAW, V, W, V_LAT, D_LONG, D_LAT, D_YAW = range(N_STATE)
N_MOTION = 6
"""The states that a simulation starts from; the disturbances behind them are a filter's."""
UNDISTURBED = (0.0, 0.0)
LEAST_SPEED_MPS = 0.3
"""Floor of v̄ in assumption 4, as in the simulator: at standstill the decay rate would be infinite."""
DIFFERENCE = 1e-6
"""Step of every difference quotient."""
MOST_ITERATIONS, SETTLED_MPS = 20, 1e-13
"""Of Newton's method for the speeds half-way, which dry friction holds back."""
LEAST_UNDECLARED = 0.1
"""Below it, an undeclared skid moves v_lat by its first-order term alone: tyres that are so stiff creep, and
do not skid (:mod:`wmr_replay.gap.estimation.sideslip`).
"""


class Row(IntEnum):
    """Columns of a step's inputs: length, efforts over it, mode, weights of the effects in time and space,
    how loosely v_lat is held [m/s] about a change of mode, seconds since the log's first pose, how much of a
    caster's swing may act, and the slopes [1/s] of the extra accelerations by v_long and w.
    """

    DT = 0
    LEFT = 1
    RIGHT = 2
    MODE = 3
    LOAD = 4
    PATCH = 5
    SLIP = 6
    EXTRA_LONG = 7
    EXTRA_YAW = 8
    LOOSE = 9
    AGE = 10
    SWING = 11
    LONG_BY_V = 12
    LONG_BY_W = 13
    YAW_BY_V = 14
    YAW_BY_W = 15


N_ROW = len(Row)
Seven = tuple[float, float, float, float, float, float, float]


class Base(NamedTuple):
    """The base model's numbers.

    ``skid_decay_mps2`` is 2 G_x/(ε m), which over v̄ is the decay rate of v_lat while skidding; ``speed_mps``
    is v̄, 0 for the paper's assumption 4; slipping leaves the shares of α and α_yaw; ``com_yaw_per_m`` is
    l m/I, 0 where unknown; ``lateral_decay_per_s`` is the decay rate of v_lat without a skid.
    """

    alpha: float
    alpha_yaw: float
    half_track_m: float
    skid_decay_mps2: float
    speed_mps: float
    slip_share: float
    slip_share_yaw: float
    com_yaw_per_m: float
    lateral_decay_per_s: float


@lean
def is_skidding(mode: float) -> bool:
    """Whether the mode of a row declares a skid."""
    return int(mode) in (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING)


@lean
def is_slipping(mode: float) -> bool:
    """Whether the mode of a row declares slip."""
    return int(mode) in (ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING)


@lean
def skids_unseen(mode: float, theta: F64) -> bool:
    """Whether θ has an undeclared skid that acts in a row of ``mode``: in ideal ones; of tyres so stiff that
    it is an elastic sideslip, in all that do not skid. Wheels that slip ahead hold sideways as they did.
    """
    undeclared = theta[Theta.UNDECLARED]
    if int(mode) == ContactMode.SLIPPING:
        return bool(0.0 < undeclared <= LEAST_UNDECLARED)
    return int(mode) == ContactMode.IDEAL and undeclared > 0.0


@lean
def skids(mode: float, theta: F64) -> bool:
    """Whether the tyres skid: declared by the mode, or an undeclared skid while the mode is ideal."""
    return is_skidding(mode) or (skids_unseen(mode, theta) and theta[Theta.UNDECLARED] > LEAST_UNDECLARED)


@lean
def skid_rate(v: float, v_lat: float, w: float, row: F64, theta: F64, base: Base) -> float:
    """Decay rate of lateral velocity, 1/s: 2 G_x/(ε m v̄) times the stiffness that the effects leave."""
    speed = base.speed_mps
    if speed <= 0.0:
        speed = max(math.sqrt(v**2 + v_lat**2 + w**2), LEAST_SPEED_MPS)
    rate = with_stiffness(base.skid_decay_mps2 / speed, row[Row.PATCH], theta)
    if skids_unseen(row[Row.MODE], theta):
        rate /= theta[Theta.UNDECLARED]
    return float(rate)


@inlined
def responses(row: F64, theta: F64, base: Base) -> tuple[float, float]:
    """dv_long/dt per N·m of the sum of the efforts, and dw/dt per N·m of their difference."""
    slips = is_slipping(row[Row.MODE])
    slipping = base.slip_share if slips else 1.0, base.slip_share_yaw if slips else 1.0
    acts = Weights(row[Row.LOAD], row[Row.PATCH], row[Row.SLIP])
    return response((base.alpha, base.alpha_yaw), slipping, acts, theta)


@lean
def carried_in(row: F64, theta: F64, base: Base) -> Carried:
    """What weighs on the axle with the load that the robot carries in the row, at its centre of mass."""
    return Carried(base.com_yaw_per_m, 1.0 + theta[Theta.LOAD_STEP] * row[Row.LOAD])


@lean
def rolling(
    z: F64, pushed: tuple[float, float], gains: tuple[float, float], row: F64, theta: F64, base: Base
) -> tuple[float, float]:
    """(dv_long/dt, dw/dt) in m/s² of a row without a skid, under the disturbances ``pushed``, and without the
    friction of swivels.
    """
    v, w, yaw_rate, (ahead, turning) = z[V], z[W], z[W] / base.half_track_m, gains
    lost_right, lost_left = wheel_losses(v + w, v - w, theta)
    u_right, u_left = row[Row.RIGHT] - lost_right, row[Row.LEFT] - lost_left
    dv = ahead * (u_right + u_left) + pushed[0] + theta[Theta.EXTRA_LONG] * row[Row.EXTRA_LONG]
    dw = turning * (u_right - u_left) + pushed[1] + theta[Theta.EXTRA_YAW] * row[Row.EXTRA_YAW]
    dv += row[Row.LONG_BY_V] * v + row[Row.LONG_BY_W] * w
    dw += row[Row.YAW_BY_V] * v + row[Row.YAW_BY_W] * w
    return with_body_effects((dv, dw), v, (w, yaw_rate), z[YAW], carried_in(row, theta, base), theta)


@inlined
def accelerations(
    z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base
) -> tuple[float, float]:
    """(dv_long/dt, dw/dt) in m/s², at the state ``z``; ``gains`` are the responses to the efforts."""
    dv, dw = rolling(z, (z[D_LONG], z[D_YAW]), gains, row, theta, base)
    if skids(row[Row.MODE], theta):
        dv += z[V_LAT] * (z[W] / base.half_track_m) / 3.0
    elif theta[Theta.SWIVEL] != 0.0:
        dw += by_swivels(rolling(z, UNDISTURBED, gains, row, theta, base), z[V], z[W], theta)
    return dv, dw


@lean
def kept_lateral(row: F64, base: Base) -> float:
    """The share of v_lat left after a step without a skid."""
    return float(math.exp(-row[Row.DT] * base.lateral_decay_per_s)) if row[Row.LOOSE] == 0.0 else 0.0


@inlined
def next_lateral(z: F64, v: float, w: float, row: F64, theta: F64, base: Base) -> float:
    """v_lat after the step: equation (3) while skidding; else a noise that dies out, about the first-order
    motion of an undeclared skid that is too small to be followed.
    """
    dt, yaw_rate = row[Row.DT], w / base.half_track_m
    if skids(row[Row.MODE], theta):
        rate = skid_rate(v, z[V_LAT], w, row, theta, base)
        push = -v * yaw_rate + z[D_LAT] + pull_in_skid(z[YAW], theta)[0]
        kept = math.exp(-rate * dt)
        return float(kept * z[V_LAT] + push * (1.0 - kept) / max(rate, 1e-9))
    kept = kept_lateral(row, base)
    v_lat = kept * z[V_LAT]
    if skids_unseen(row[Row.MODE], theta) and base.skid_decay_mps2 > 0.0:
        v_lat -= (1.0 - kept) * v * yaw_rate / skid_rate(v, 0.0, w, row, theta, base)
    return float(v_lat)


@inlined
def slopes_of_accelerations(z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base) -> Seven:
    """∂(dv_long/dt)/∂(yaw, v_long, w, v_lat) and ∂(dw/dt)/∂(v_long, w, yaw)."""
    (ahead, turning), v, w, l = gains, z[V], z[W], base.half_track_m
    right, left = wheel_slopes(v + w, v - w, theta)
    by_wheels = -ahead * (right + left), -ahead * (right - left), -turning * (right - left)
    given = (
        by_wheels[0] + row[Row.LONG_BY_V],
        by_wheels[1] + row[Row.LONG_BY_W],
        by_wheels[2] + row[Row.YAW_BY_V],
        -turning * (right + left) + row[Row.YAW_BY_W],
    )
    carried = carried_in(row, theta, base)
    v_v, v_w, w_v, w_w = with_body_slopes(given, v, w, l, carried, theta)
    (v_yaw, turned), v_lateral = downhill_left(z[YAW], theta), 0.0
    w_yaw = turning_arm(carried, theta) * turned
    if skids(row[Row.MODE], theta):
        v_w, v_lateral = v_w + z[V_LAT] / l / 3.0, w / l / 3.0
    elif theta[Theta.SWIVEL] != 0.0:
        free, slopes = rolling(z, UNDISTURBED, gains, row, theta, base), (v_v, v_w, v_yaw, w_v, w_w, w_yaw)
        by_v, by_w, by_yaw = slopes_by_swivels(free, slopes, v, w, theta)
        w_v, w_w, w_yaw = w_v + by_v, w_w + by_w, w_yaw + by_yaw
    return v_yaw, v_v, v_w, v_lateral, w_v, w_w, w_yaw


@inlined
def through(a: Seven, yaw: float, v: float, w: float, v_lat: float) -> tuple[float, float]:
    """Changes of (dv_long/dt, dw/dt) with changes of the state, by the slopes ``a``."""
    return a[0] * yaw + a[1] * v + a[2] * w + a[3] * v_lat, a[4] * v + a[5] * w + a[6] * yaw


@inlined
def held_back(a: Seven, half: float, v: float, w: float) -> tuple[float, float]:
    """(1 − h A)⁻¹ (v, w), A the slopes of the accelerations by (v_long, w) and h half a step."""
    determinant = (1.0 - half * a[1]) * (1.0 - half * a[5]) - half * half * a[2] * a[4]
    ahead = (1.0 - half * a[5]) * v + half * a[2] * w
    turning = (1.0 - half * a[1]) * w + half * a[4] * v
    return ahead / determinant, turning / determinant


@lean
def settle(z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base, out: F64) -> None:
    """``out`` ← its v_long and w half a step after ``z`` with the accelerations that act there.

    Dry friction is steep about standstill, c/v₀ up to 100/s: a step that begins with the friction of its
    start throws the robot back and forth. Newton's method from standstill, where the slope is steepest and a
    step never leads beyond the solution.
    """
    half = row[Row.DT] / 2
    out[V] = out[W] = 0.0
    for _ in range(MOST_ITERATIONS):
        dv, dw = accelerations(out, gains, row, theta, base)
        slopes = slopes_of_accelerations(out, gains, row, theta, base)
        v, w = held_back(slopes, half, z[V] + dv * half - out[V], z[W] + dw * half - out[W])
        out[V] += v
        out[W] += w
        if abs(v) + abs(w) < SETTLED_MPS:
            break


@inlined
def halfway(z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base, out: F64) -> None:
    """``out`` (9,) ← the state ``z``, but yaw, v_long and w half a step later; implicitly where
    dry friction holds the robot.
    """
    half = row[Row.DT] / 2
    for i in range(N_STATE):
        out[i] = z[i]
    if is_held(z[V], z[W], theta):
        settle(z, gains, row, theta, base, out)
    else:
        dv, dw = accelerations(z, gains, row, theta, base)
        out[V] = z[V] + dv * half
        out[W] = z[W] + dw * half
    out[YAW] = z[YAW] + (z[W] + out[W]) / 2 / base.half_track_m * half


@lean
def step(z: F64, row: F64, theta: F64, base: Base, out: F64) -> None:
    """``out`` (9,) ← the state one row later, by the midpoint rule; the efforts are means over the step."""
    gains = responses(row, theta, base)
    halfway(z, gains, row, theta, base, out)
    step_from(out, heading(out), z, gains, row, theta, base, out)


@lean
def heading(middle: F64) -> tuple[float, float]:
    """Cosine and sine of the yaw half-way, which a step and its Jacobian share."""
    return math.cos(middle[YAW]), math.sin(middle[YAW])


@inlined
def step_from(
    middle: F64,
    towards: tuple[float, float],
    z: F64,
    gains: tuple[float, float],
    row: F64,
    theta: F64,
    base: Base,
    out: F64,
) -> None:
    """``out`` (9,) ← the state one row later, by way of the state half-way; it may stand in ``out``.

    ``towards`` is the heading half-way.
    """
    dt, (cos, sin) = row[Row.DT], towards
    dv, dw = accelerations(middle, gains, row, theta, base)
    v, w = z[V] + dv * dt / 2, z[W] + dw * dt / 2
    lateral = next_lateral(z, v, w, row, theta, base)
    v_lat = (z[V_LAT] + lateral) / 2
    for i in range(N_MOTION, N_STATE):
        out[i] = z[i]
    out[X] = z[X] + (v * cos - v_lat * sin) * dt
    out[Y] = z[Y] + (v * sin + v_lat * cos) * dt
    out[YAW] = z[YAW] + w / base.half_track_m * dt
    out[V] = z[V] + dv * dt
    out[W] = z[W] + dw * dt
    out[V_LAT] = lateral


@lean
def measured(z: F64, row: F64, theta: F64, out: F64) -> None:
    """``out`` (3,) ← the pose as measured, with the errors of :mod:`wmr_replay.effects.measurement`."""
    constant, drifted = yaw_error(row[Row.AGE], 1.0, theta)
    out[0], out[1] = moved(z[X], z[Y], z[YAW], (theta[Theta.ARM_X], theta[Theta.ARM_Y]))
    out[2] = z[YAW] + constant + drifted

"""The robot's motion with every effect of the catalogue, as one step of a state; everything else uses this.

State z (9,): x, y [m], yaw [rad], v_long, w = l·yaw_rate, v_lat [m/s], and the disturbances of v_long, v_lat
and w [m/s²]. Parameters θ: see :class:`Theta`; all 0 is the base model. Written in robot conventions (REP
103) after the paper's (3) to (5); effects after ISO 8855.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_schemas.terms import SOFT_SIGN

N_STATE = 9
X, Y, YAW, V, W, V_LAT, D_LONG, D_LAT, D_YAW = range(N_STATE)
N_MOTION = 6
"""The states that a simulation starts from; the disturbances behind them are a filter's."""
LEAST_SPEED_MPS = 0.3
DIFFERENCE = 1e-6
"""Step of every difference that stands for a slope."""
LEAST_UNDECLARED = 1e-3
"""Below it, an undeclared skid moves v_lat by its first order alone: what it does of second order would make
a jump of the slope at 0.
"""


class Theta(IntEnum):
    """Places in θ of what an effect changes in the motion or in the measured pose."""

    MASS_RATIO = 0
    YAW_INERTIA = 1
    DRIVE_GAIN = 2
    ROLLING = 3
    VISCOUS = 4
    DRAG = 5
    SCRUB = 6
    YAW_DAMPING = 7
    WHEEL_COULOMB = 8
    WHEEL_VISCOUS = 9
    GRADE_X = 10
    GRADE_Y = 11
    COM_OFFSET = 12
    HEADING = 13
    ARM_X = 14
    ARM_Y = 15
    CORNERING = 16
    UNDECLARED = 17
    LOAD_STEP = 18
    PATCH = 19
    SLIP = 20
    EXTRA_LONG = 21
    EXTRA_YAW = 22
    YAW_DRIFT = 23


N_THETA = len(Theta)


class Row(IntEnum):
    """Columns of a step's inputs: length, efforts over it, mode, weights of the effects in time and space,
    how loosely v_lat is held [m/s] about a change of mode, and seconds since the log's first pose.
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


N_ROW = len(Row)
IDEAL, SKIDDING, SLIPPING, BOTH = 0.0, 1.0, 2.0, 3.0


class Base(NamedTuple):
    """The base model's numbers. ``skid_rate_mps`` is 2 G_x/(ε m); ``speed_mps`` v̄, 0 for the paper's
    assumption 4; the shares say what slipping leaves of α and α_yaw; ``com_yaw_per_m`` is l m/I, 0 unknown.
    """

    alpha: float
    alpha_yaw: float
    half_track_m: float
    skid_rate_mps: float
    speed_mps: float
    slip_share: float
    slip_share_yaw: float
    com_yaw_per_m: float
    lateral_decay: float


@compiled(error_model="numpy", inline="always")
def sign(speed: float) -> float:
    """Sgn, softened about standstill."""
    return float(np.tanh(speed / SOFT_SIGN))


@compiled(error_model="numpy", inline="always")
def skids(mode: float, theta: F64) -> bool:
    """Whether the tyres skid: declared by the mode, or an undeclared skid in what is called ideal."""
    return mode in (SKIDDING, BOTH) or (mode == IDEAL and theta[Theta.UNDECLARED] > LEAST_UNDECLARED)


@compiled(error_model="numpy")
def skid_rate(v: float, v_lat: float, w: float, row: F64, theta: F64, base: Base) -> float:
    """Decay rate of lateral velocity, 1/s: 2 G_x/(ε m v̄), times what the effects make of it."""
    speed = base.speed_mps
    if speed <= 0.0:
        speed = max(np.sqrt(v**2 + v_lat**2 + w**2), LEAST_SPEED_MPS)
    lost = 1.0 - theta[Theta.PATCH] * row[Row.PATCH]
    rate = base.skid_rate_mps / speed * max(1.0 + theta[Theta.CORNERING], 0.02) * max(lost, 0.02)
    if row[Row.MODE] == IDEAL and theta[Theta.UNDECLARED] > 0.0:
        rate /= theta[Theta.UNDECLARED]
    return float(rate)


@compiled(error_model="numpy", inline="always")
def responses(row: F64, theta: F64, base: Base) -> tuple[float, float]:
    """What dv_long/dt makes of the sum of the efforts, and dw/dt of their difference."""
    kept = (1.0 - theta[Theta.PATCH] * row[Row.PATCH]) * (1.0 - theta[Theta.SLIP] * row[Row.SLIP])
    gain = (1.0 + theta[Theta.DRIVE_GAIN]) * kept
    slips = row[Row.MODE] in (SLIPPING, BOTH)
    ahead = base.alpha * gain / (1.0 + theta[Theta.MASS_RATIO])
    ahead *= (base.slip_share if slips else 1.0) / (1.0 + theta[Theta.LOAD_STEP] * row[Row.LOAD])
    turning = base.alpha_yaw * gain * (base.slip_share_yaw if slips else 1.0)
    turning /= 1.0 + theta[Theta.YAW_INERTIA]
    return ahead, turning


@compiled(error_model="numpy", inline="always")
def accelerations(
    z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base
) -> tuple[float, float]:
    """(dv_long/dt, dw/dt) in m/s², at the state ``z``; ``gains`` are the responses to the efforts."""
    v, w, yaw_rate, (ahead, turning) = z[V], z[W], z[W] / base.half_track_m, gains
    u_right, u_left = row[Row.RIGHT], row[Row.LEFT]
    if theta[Theta.WHEEL_COULOMB] != 0.0 or theta[Theta.WHEEL_VISCOUS] != 0.0:
        right, left = v + w, v - w
        u_right -= theta[Theta.WHEEL_COULOMB] * sign(right) + theta[Theta.WHEEL_VISCOUS] * right
        u_left -= theta[Theta.WHEEL_COULOMB] * sign(left) + theta[Theta.WHEEL_VISCOUS] * left
    dv = ahead * (u_right + u_left) + z[D_LONG] + theta[Theta.EXTRA_LONG] * row[Row.EXTRA_LONG]
    dv -= theta[Theta.VISCOUS] * v + theta[Theta.DRAG] * v * abs(v)
    dv += theta[Theta.COM_OFFSET] * yaw_rate**2
    dw = turning * (u_right - u_left) + z[D_YAW] + theta[Theta.EXTRA_YAW] * row[Row.EXTRA_YAW]
    dw -= theta[Theta.YAW_DAMPING] * w
    dw -= base.com_yaw_per_m * theta[Theta.COM_OFFSET] * v * yaw_rate
    if theta[Theta.ROLLING] != 0.0:
        dv -= theta[Theta.ROLLING] * sign(v)
    if theta[Theta.SCRUB] != 0.0:
        dw -= theta[Theta.SCRUB] * sign(w)
    if theta[Theta.GRADE_X] != 0.0 or theta[Theta.GRADE_Y] != 0.0:
        dv += theta[Theta.GRADE_X] * np.cos(z[YAW]) + theta[Theta.GRADE_Y] * np.sin(z[YAW])
    if skids(row[Row.MODE], theta):
        dv += z[V_LAT] * yaw_rate / 3.0
    return dv, dw


@compiled(error_model="numpy", inline="always")
def kept_lateral(row: F64, base: Base) -> float:
    """The share of v_lat left after a step without a skid."""
    return float(np.exp(-row[Row.DT] * base.lateral_decay)) if row[Row.LOOSE] == 0.0 else 0.0


@compiled(error_model="numpy", inline="always")
def next_lateral(z: F64, v: float, w: float, row: F64, theta: F64, base: Base) -> float:
    """v_lat after the step: (3) while skidding; while not, a noise that dies out, about what too small an
    undeclared skid to be followed makes of it.
    """
    dt, yaw_rate = row[Row.DT], w / base.half_track_m
    if skids(row[Row.MODE], theta):
        rate = skid_rate(v, z[V_LAT], w, row, theta, base)
        push = -v * yaw_rate + z[D_LAT]
        if theta[Theta.GRADE_X] != 0.0 or theta[Theta.GRADE_Y] != 0.0:
            push += theta[Theta.GRADE_Y] * np.cos(z[YAW]) - theta[Theta.GRADE_X] * np.sin(z[YAW])
        kept = np.exp(-rate * dt)
        return float(kept * z[V_LAT] + push * (1.0 - kept) / max(rate, 1e-9))
    kept = kept_lateral(row, base)
    v_lat = kept * z[V_LAT]
    if row[Row.MODE] == IDEAL and theta[Theta.UNDECLARED] > 0.0 and base.skid_rate_mps > 0.0:
        v_lat -= (1.0 - kept) * v * yaw_rate / skid_rate(v, 0.0, w, row, theta, base)
    return float(v_lat)


@compiled(error_model="numpy", inline="always")
def halfway(z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base, out: F64) -> None:
    """``out`` (9,) ← the state ``z``, but yaw, v_long and w half a step later."""
    half = row[Row.DT] / 2
    dv, dw = accelerations(z, gains, row, theta, base)
    for i in range(N_STATE):
        out[i] = z[i]
    out[V] = z[V] + dv * half
    out[W] = z[W] + dw * half
    out[YAW] = z[YAW] + (z[W] + out[W]) / 2 / base.half_track_m * half


@compiled(error_model="numpy")
def step(z: F64, row: F64, theta: F64, base: Base, out: F64) -> None:
    """``out`` (9,) ← the state one row later, by the midpoint rule; the efforts are means over the step."""
    halfway(z, responses(row, theta, base), row, theta, base, out)
    step_from(out, z, row, theta, base, out)


@compiled(error_model="numpy")
def step_from(middle: F64, z: F64, row: F64, theta: F64, base: Base, out: F64) -> None:
    """``out`` (9,) ← the state one row later, by way of the state half-way; it may stand in ``out``."""
    dt = row[Row.DT]
    dv, dw = accelerations(middle, responses(row, theta, base), row, theta, base)
    cos, sin = np.cos(middle[YAW]), np.sin(middle[YAW])
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


@compiled(error_model="numpy")
def measured(z: F64, row: F64, theta: F64, out: F64) -> None:
    """``out`` (3,) ← the pose as measured: of a point (ARM_X, ARM_Y) on the robot, with yaw + HEADING and
    what has drifted since.
    """
    out[0], out[1] = z[X], z[Y]
    out[2] = z[YAW] + theta[Theta.HEADING] + theta[Theta.YAW_DRIFT] * row[Row.AGE]
    if theta[Theta.ARM_X] == 0.0 and theta[Theta.ARM_Y] == 0.0:
        return
    cos, sin = np.cos(z[YAW]), np.sin(z[YAW])
    out[0] = z[X] + cos * theta[Theta.ARM_X] - sin * theta[Theta.ARM_Y]
    out[1] = z[Y] + sin * theta[Theta.ARM_X] + cos * theta[Theta.ARM_Y]

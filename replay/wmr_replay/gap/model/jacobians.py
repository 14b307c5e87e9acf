"""∂step/∂z and ∂measured/∂z in closed form: the chain rule through the midpoint rule of :mod:`.dynamics`."""

import numpy as np

from wmr_replay.gap.model.dynamics import (
    D_LAT,
    D_LONG,
    D_YAW,
    IDEAL,
    LEAST_SPEED_MPS,
    N_MOTION,
    N_STATE,
    V_LAT,
    YAW,
    Base,
    Row,
    Theta,
    V,
    W,
    X,
    Y,
    kept_lateral,
    responses,
    sign,
    skid_rate,
    skids,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_schemas.terms import SOFT_SIGN

Six = tuple[float, float, float, float, float, float]
Five = tuple[float, float, float, float, float]
UNIT = np.eye(N_STATE)


@compiled(error_model="numpy")
def steepness(speed: float) -> float:
    """Slope of the softened sign."""
    return float((1.0 - sign(speed) ** 2) / SOFT_SIGN)


@compiled(error_model="numpy")
def slopes_of_accelerations(z: F64, gains: tuple[float, float], row: F64, theta: F64, base: Base) -> Six:
    """∂(dv_long/dt)/∂(yaw, v_long, w, v_lat) and ∂(dw/dt)/∂(v_long, w)."""
    (ahead, turning), v, w = gains, z[V], z[W]
    yaw_rate = w / base.half_track_m
    com_yaw = base.com_yaw_per_m * theta[Theta.COM_OFFSET]
    v_yaw, v_lateral = 0.0, 0.0
    v_v = -theta[Theta.VISCOUS] - 2 * theta[Theta.DRAG] * abs(v)
    v_w = 2 * theta[Theta.COM_OFFSET] * yaw_rate / base.half_track_m
    w_v, w_w = -com_yaw * yaw_rate, -theta[Theta.YAW_DAMPING] - com_yaw * v / base.half_track_m
    if theta[Theta.WHEEL_COULOMB] != 0.0 or theta[Theta.WHEEL_VISCOUS] != 0.0:
        right = theta[Theta.WHEEL_COULOMB] * steepness(v + w) + theta[Theta.WHEEL_VISCOUS]
        left = theta[Theta.WHEEL_COULOMB] * steepness(v - w) + theta[Theta.WHEEL_VISCOUS]
        v_v, v_w = v_v - ahead * (right + left), v_w - ahead * (right - left)
        w_v, w_w = w_v - turning * (right - left), w_w - turning * (right + left)
    if theta[Theta.ROLLING] != 0.0:
        v_v -= theta[Theta.ROLLING] * steepness(v)
    if theta[Theta.SCRUB] != 0.0:
        w_w -= theta[Theta.SCRUB] * steepness(w)
    if theta[Theta.GRADE_X] != 0.0 or theta[Theta.GRADE_Y] != 0.0:
        v_yaw = theta[Theta.GRADE_Y] * np.cos(z[YAW]) - theta[Theta.GRADE_X] * np.sin(z[YAW])
    if skids(row[Row.MODE], theta):
        v_w, v_lateral = v_w + z[V_LAT] / base.half_track_m / 3.0, yaw_rate / 3.0
    return v_yaw, v_v, v_w, v_lateral, w_v, w_w


@compiled(error_model="numpy")
def fall_of_rate(v: float, v_lat: float, w: float, base: Base) -> float:
    """What q is in ∂rate/∂speed = −q rate speed, for any of the speeds; 0 where the rate's speed is held."""
    squared = v**2 + v_lat**2 + w**2
    return 1.0 / squared if base.speed_mps <= 0.0 and squared > LEAST_SPEED_MPS**2 else 0.0


@compiled(error_model="numpy")
def slopes_of_lateral(z: F64, v: float, w: float, row: F64, theta: F64, base: Base) -> Five:
    """∂next_lateral/∂(yaw, v, w, v_lat, disturbance)."""
    dt, l, v_lat = row[Row.DT], base.half_track_m, z[V_LAT]
    if not skids(row[Row.MODE], theta):
        kept = kept_lateral(row, base)
        if not (row[Row.MODE] == IDEAL and theta[Theta.UNDECLARED] > 0.0 and base.skid_rate_mps > 0.0):
            return 0.0, 0.0, 0.0, kept, 0.0
        q = fall_of_rate(v, 0.0, w, base)
        lost = (1.0 - kept) / l / skid_rate(v, 0.0, w, row, theta, base)
        return 0.0, -lost * w * (1.0 + q * v**2), -lost * v * (1.0 + q * w**2), kept, 0.0
    rate = skid_rate(v, v_lat, w, row, theta, base)
    kept, least = np.exp(-rate * dt), max(rate, 1e-9)
    reach, by_yaw, push = (1.0 - kept) / least, 0.0, -v * w / l + z[D_LAT]
    if theta[Theta.GRADE_X] != 0.0 or theta[Theta.GRADE_Y] != 0.0:
        cos, sin = np.cos(z[YAW]), np.sin(z[YAW])
        push += theta[Theta.GRADE_Y] * cos - theta[Theta.GRADE_X] * sin
        by_yaw = -theta[Theta.GRADE_Y] * sin - theta[Theta.GRADE_X] * cos
    by_rate = push * (dt * kept - reach) / least - dt * kept * v_lat
    fall = -fall_of_rate(v, v_lat, w, base) * rate * by_rate
    return reach * by_yaw, fall * v - reach * w / l, fall * w - reach * v / l, kept + fall * v_lat, reach


@compiled(error_model="numpy", inline="always")
def through(a: Six, yaw: float, v: float, w: float, v_lat: float) -> tuple[float, float]:
    """What changes of the state make of the accelerations of slopes ``a``."""
    return a[0] * yaw + a[1] * v + a[2] * w + a[3] * v_lat, a[4] * v + a[5] * w


@compiled(error_model="numpy")
def jacobian(z: F64, row: F64, theta: F64, base: Base, moved: F64, middle: F64, F: F64) -> None:
    """``F`` (9, 9) ← ∂step/∂z; ``moved`` is step(z), ``middle`` the state half-way there."""
    dt, l, half, gains = row[Row.DT], base.half_track_m, row[Row.DT] / 2, responses(row, theta, base)
    first = slopes_of_accelerations(z, gains, row, theta, base)
    second = slopes_of_accelerations(middle, gains, row, theta, base)
    lateral = slopes_of_lateral(z, (z[V] + moved[V]) / 2, (z[W] + moved[W]) / 2, row, theta, base)
    cos, sin = np.cos(middle[YAW]), np.sin(middle[YAW])
    F[:, X], F[:, Y] = UNIT[X], UNIT[Y]
    for j in range(YAW, N_STATE):
        e = UNIT[j]
        yaw, v, w, v_lat = e[YAW], e[V], e[W], e[V_LAT]
        dv, dw = through(first, yaw, v, w, v_lat)
        v_1, w_1 = v + (dv + e[D_LONG]) * half, w + (dw + e[D_YAW]) * half
        yaw_1 = yaw + (w + w_1) / 2 / l * half
        dv, dw = through(second, yaw_1, v_1, w_1, v_lat)
        dv, dw = dv + e[D_LONG], dw + e[D_YAW]
        v_2, w_2 = v + dv * half, w + dw * half
        F[V_LAT, j] = lateral[0] * yaw + lateral[1] * v_2 + lateral[2] * w_2 + lateral[3] * v_lat
        F[V_LAT, j] += lateral[4] * e[D_LAT]
        across = (v_lat + F[V_LAT, j]) / 2
        F[X, j] = (v_2 * cos - across * sin) * dt - (moved[Y] - z[Y]) * yaw_1
        F[Y, j] = (v_2 * sin + across * cos) * dt + (moved[X] - z[X]) * yaw_1
        F[YAW, j], F[V, j], F[W, j] = yaw + w_2 / l * dt, v + dv * dt, w + dw * dt
        for i in range(N_MOTION, N_STATE):
            F[i, j] = e[i]


@compiled(error_model="numpy")
def slopes_of_measurement(z: F64, theta: F64, H: F64) -> None:
    """``H`` (3, 3) ← ∂measured/∂(x, y, yaw)."""
    cos, sin = np.cos(z[YAW]), np.sin(z[YAW])
    for i in range(3):
        for j in range(3):
            H[i, j] = UNIT[i, j]
    H[X, YAW] = -sin * theta[Theta.ARM_X] - cos * theta[Theta.ARM_Y]
    H[Y, YAW] = cos * theta[Theta.ARM_X] - sin * theta[Theta.ARM_Y]

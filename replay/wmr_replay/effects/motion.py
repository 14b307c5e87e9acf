"""Accelerations of the body and torque lost at the wheels, with their slopes.

v and w = l·yaw_rate are the body's speeds in m/s, v ± w the ground speeds of the right and the left wheel.
Each function adds to the values it is given, so that every caller sums in one order. Effects after ISO 8855.
"""

import math
from typing import NamedTuple

from wmr_replay.effects.theta import Theta
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean
from wmr_schemas.robot import RobotParameters
from wmr_schemas.terms import SOFT_SIGN

Pair = tuple[float, float]
Four = tuple[float, float, float, float]

LEAST_FRICTION = 1e-4
"""m/s² or N·m: a smaller friction changes no speed that a pose shows."""
NEARLY_SLIDING = 6.0
"""At so many v₀, friction is within 1e-5 of its whole size."""
WITHIN_A_STEP_MPS = 0.03
"""What a step of 50 ms may change a speed by, half-way, at 1 m/s²."""


@lean
def sign(speed: float, over: float = SOFT_SIGN) -> float:
    """sgn(speed) as tanh(speed/over), both in m/s: friction changes its sign over 2 cm/s as a rule."""
    return float(math.tanh(speed / over))


@lean
def steepness(speed: float, over: float) -> float:
    """Slope of :func:`sign`, in 1/(m/s)."""
    return float((1.0 - sign(speed, over) ** 2) / over)


@lean
def friction_speed(theta: F64) -> float:
    """The speed in m/s over which the friction in θ changes its sign."""
    own = theta[Theta.FRICTION_SPEED]
    return float(own) if own > 0.0 else SOFT_SIGN


@lean
def is_held(v: float, w: float, theta: F64) -> bool:
    """Whether a dry friction may change within a step: the body or a wheel is near standstill."""
    near = NEARLY_SLIDING * friction_speed(theta) + WITHIN_A_STEP_MPS
    rolling = theta[Theta.ROLLING] > LEAST_FRICTION and abs(v) < near
    turning = theta[Theta.SCRUB] > LEAST_FRICTION and abs(w) < near
    wheels = theta[Theta.WHEEL_COULOMB] > LEAST_FRICTION and abs(abs(v) - abs(w)) < near
    dragging = max(theta[Theta.SUPPORT], theta[Theta.SUPPORT_YAW]) > LEAST_FRICTION
    supports = dragging and abs(v) < near and abs(w) < near
    return bool(rolling or turning or wheels or supports)


@lean
def wheel_losses(right: float, left: float, theta: F64) -> Pair:
    """Torque in N·m lost at the right and the left wheel, of ground speeds in m/s: τ sgn(s) + c s."""
    if theta[Theta.WHEEL_COULOMB] == 0.0 and theta[Theta.WHEEL_VISCOUS] == 0.0:
        return 0.0, 0.0
    over = friction_speed(theta)
    lost_right = theta[Theta.WHEEL_COULOMB] * sign(right, over) + theta[Theta.WHEEL_VISCOUS] * right
    lost_left = theta[Theta.WHEEL_COULOMB] * sign(left, over) + theta[Theta.WHEEL_VISCOUS] * left
    return lost_right, lost_left


@lean
def wheel_slopes(right: float, left: float, theta: F64) -> Pair:
    """Slopes of :func:`wheel_losses`, each by its own wheel's speed, in N·m/(m/s)."""
    if theta[Theta.WHEEL_COULOMB] == 0.0 and theta[Theta.WHEEL_VISCOUS] == 0.0:
        return 0.0, 0.0
    over = friction_speed(theta)
    by_right = theta[Theta.WHEEL_COULOMB] * steepness(right, over) + theta[Theta.WHEEL_VISCOUS]
    by_left = theta[Theta.WHEEL_COULOMB] * steepness(left, over) + theta[Theta.WHEEL_VISCOUS]
    return by_right, by_left


@lean
def downhill_left(yaw: float, theta: F64) -> Pair:
    """Acceleration to the left on a slope, g_y cos ψ − g_x sin ψ in m/s², and its slope by yaw.

    It is the slope by yaw of the acceleration ahead.
    """
    if theta[Theta.GRADE_X] == 0.0 and theta[Theta.GRADE_Y] == 0.0:
        return 0.0, 0.0
    cos, sin = math.cos(yaw), math.sin(yaw)
    left = theta[Theta.GRADE_Y] * cos - theta[Theta.GRADE_X] * sin
    return left, -theta[Theta.GRADE_Y] * sin - theta[Theta.GRADE_X] * cos


class Carried(NamedTuple):
    """What weighs on the axle: k = l m/I of the base model in 1/m, 0 where unknown, and how many times as
    heavy the robot is with the load that it carries for a while.
    """

    com_yaw_per_m: float
    load: float


@lean
def carried_share(load: float, theta: F64) -> float:
    """``load`` (1 + mass_ratio)/(1 + ratio), the ratios those of payload and yaw_inertia: how much more what
    a weight makes tyres do turns the robot. A payload sits at the centre of mass.
    """
    return float(load * (1.0 + theta[Theta.MASS_RATIO]) / (1.0 + theta[Theta.YAW_INERTIA]))


@lean
def turning_arm(carried: Carried, theta: F64) -> float:
    """How much a centre of mass d ahead of the axle turns the robot by what the tyres hold sideways, k d q
    with q of :func:`carried_share`.
    """
    return float(carried.com_yaw_per_m * carried_share(carried.load, theta) * theta[Theta.COM_OFFSET])


@lean
def by_supports(v: float, w: float, carried: Carried, theta: F64) -> Pair:
    """What supports that drag add to (dv_long/dt, dw/dt) in m/s²: −(p₀ v, d₀ q w)/V, V² = v² + w² + v₀².

    A ball, a pad or a caster that trails its pin takes a dry force against the way that it goes: (v, w) at a
    distance l ahead of the axle or behind it. The faster the robot goes ahead, the less of it turns; q is of
    :func:`carried_share`, v₀ the speed over which friction changes its sign.
    """
    speed = math.sqrt(v * v + w * w + friction_speed(theta) ** 2)
    turning = theta[Theta.SUPPORT_YAW] * carried_share(carried.load, theta)
    return -theta[Theta.SUPPORT] * v / speed, -turning * w / speed


@lean
def support_slopes(v: float, w: float, carried: Carried, theta: F64) -> Four:
    """Slopes of :func:`by_supports`: of dv_long/dt by v and w, of dw/dt by v and w."""
    squared = v * v + w * w + friction_speed(theta) ** 2
    cubed = squared * math.sqrt(squared)
    ahead = theta[Theta.SUPPORT] / cubed
    turning = theta[Theta.SUPPORT_YAW] * carried_share(carried.load, theta) / cubed
    return ahead * (v * v - squared), ahead * v * w, turning * v * w, turning * (w * w - squared)


@lean
def with_body_effects(given: Pair, v: float, turning: Pair, yaw: float, carried: Carried, theta: F64) -> Pair:
    """``given`` (dv_long/dt, dw/dt) in m/s² plus the effects on the body; ``turning`` is (w, yaw_rate).

    dv_long/dt: −c₁ v − c₂ v|v| + d yaw_rate² − c₀ sgn v + g_x cos ψ + g_y sin ψ
    dw/dt:      −d₁ w − e₂ V w − k d q (v yaw_rate − g_left) − d₀ q sgn w

    with q of :func:`carried_share`, the arm k d q of :func:`turning_arm` and g_left of
    :func:`downhill_left`: tyres at the axle hold against the pull of a slope on a mass that lies d ahead of
    it, and scrub by the weight on them. Supports that drag add :func:`by_supports`.
    """
    (dv, dw), (w, yaw_rate) = given, turning
    com = turning_arm(carried, theta)
    dv -= theta[Theta.VISCOUS] * v + theta[Theta.DRAG] * v * abs(v)
    dv += theta[Theta.COM_OFFSET] * yaw_rate**2
    dw -= theta[Theta.YAW_DAMPING] * w
    dw -= com * v * yaw_rate
    if theta[Theta.DRAG_YAW] != 0.0:
        dw -= theta[Theta.DRAG_YAW] * math.hypot(v, w) * w
    if theta[Theta.ROLLING] != 0.0:
        dv -= theta[Theta.ROLLING] * sign(v, friction_speed(theta))
    if theta[Theta.SCRUB] != 0.0:
        scrub = theta[Theta.SCRUB] * carried_share(carried.load, theta)
        dw -= scrub * sign(w, friction_speed(theta))
    if theta[Theta.SUPPORT] != 0.0 or theta[Theta.SUPPORT_YAW] != 0.0:
        ahead, turned = by_supports(v, w, carried, theta)
        dv, dw = dv + ahead, dw + turned
    if theta[Theta.GRADE_X] != 0.0 or theta[Theta.GRADE_Y] != 0.0:
        dv += theta[Theta.GRADE_X] * math.cos(yaw) + theta[Theta.GRADE_Y] * math.sin(yaw)
        dw += com * downhill_left(yaw, theta)[0]
    return dv, dw


@lean
def drag_slopes(v: float, w: float, theta: F64) -> Pair:
    """Slopes of −e₂ w √(v² + w²), what a medium brakes turns, by v and w."""
    speed = math.hypot(v, w)
    if speed == 0.0:
        return 0.0, 0.0
    across = theta[Theta.DRAG_YAW] / speed
    return -across * v * w, -across * (v * v + 2 * w * w)


@lean
def with_body_slopes(given: Four, v: float, w: float, l: float, carried: Carried, theta: F64) -> Four:
    """``given`` slopes of (dv_long/dt by v, by w, dw/dt by v, by w) and those of the effects on the body."""
    v_v, v_w, w_v, w_w = given
    yaw_rate, com = w / l, turning_arm(carried, theta)
    v_v += -theta[Theta.VISCOUS] - 2 * theta[Theta.DRAG] * abs(v)
    v_w += 2 * theta[Theta.COM_OFFSET] * yaw_rate / l
    w_v += -com * yaw_rate
    w_w += -theta[Theta.YAW_DAMPING] - com * v / l
    if theta[Theta.DRAG_YAW] != 0.0:
        by_v, by_w = drag_slopes(v, w, theta)
        w_v, w_w = w_v + by_v, w_w + by_w
    if theta[Theta.ROLLING] != 0.0:
        v_v -= theta[Theta.ROLLING] * steepness(v, friction_speed(theta))
    if theta[Theta.SCRUB] != 0.0:
        scrub = theta[Theta.SCRUB] * carried_share(carried.load, theta)
        w_w -= scrub * steepness(w, friction_speed(theta))
    if theta[Theta.SUPPORT] != 0.0 or theta[Theta.SUPPORT_YAW] != 0.0:
        by = support_slopes(v, w, carried, theta)
        v_v, v_w, w_v, w_w = v_v + by[0], v_w + by[1], w_v + by[2], w_w + by[3]
    return v_v, v_w, w_v, w_w


@lean
def pull_in_skid(yaw: float, theta: F64) -> Pair:
    """What of :func:`downhill_left` moves v_lat while the tyres are said to skid: all, or nothing."""
    return (0.0, 0.0) if theta[Theta.HELD_SIDEWAYS] > 0.0 else downhill_left(yaw, theta)


def com_yaw_per_m(robot: RobotParameters) -> float:
    """L m/I in 1/m, by which a centre of mass ahead of the axle turns the robot.

    Without masses it is α_yaw/(α l), since α_yaw/α = l² m/I; 0 where that is unknown as well.
    """
    if robot.half_track_m is None:
        return 0.0
    if robot.mass_kg is not None and robot.yaw_inertia_kgm2 is not None:
        return robot.half_track_m * robot.mass_kg / robot.yaw_inertia_kgm2
    if robot.alpha and robot.alpha_yaw is not None:
        return robot.alpha_yaw / (robot.alpha * robot.half_track_m)
    return 0.0

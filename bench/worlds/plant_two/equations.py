"""The second plant's equations of motion, in robot conventions, and their integration.

State: x, y, yaw, v (ahead), w (left), q (yaw rate), torques behind the actuators (left, right), s (share of
slipping, 0 to 1). With U the sum of the wheels' torques, D right minus left, V = √(v² + w² + l²q²) ≥ .3 m/s:

    ẋ = v cos yaw − w sin yaw         ẏ = v sin yaw + w cos yaw         yaẇ = q
    v̇ = α U g_long + body forces (+ w q/3 while skidding)
    l q̇ = α_yaw D g_yaw + body moments
    skidding    ẇ = −(c/V) w − v q,  c = 2 G_x/(ε m)
    otherwise   ẇ = −(w + κ v q)/.02 s: an elastic sideslip of a few mm/s
    slipping    ṡ = (1 − s)/.03 s, else ṡ = −s/.03 s;  g = 1 − s (1 − share that slipping leaves)

The share that slipping leaves is that of the settled σ: its poles lie far above any log's rate. The order of
a torque's way: delay, actuator, gain and bias, dead zone, saturation, friction at the wheel.

All compiled code of this plant is in this file, since numba's cache looks at one file alone.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

X, Y, YAW, V, W, Q, LEFT, RIGHT, SLIP = range(9)
N_STATES = 9
STEPS_PER_COMMAND = 4
SKIDDING, SLIPPING = 1, 2
SIDESLIP_S, SLIP_ONSET_S = 0.02, 0.03
SPEED_FLOOR_MPS = 0.3
FRICTION_MPS = 0.03
"""Dry friction has three quarters of its size at this speed."""


class Robot(NamedTuple):
    """What the equations need of a robot; ``compliance_s`` is κ."""

    alpha: float
    alpha_yaw: float
    half_track_m: float
    wheel_radius_m: float
    skid_decay_mps2: float
    share_long: float
    share_yaw: float
    mass_over_yaw_inertia: float
    compliance_s: float


class Hidden(NamedTuple):
    """Sizes of hidden effects in the units of their declarations; 0 where absent."""

    payload: float = 0.0
    yaw_inertia: float = 0.0
    drive_gain: float = 0.0
    rolling_resistance: float = 0.0
    viscous_drag: float = 0.0
    aerodynamic_drag: float = 0.0
    scrub_torque: float = 0.0
    yaw_damping: float = 0.0
    wheel_coulomb: float = 0.0
    wheel_viscous: float = 0.0
    slope_x: float = 0.0
    slope_y: float = 0.0
    torque_imbalance: float = 0.0
    torque_bias_common: float = 0.0
    torque_bias_differential: float = 0.0
    actuator_lag: float = 0.0
    input_delay: float = 0.0
    torque_deadzone: float = 0.0
    torque_saturation: float = 0.0
    com_offset: float = 0.0
    cornering_stiffness: float = 0.0
    load_ratio: float = 0.0
    load_t0_s: float = 0.0
    interval_start_s: float = 0.0
    interval_end_s: float = 0.0
    interval_loss: float = 0.0
    patch_x_m: float = 0.0
    patch_y_m: float = 0.0
    patch_radius_m: float = 0.0
    patch_loss: float = 0.0


class Control(NamedTuple):
    """Gains of the controller in 1/s and 1/s², limit of a wheel's torque, period of the commands."""

    proportional_per_s: float
    integral_per_s2: float
    limit_nm: float
    period_s: float


@njit(cache=True, error_model="numpy")
def dry(speed, scale):
    """A smooth sign."""
    return math.tanh(speed / scale)


@njit(cache=True, error_model="numpy")
def delayed(commands, index, t, period, delay):
    """The command in force, or delayed by fractional interpolation between two commands."""
    if delay <= 0.0:
        return commands[index]
    place = max((t - delay) / period + 0.5, 0.0)
    k = min(int(place), index)
    share = place - k
    return (1 - share) * commands[max(k - 1, 0)] + share * commands[k]


@njit(cache=True, error_model="numpy")
def softplus(value, width):
    """max(value, 0) with a round corner."""
    part = value / width
    return value if part > 30.0 else width * math.log1p(math.exp(part))


@njit(cache=True, error_model="numpy")
def wheel_torque(torque, side, wheel_speed, robot, hidden):
    """What one wheel's torque is behind gain, bias, dead zone, saturation and friction; side −1 is left."""
    u = torque
    if hidden.drive_gain != 0.0:
        small = math.exp(-((u * 2 * robot.alpha / 0.1) ** 2))
        u *= 1 + hidden.drive_gain * (1 - 0.1 * small)
    u *= 1 + side * hidden.torque_imbalance
    u += hidden.torque_bias_common + side * hidden.torque_bias_differential
    if hidden.torque_deadzone > 0.0:
        width = 0.08 * hidden.torque_deadzone
        passed = softplus(abs(u) - hidden.torque_deadzone, width) - softplus(-hidden.torque_deadzone, width)
        u = math.copysign(passed, u)
    if hidden.torque_saturation > 0.0:
        u /= (1 + (abs(u) / hidden.torque_saturation) ** 4) ** 0.25
    u -= hidden.wheel_coulomb * dry(wheel_speed * robot.wheel_radius_m, FRICTION_MPS)
    return u - hidden.wheel_viscous * wheel_speed


@njit(cache=True, error_model="numpy")
def resistance(v, hidden):
    """Acceleration ahead by rolling resistance and drags: a tanh and polynomials of the speed."""
    rolling = hidden.rolling_resistance * dry(v, FRICTION_MPS) * (1 + 0.1 * v * v / (1 + v * v))
    viscous = hidden.viscous_drag * v * (1 + 0.1 * abs(v)) / 1.1
    return -rolling - viscous - hidden.aerodynamic_drag * v * math.sqrt(v * v + 0.04)


@njit(cache=True, error_model="numpy")
def slope(x, y, yaw, hidden):
    """Acceleration ahead by gravity on ground that undulates by a seventh of its slope, over 7 m."""
    waves = 1 + 0.14 * math.sin(2 * math.pi * (0.8 * x + 0.6 * y) / 7.0)
    return waves * (hidden.slope_x * math.cos(yaw) + hidden.slope_y * math.sin(yaw))


@njit(cache=True, error_model="numpy")
def edge(value, width):
    """From 0 to 1 about 0; half-way at 0."""
    return 0.5 * (1 + math.tanh(value / width))


@njit(cache=True, error_model="numpy")
def traction_loss(t, x, y, hidden):
    """Share of traction lost in the interval and on the patch, and on the patch alone (tyres' side)."""
    interval = patch = 0.0
    if hidden.interval_loss > 0.0:
        inside = edge(t - hidden.interval_start_s, 0.1) * edge(hidden.interval_end_s - t, 0.1)
        interval = hidden.interval_loss * inside
    if hidden.patch_loss > 0.0:
        distance = math.hypot(x - hidden.patch_x_m, y - hidden.patch_y_m)
        patch = hidden.patch_loss * edge(hidden.patch_radius_m - distance, 0.15)
    return 1 - (1 - interval) * (1 - patch), patch


@njit(cache=True, error_model="numpy")
def load(t, hidden):
    """Mass ratio: the payload, and a load that comes within .2 s."""
    if hidden.load_ratio == 0.0:
        return hidden.payload
    return hidden.payload + hidden.load_ratio * min(max((t - hidden.load_t0_s) / 0.2 + 0.5, 0.0), 1.0)


@njit(cache=True, error_model="numpy")
def accelerations(state, t, disturbance, robot, hidden):
    """dv/dt and l·dq/dt without the skid's coupling."""
    v, q, l = state[V], state[Q], robot.half_track_m
    right_speed, left_speed = (v + l * q) / robot.wheel_radius_m, (v - l * q) / robot.wheel_radius_m
    right = wheel_torque(state[RIGHT], 1.0, right_speed, robot, hidden)
    left = wheel_torque(state[LEFT], -1.0, left_speed, robot, hidden)
    loss, _ = traction_loss(t, state[X], state[Y], hidden)
    left_over = 1 - loss
    alpha = robot.alpha / (1 + load(t, hidden))
    alpha_yaw = robot.alpha_yaw / (1 + hidden.yaw_inertia)
    long = alpha * (right + left) * left_over * (1 - state[SLIP] * (1 - robot.share_long))
    turn = alpha_yaw * (right - left) * left_over * (1 - state[SLIP] * (1 - robot.share_yaw))
    long += resistance(v, hidden) + slope(state[X], state[Y], state[YAW], hidden)
    turn -= hidden.scrub_torque * dry(l * q, FRICTION_MPS) * (1 + 0.1 * math.exp(-abs(l * q) / 0.2))
    turn -= hidden.yaw_damping * l * q
    long += hidden.com_offset * q * q
    turn -= hidden.com_offset * l * robot.mass_over_yaw_inertia * v * q
    return long + disturbance[0], turn + disturbance[2]


@njit(cache=True, error_model="numpy")
def rates(state, t, mode, torques, disturbance, robot, hidden, out):
    """The state's time derivative into ``out``; ``torques`` (left, right) behind the delay."""
    v, w, q, l = state[V], state[W], state[Q], robot.half_track_m
    cosine, sine = math.cos(state[YAW]), math.sin(state[YAW])
    long, turn = accelerations(state, t, disturbance, robot, hidden)
    out[X], out[Y], out[YAW] = v * cosine - w * sine, v * sine + w * cosine, q
    out[V], out[Q] = long, turn / l
    if mode == SKIDDING:
        _, patch = traction_loss(t, state[X], state[Y], hidden)
        softer = (1 + hidden.cornering_stiffness) * (1 - patch) / (1 + load(t, hidden))
        speed = max(math.sqrt(v * v + w * w + l * l * q * q), SPEED_FLOOR_MPS)
        out[W] = -robot.skid_decay_mps2 * softer / speed * w - v * q + disturbance[1]
        out[V] += w * q / 3
    else:
        out[W] = -(w + robot.compliance_s * v * q) / SIDESLIP_S
    out[SLIP] = ((1.0 if mode == SLIPPING else 0.0) - state[SLIP]) / SLIP_ONSET_S
    out[LEFT] = out[RIGHT] = 0.0
    if hidden.actuator_lag > 0.0:
        for side in range(2):
            error = torques[side] - state[LEFT + side]
            growing = error * torques[side] > 0
            out[LEFT + side] = error / (hidden.actuator_lag * (1.1 if growing else 0.9))


@njit(cache=True, error_model="numpy")
def step(  # noqa: PLR0913, PLR0917 – one compiled step
    state, t, h, mode, torques, disturbance, robot, hidden, work
):
    """One step of the classical fourth-order method of Runge and Kutta; ``work`` (5, states).

    ``disturbance`` (2, 3) at both ends of the step is joined by a straight line.
    """
    k1, k2, k3, k4, at = work[0], work[1], work[2], work[3], work[4]
    middle = 0.5 * (disturbance[0] + disturbance[1])
    rates(state, t, mode, torques, disturbance[0], robot, hidden, k1)
    at[:] = state + 0.5 * h * k1
    rates(at, t + 0.5 * h, mode, torques, middle, robot, hidden, k2)
    at[:] = state + 0.5 * h * k2
    rates(at, t + 0.5 * h, mode, torques, middle, robot, hidden, k3)
    at[:] = state + h * k3
    rates(at, t + h, mode, torques, disturbance[1], robot, hidden, k4)
    state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


@njit(cache=True, error_model="numpy")
def command(state, k, references, integral, control, robot):
    """Torques (left, right) that the controller asks for, in feedforward and PI, within the limit."""
    period, last = control.period_s, references.shape[1] - 1
    wanted = np.empty(2)
    for axis in range(2):
        slope_ahead = (references[axis, min(k + 1, last)] - references[axis, k]) / period
        error = references[axis, k] - (state[V] if axis == 0 else state[Q])
        held = integral[axis] + error * period
        wanted[axis] = (
            slope_ahead + control.proportional_per_s * error + control.integral_per_s2 * integral[axis]
        )
        if abs(wanted[axis]) < 2 * robot.alpha * control.limit_nm:
            integral[axis] = held
    both, turn = wanted[0] / robot.alpha, wanted[1] * robot.half_track_m / robot.alpha_yaw
    left, right = 0.5 * (both - turn), 0.5 * (both + turn)
    limit = control.limit_nm
    return min(max(left, -limit), limit), min(max(right, -limit), limit)


@njit(cache=True, error_model="numpy")
def drive(start, references, modes, disturbance, control, robot, hidden):
    """The controlled motion: states (n·per + 1, states) at the integrator's steps, commands (2, n).

    ``references`` (2, n) and ``disturbance`` (n + 1, 3) at the commands' period; ``modes`` (n·per) at the
    integrator's steps.
    """
    n = references.shape[1]
    per = len(modes) // n
    h = control.period_s / per
    states = np.empty((n * per + 1, N_STATES))
    commands = np.zeros((2, n))
    integral, torques, work = np.zeros(2), np.zeros(2), np.empty((5, N_STATES))
    between = np.empty((2, 3))
    state = start.copy()
    states[0] = state
    for k in range(n):
        commands[0, k], commands[1, k] = command(state, k, references, integral, control, robot)
        for j in range(per):
            t = k * control.period_s + j * h
            for side in range(2):
                torques[side] = delayed(commands[side], k, t + 0.5 * h, control.period_s, hidden.input_delay)
                if hidden.actuator_lag == 0.0:
                    state[LEFT + side] = torques[side]
            for end in range(2):
                share = (j + end) / per
                between[end] = (1 - share) * disturbance[k] + share * disturbance[k + 1]
            step(state, t, h, modes[k * per + j], torques, between, robot, hidden, work)
            states[k * per + j + 1] = state
    return states, commands

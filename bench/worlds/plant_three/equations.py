"""The third plant's equations of motion, in robot conventions, and their integration.

State: x, y, yaw, v (ahead), w (left), q (yaw rate), torques behind the actuators (left, right), s (share of
slipping, 0 to 1), ṡ, b (lateral tyre force by mass). V = √(v² + w² + l²q²) ≥ .3 m/s:

    skidding    ẇ = b − v q,  ḃ = (V/.03 m)(−c φ (1 − z + z²/3) − b),  φ = w/V, z = |φ|/3 rad: a brush
                tyre with a relaxation length
    otherwise   ẇ = −(w + κ v q) V/.03 m: an elastic sideslip that builds up along the path
    s           follows slipping as a critically damped system of 20 ms
    g = 1 − s (1 − share √(1 − (v q/μg)²)): friction that the side force takes is not there ahead

The torques' way is that of the second plant: delay, actuator, gain and bias, dead zone, saturation, friction
at the wheel. Heun's method, eight steps a command. The controller filters what it feeds back.

All compiled code of this plant is in this file, since numba's cache looks at one file alone.
"""

import math

import numpy as np
from numba import njit

X, Y, YAW, V, W, Q, LEFT, RIGHT, SLIP, SLIP_RATE, SIDE = range(11)
N_STATES = 11
STEPS_PER_COMMAND = 8
SKIDDING, SLIPPING = 1, 2
RELAXATION_M, SIDE_S, SLIP_S = 0.03, 0.02, 0.02
SPEED_FLOOR_MPS = 0.3
SLIDE_RAD = 1.0
GRIP_MPS2 = 8.0
FRICTION_MPS = 0.012
PACKET_S = 0.02
"""Delayed commands come in packets of this period."""
FEEDBACK_S = 0.03


@njit(cache=True, error_model="numpy")
def dry(speed):
    """A smooth sign."""
    return 2.0 / math.pi * math.atan(speed / FRICTION_MPS)


@njit(cache=True, error_model="numpy")
def delayed(commands, index, t, period, delay):
    """The command in force; delayed, the one of the last packet."""
    if delay <= 0.0:
        return commands[index]
    arrived = PACKET_S * math.floor((t - delay + 0.5 * PACKET_S) / PACKET_S)
    return commands[min(max(int(arrived / period + 1e-6), 0), index)]


@njit(cache=True, error_model="numpy")
def corner(value, width):
    """max(value, 0) by a hyperbola."""
    return 0.5 * (value + math.sqrt(value * value + width * width))


@njit(cache=True, error_model="numpy")
def wheel_torque(torque, side, wheel_speed, robot, hidden):
    """What one wheel's torque is behind gain, bias, dead zone, saturation and friction; side −1 is left."""
    u, speed = torque, abs(wheel_speed) * robot.wheel_radius_m
    if hidden.drive_gain != 0.0:
        u *= 1 + hidden.drive_gain * (1.03 - 0.08 * speed / (1 + speed))
    u *= 1 + side * hidden.torque_imbalance
    u += hidden.torque_bias_common + side * hidden.torque_bias_differential
    zone, limit = hidden.torque_deadzone, hidden.torque_saturation
    if zone > 0.0:
        u = math.copysign(corner(abs(u) - zone, 0.1 * zone) - corner(-zone, 0.1 * zone), u)
    if limit > 0.0 and abs(u) > 0.85 * limit:
        beyond = (abs(u) - 0.85 * limit) / (0.15 * limit)
        u = math.copysign(limit * (0.85 + 0.15 * (1 - math.exp(-beyond))), u)
    u -= hidden.wheel_coulomb * dry(wheel_speed * robot.wheel_radius_m) * (1 + 0.15 * math.exp(-speed / 0.1))
    return u - hidden.wheel_viscous * wheel_speed


@njit(cache=True, error_model="numpy")
def resistance(v, hidden):
    """Acceleration ahead by rolling resistance that falls a little with speed, and by drags."""
    rolling = hidden.rolling_resistance * dry(v) * (0.95 + 0.1 * math.exp(-abs(v) / 0.3))
    viscous = hidden.viscous_drag * v * (0.96 + 0.12 * math.exp(-v * v))
    return -rolling - viscous - hidden.aerodynamic_drag * v * (abs(v) + 0.05)


@njit(cache=True, error_model="numpy")
def slope(x, y, yaw, hidden):
    """Acceleration ahead by gravity on ground whose slope varies by an eighth, over 9 m."""
    waves = 1 + 0.125 * math.cos(2 * math.pi * (x - 0.5 * y) / 9.0)
    return waves * (hidden.slope_x * math.cos(yaw) + hidden.slope_y * math.sin(yaw))


@njit(cache=True, error_model="numpy")
def ramp(value, width):
    """From 0 to 1 over ``width`` by a cubic, half-way at 0."""
    share = min(max(value / width + 0.5, 0.0), 1.0)
    return share * share * (3 - 2 * share)


@njit(cache=True, error_model="numpy")
def traction_loss(t, x, y, hidden):
    """Share of traction lost in the interval and on the patch, and on the patch alone (tyres' side)."""
    interval = patch = 0.0
    if hidden.interval_loss > 0.0:
        inside = ramp(t - hidden.interval_start_s, 0.3) * ramp(hidden.interval_end_s - t, 0.3)
        interval = hidden.interval_loss * inside
    if hidden.patch_loss > 0.0:
        distance = math.hypot(x - hidden.patch_x_m, y - hidden.patch_y_m)
        patch = hidden.patch_loss * ramp(hidden.patch_radius_m - distance, 0.4)
    return 1 - (1 - interval) * (1 - patch), patch


@njit(cache=True, error_model="numpy")
def load(t, hidden):
    """Mass ratio: the payload, and a load that settles within tenths of a second."""
    if hidden.load_ratio == 0.0 or t < hidden.load_t0_s:
        return hidden.payload
    return hidden.payload + hidden.load_ratio * (1 - math.exp(-(t - hidden.load_t0_s) / 0.15))


@njit(cache=True, error_model="numpy")
def grip(slip, side_mps2, share):
    """What slipping leaves of the torques' acceleration, beside a side force."""
    taken = min(side_mps2 / GRIP_MPS2, 0.7)
    return 1 - slip * (1 - share * math.sqrt(1 - taken * taken))


@njit(cache=True, error_model="numpy")
def accelerations(state, t, disturbance, robot, hidden):
    """dv/dt and l·dq/dt without the skid's coupling."""
    v, q, l = state[V], state[Q], robot.half_track_m
    right_speed, left_speed = (v + l * q) / robot.wheel_radius_m, (v - l * q) / robot.wheel_radius_m
    right = wheel_torque(state[RIGHT], 1.0, right_speed, robot, hidden)
    left = wheel_torque(state[LEFT], -1.0, left_speed, robot, hidden)
    loss, _ = traction_loss(t, state[X], state[Y], hidden)
    slip, side = min(max(state[SLIP], 0.0), 1.0), abs(v * q)
    long = (
        robot.alpha / (1 + load(t, hidden)) * (right + left) * (1 - loss) * grip(slip, side, robot.share_long)
    )
    turn = robot.alpha_yaw / (1 + hidden.yaw_inertia) * (right - left)
    turn *= (1 - loss) * grip(slip, side, robot.share_yaw)
    long += resistance(v, hidden) + slope(state[X], state[Y], state[YAW], hidden)
    turn -= hidden.scrub_torque * dry(l * q) * (0.97 + 0.08 * math.exp(-abs(l * q) / 0.1))
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
    speed = max(math.sqrt(v * v + w * w + l * l * q * q), SPEED_FLOOR_MPS)
    if mode == SKIDDING:
        _, patch = traction_loss(t, state[X], state[Y], hidden)
        stiffness = (
            robot.skid_decay_mps2 * (1 + hidden.cornering_stiffness) * (1 - patch) / (1 + load(t, hidden))
        )
        angle = w / speed
        z = min(abs(angle) / (3 * SLIDE_RAD), 1.0)
        force = -stiffness * angle * (1 - z + z * z / 3)
        out[SIDE] = (force - state[SIDE]) * speed / RELAXATION_M
        out[W] = state[SIDE] - v * q + disturbance[1]
        out[V] += w * q / 3
    else:
        out[SIDE] = -state[SIDE] / SIDE_S
        out[W] = -(w + robot.compliance_s * v * q) * speed / RELAXATION_M
    slips = 1.0 if mode == SLIPPING else 0.0
    out[SLIP] = state[SLIP_RATE]
    out[SLIP_RATE] = (slips - state[SLIP]) / SLIP_S**2 - 2 * state[SLIP_RATE] / SLIP_S
    out[LEFT] = out[RIGHT] = 0.0
    if hidden.actuator_lag > 0.0:
        for side in range(2):
            large = (2 * robot.alpha * state[LEFT + side]) ** 2
            out[LEFT + side] = (torques[side] - state[LEFT + side]) / (
                hidden.actuator_lag * (0.9 + 0.2 / (1 + large))
            )


@njit(cache=True, error_model="numpy")
def step(  # noqa: PLR0913, PLR0917 – one compiled step
    state, t, h, mode, torques, disturbance, robot, hidden, work
):
    """One step of Heun's method; ``work`` (3, states). ``disturbance`` (2, 3) at both ends of the step."""
    rates(state, t, mode, torques, disturbance[0], robot, hidden, work[0])
    work[2][:] = state + h * work[0]
    rates(work[2], t + h, mode, torques, disturbance[1], robot, hidden, work[1])
    state += 0.5 * h * (work[0] + work[1])


@njit(cache=True, error_model="numpy")
def command(wanted, held, felt, integral, control, robot):
    """Torques (left, right) of a PI controller on filtered speeds, within the limit."""
    asked = np.empty(2)
    for axis in range(2):
        error = wanted[axis] - felt[axis]
        slope_ahead = 0.8 * (wanted[axis] - held[axis]) / control.period_s
        asked[axis] = slope_ahead + control.proportional_per_s * error + integral[axis]
        if abs(asked[axis]) < 2 * robot.alpha * control.limit_nm:
            integral[axis] += control.integral_per_s2 * error * control.period_s
    both, turn = asked[0] / robot.alpha, asked[1] * robot.half_track_m / robot.alpha_yaw
    limit = control.limit_nm
    return min(max(0.5 * (both - turn), -limit), limit), min(max(0.5 * (both + turn), -limit), limit)


@njit(cache=True, error_model="numpy")
def drive(start, references, modes, disturbance, control, robot, hidden):
    """The controlled motion: states (n·per + 1, states) at the integrator's steps, commands (2, n).

    ``references`` (2, n) and ``disturbance`` (n + 1, 3) at the commands' period; ``modes`` (n·per) at the
    integrator's steps.
    """
    n = references.shape[1]
    per = len(modes) // n
    h = control.period_s / per
    states, commands = np.empty((n * per + 1, N_STATES)), np.zeros((2, n))
    integral, torques, work = np.zeros(2), np.zeros(2), np.empty((3, N_STATES))
    between, felt = np.empty((2, 3)), np.array([start[V], start[Q]])
    state = start.copy()
    states[0] = state
    for k in range(n):
        felt[0] += control.period_s / FEEDBACK_S * (state[V] - felt[0])
        felt[1] += control.period_s / FEEDBACK_S * (state[Q] - felt[1])
        before = references[:, max(k - 1, 0)]
        commands[0, k], commands[1, k] = command(references[:, k], before, felt, integral, control, robot)
        for j in range(per):
            t = k * control.period_s + j * h
            for side in range(2):
                torques[side] = delayed(commands[side], k, t, control.period_s, hidden.input_delay)
                if hidden.actuator_lag == 0.0:
                    state[LEFT + side] = torques[side]
            for end in range(2):
                share = (j + end) / per
                between[end] = (1 - share) * disturbance[k] + share * disturbance[k + 1]
            step(state, t, h, modes[k * per + j], torques, between, robot, hidden, work)
            states[k * per + j + 1] = state
    return states, commands

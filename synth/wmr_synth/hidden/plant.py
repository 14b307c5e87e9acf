"""The extended plant's equations, in robot conventions (REP 103), and their integration.

The state keeps the order of ``wmr_synth.plants.two_wheeled``, with other signs:
(x, y, yaw, v_lat, v, w = l·yaw_rate, σ_diff, σ_sum, φ_right, φ_left), and behind it two states of each
actuator. With v̄ the average speed, and torques τ_R, τ_L as they act:

    ẋ = v cos ψ − v_lat sin ψ     ẏ = v sin ψ + v_lat cos ψ     ψ̇ = w/l
    skidding   v̇_lat = −(2G_x/(ε m v̄)) v_lat − v w/l + a_lat
    no slip    v̇ = v_lat w/(3l) + α (τ_R + τ_L) + a_long          ẇ = α_yaw (τ_R − τ_L) + a_turn
    slipping   v̇ = (3k/m) σ_sum + v_lat w/l + a_long              ẇ = (3l²k/I_θ) σ_diff + a_turn
               σ̇_sum = −(r²/I_φ + 2/m) k σ_sum − (2/(3l)) v_lat w + α (τ_R + τ_L)
               σ̇_diff = −(r²/I_φ + 2l²/I_θ) k σ_diff + α_yaw (τ_R − τ_L),      k = G_y/(ε v̄)
    wheels     r φ̇_R = v + w + 1.5 (σ_sum + σ_diff)               r φ̇_L = v − w + 1.5 (σ_sum − σ_diff)

Effects change α, α_yaw, G_x and the torques, or add to a_long, a_lat, a_turn, in every mode alike.
"""

import math

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode
from wmr_synth.hidden import forms
from wmr_synth.hidden.parameters import Hidden
from wmr_synth.plants.two_wheeled import (
    PHI_1,
    PHI_2,
    SIGMA_1,
    SIGMA_2,
    THETA,
    V_THETA,
    V_X,
    V_Y,
    Coefficients,
    X,
    Y,
    average_speed,
    longest_step_s,
)

YAW, V_LAT, V_LONG, TURN = THETA, V_X, V_Y, V_THETA
SIGMA_DIFF, SIGMA_SUM, PHI_RIGHT, PHI_LEFT = SIGMA_1, SIGMA_2, PHI_1, PHI_2
RIGHT_1, RIGHT_2, LEFT_1, LEFT_2 = 10, 11, 12, 13
N_EXTENDED = 14
MAX_STEP_S = 0.001
UNDECLARED_SKID = int(ContactMode.SKIDDING)
"""Compiled code returns the mode as a plain integer."""

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Held = tuple[float, float, float, float, float]
"""Inputs held over a step: shaped torques (left, right), disturbances (longitudinal, lateral, yaw)."""


@compiled
def shaped(u: float, gain: float, bias: float, h: Hidden) -> float:
    """A wheel's torque behind what acts on it at once: gain, bias, dead zone, saturation."""
    through = forms.dead_zone(u * gain + bias, h.deadzone_nm, h.plain)
    return forms.saturation(through, h.saturation_nm, h.plain)


@compiled
def lagged(first: int, u: float, state: F64, h: Hidden, out: F64) -> float:
    """A wheel's torque behind its actuator: two poles of T/2 each; plain one of T."""
    out[first] = out[first + 1] = 0.0
    if h.lag_s == 0.0:
        return u
    if h.plain:
        out[first] = (u - state[first]) / h.lag_s
        return float(state[first])
    out[first] = 2.0 * (u - state[first]) / h.lag_s
    out[first + 1] = 2.0 * (state[first] - state[first + 1]) / h.lag_s
    return float(state[first + 1])


@compiled
def wheel_friction(speed_mps: float, h: Hidden) -> float:
    """Torque lost at a wheel, in N·m."""
    lost = h.wheel_viscous_nm_per_mps * speed_mps
    if h.wheel_coulomb_nm != 0.0:
        lost += h.wheel_coulomb_nm * forms.sign(speed_mps, h.plain)
    return lost


@compiled
def patch_loss(state: F64, h: Hidden) -> float:
    """Share of grip that the ground under N lacks."""
    if h.patch_loss == 0.0:
        return 0.0
    distance = math.hypot(state[X] - h.patch_x_m, state[Y] - h.patch_y_m)
    return forms.patch(h.patch_loss, h.patch_radius_m, distance, h.plain)


@compiled
def body(state: F64, yaw_share: float, carried: float, h: Hidden) -> Triple:
    """(a_long, a_lat, a_turn) of the effects on the body; ``yaw_share`` is α_yaw/α, and the robot is
    ``carried`` times as heavy: tyres scrub by the weight on them.
    """
    v, turn, yaw = state[V_LONG], state[TURN], state[YAW]
    ahead = forms.rolling(h.rolling_mps2, v, h.plain) - h.viscous_per_s * v
    ahead += forms.drag(h.drag_per_m, v, h.plain)
    around = forms.drag_around(h.drag_yaw_per_m, v, turn, h.plain) - h.damping_per_s * turn
    if h.scrub_mps2 != 0.0:
        around -= h.scrub_mps2 * h.weight_by_inertia * carried * forms.sign(turn, h.plain)
    if h.support_mps2 != 0.0 or h.support_yaw_mps2 != 0.0:
        way, turned = forms.trailing(v, turn, h.plain)
        ahead -= h.support_mps2 * way
        around -= h.support_yaw_mps2 * h.weight_by_inertia * carried * turned
    across = 0.0
    if h.grade_x_mps2 != 0.0 or h.grade_y_mps2 != 0.0:
        a_x, a_y = forms.slope(h.grade_x_mps2, h.grade_y_mps2, state[X], state[Y], h.plain)
        ahead += a_x * math.cos(yaw) + a_y * math.sin(yaw)
        across = a_y * math.cos(yaw) - a_x * math.sin(yaw)
    if h.eccentricity_mps2 != 0.0:
        right, left = math.sin(state[PHI_RIGHT]), math.sin(state[PHI_LEFT])
        ahead += 0.5 * h.eccentricity_mps2 * (right + left)
        around += 0.5 * h.eccentricity_mps2 * (right - left) * yaw_share
    return ahead, across, around


@compiled
def com(state: F64, across: float, carried: float, l: float, h: Hidden) -> Pair:
    """(a_long, a_turn) of a centre of mass ahead of the axle, which a slope pulls ``across``; the robot is
    ``carried`` times as heavy.
    """
    yaw_rate = state[TURN] / l
    turned = h.com_yaw * h.weight_by_inertia * carried * (state[V_LONG] * yaw_rate - across)
    return h.com_offset_m * yaw_rate**2, -turned


@compiled
def derivative(mode: int, t: float, state: F64, held: Held, c: Coefficients, h: Hidden, out: F64) -> None:
    """d/dt of the state under held inputs, into ``out``."""
    l, v, v_lat, turn = c.half_track_m, state[V_LONG], state[V_LAT], state[TURN]
    sigma_sum, sigma_diff = state[SIGMA_SUM], state[SIGMA_DIFF]
    cosine, sine = math.cos(state[YAW]), math.sin(state[YAW])
    out[X], out[Y], out[YAW] = v * cosine - v_lat * sine, v * sine + v_lat * cosine, turn / l
    right_mps = v + turn + 1.5 * (sigma_sum + sigma_diff)
    left_mps = v - turn + 1.5 * (sigma_sum - sigma_diff)
    out[PHI_RIGHT], out[PHI_LEFT] = right_mps / c.wheel_radius_m, left_mps / c.wheel_radius_m
    right = lagged(RIGHT_1, held[1], state, h, out) - wheel_friction(right_mps, h)
    left = lagged(LEFT_1, held[0], state, h, out) - wheel_friction(left_mps, h)
    lost = patch_loss(state, h)
    grip = (1.0 - lost) * (1.0 - forms.interval(h.slip_loss, h.slip_start_s, h.slip_end_s, t, h.plain))
    carried = 1.0 + forms.load(h.load_ratio, h.load_s, t, h.plain)
    drive = c.alpha * h.gain_long * grip / carried * (right + left)
    twist = c.alpha_yaw * h.gain_yaw * grip * (right - left)
    ahead, across, around = body(state, c.alpha_yaw / c.alpha, carried, h)
    com_ahead, com_around = com(state, across, carried, l, h)
    ahead, around = ahead + com_ahead + held[2], around + com_around + held[4]
    speed = average_speed(state, c)
    out[V_LAT] = out[SIGMA_SUM] = out[SIGMA_DIFF] = 0.0
    if mode in (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING):
        decay = c.skid_decay_mps2 * (1.0 - lost) / speed
        out[V_LAT] = -decay * v_lat - v * turn / l + across + held[3]
    if mode in (ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING):
        out[V_LONG] = c.slip_to_long_mps2 / speed * sigma_sum + v_lat * turn / l + ahead
        out[TURN] = c.slip_to_yaw_mps2 / speed * sigma_diff + around
        out[SIGMA_SUM] = -c.sigma_2_pole_mps2 / speed * sigma_sum - 2.0 / (3.0 * l) * v_lat * turn + drive
        out[SIGMA_DIFF] = -c.sigma_1_pole_mps2 / speed * sigma_diff + twist
    else:
        out[V_LONG] = v_lat * turn / (3.0 * l) + drive + ahead
        out[TURN] = twist + around
    if h.swivel_mps2 != 0.0 and mode not in (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING):
        free = out[V_LONG] - held[2], out[TURN] - held[4]
        out[TURN] -= forms.swivel(h.swivel_mps2, (v, turn), free, h.plain)


@compiled
def step(
    mode: int,
    t: float,
    state: F64,
    held: Held,
    step_s: float,
    c: Coefficients,
    h: Hidden,
    work: F64,
) -> None:
    """One classical Runge-Kutta step in place; ``work`` is scratch of shape (5, 14)."""
    derivative(mode, t, state, held, c, h, work[0])
    for stage in range(1, 4):
        share = 1.0 if stage == 3 else 0.5
        for i in range(N_EXTENDED):
            work[4, i] = state[i] + share * step_s * work[stage - 1, i]
        derivative(mode, t + share * step_s, work[4], held, c, h, work[stage])
    for i in range(N_EXTENDED):
        state[i] += step_s / 6.0 * (work[0, i] + 2.0 * (work[1, i] + work[2, i]) + work[3, i])


@compiled
def advance(
    mode: int,
    t: float,
    state: F64,
    held: Held,
    dt: float,
    c: Coefficients,
    h: Hidden,
    work: F64,
) -> None:
    """The state ``dt`` seconds later under held inputs, in steps of at most 1 ms."""
    remaining = dt
    while remaining > 0.0:
        longest = min(MAX_STEP_S, longest_step_s(mode, state, c))
        n_steps = math.ceil(remaining / longest * (1.0 - 1e-9))
        step_s = remaining / n_steps
        step(mode, t + dt - remaining, state, held, step_s, c, h, work)
        remaining = remaining - step_s if n_steps > 1 else 0.0


@compiled
def acting(mode: int, undeclared: bool) -> int:
    """The mode that really acts where the schedule says ``mode``."""
    return UNDECLARED_SKID if undeclared and mode == ContactMode.IDEAL else mode

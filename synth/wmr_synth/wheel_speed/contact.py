"""From wheel speeds to the motion over the ground, through friction.

Rolling as the robot does it while its wheels grip, with rim speeds g_i = r_i φ̇_i (1 − loss):

    v_long* = (g_R + g_L)/2    l_e·yaw_rate* = (g_R − g_L)/2    v_lat* = −x_icr·yaw_rate − k·v_long·yaw_rate

What the motion lacks of it are the slip velocities s_R, s_L at the wheels, and sideways q = v_lat − v_lat*.
For each side i (specific forces, load c₀ = g·carried/2, ρ = (gyration/l_e)²):

    grip      f_i = (C c₀/|V_i|) s_i,  f_y,i = −(C c₀/|V_i|) q     elastic slip: force by slip ratio
    friction  f_i² + (f_y,i/e)² ≤ (μ_i c₀)²                        beyond the ellipse a wheel slides
    robot     dv_long/dt = f_R + f_L + v_lat·yaw_rate      l_e·yaw_acc = (f_R − f_L)/ρ
              dq/dt = f_y,R + f_y,L − v_long·yaw_rate

Accelerating within the circle costs a slip ratio of some per mille (a/(2 c₀ C)). On slippery ground the
wheels spin or lock, and in a turn the robot slides outwards; a wheel that spins has no grip left for the
turn, so that both occur together. Each step is implicit in the forces, found by iterating over the two
sides, so that a rigid contact (C infinite) is as stable as a soft one.
"""

import math

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_synth.hidden import forms, rolling_forms
from wmr_synth.hidden.rolling import RollingHidden
from wmr_synth.wheel_speed.drive import (
    A_LONG,
    BUILT_UP,
    DEFLECTED,
    LOST_L,
    LOST_LAT,
    LOST_R,
    PULL_L,
    PULL_R,
    ROUGH_LAT,
    ROUGH_LONG,
    ROUGH_TURN,
    SKID,
    SLIP_L,
    SLIP_R,
    TURN,
    V_LAT,
    W_L,
    W_R,
    YAW,
    YAW_ACC,
    Rig,
    V,
    X,
    Y,
    share_of,
)

LEAST_SPEED_MPS = 0.1
"""A wheel that hardly moves is as stiff as one of this speed."""
ROUND_S = 0.1
"""Unevenness reaches the wheels through a first-order lag: its slip has a finite acceleration."""
N_ITERATIONS, N_NEWTON = 8, 6
Pair = tuple[float, float]
Triple = tuple[float, float, float]
Four = tuple[float, float, float, float]


@compiled
def kept_by(side: float, t: float, state: F64, h: RollingHidden) -> float:
    """Share of the speed of the right wheel (side 1) or the left (−1) that the hidden effects leave, in time
    or in a disc.
    """
    lost = h.slip_loss + side * h.slip_apart
    kept = 1.0 - forms.interval(lost, h.slip_start_s, h.slip_end_s, t, h.plain)
    if h.patch_loss != 0.0 or h.patch_apart != 0.0:
        distance = math.hypot(state[X] - h.patch_x_m, state[Y] - h.patch_y_m)
        kept *= 1.0 - forms.patch(h.patch_loss + side * h.patch_apart, h.patch_radius_m, distance, h.plain)
    return kept


@compiled
def gripped(
    rims: Pair, rough: Pair, dt: float, kept: Pair, drift_mps: float, state: F64, rig: Rig, h: RollingHidden
) -> Four:
    """(v_long*, l_e·yaw_rate*) of the rims (right, left), and what of their mean and of half their difference
    is the robot's own slip by a hidden effect.

    ``rough`` are the slips by uneven ground, ``drift_mps`` a slope's drift ahead.
    """
    right, left = rims[0] * kept[0], rims[1] * kept[1]
    mean, half = 0.5 * (right + left), 0.5 * (right - left)
    yaw_rate = state[TURN] / rig.half_track_m
    ahead = mean * (
        1.0 - rolling_forms.turning_share(h.turning_slip_s_per_m, yaw_rate, rig.stated_half_track_m, h.plain)
    )
    if h.slip_ratio_s != 0.0:
        grown = share_of(dt, rolling_forms.deflection_time(h.plain)) * (mean - state[DEFLECTED])
        state[DEFLECTED] += grown
        ahead -= h.slip_ratio_s * grown / dt
    ahead += drift_mps
    around = half / rolling_forms.widened_by_turns(h.wide_turns, mean, half, h.plain)
    return ahead + rough[0], around + rough[1], mean - ahead, half - around


@compiled
def sideways(dt: float, state: F64, rig: Rig, h: RollingHidden) -> float:
    """v_lat* of the robot at its yaw rate and speed."""
    yaw_rate = state[TURN] / rig.half_track_m
    wanted = state[V] * yaw_rate
    rate = rolling_forms.lateral_rate(state[V], h.plain)
    state[BUILT_UP] += (1.0 if h.plain else -math.expm1(-rate * dt)) * (wanted - state[BUILT_UP])
    own = rig.icr_offset_m * yaw_rate + rig.lateral_slip_s * wanted
    return float(-own - h.lateral_slip_s * state[BUILT_UP])


@compiled
def within(along: float, across: float, cap: float, sideways_grip: float) -> Pair:
    """The force on the friction ellipse that is nearest to the one asked for, or that one inside it.

    Nearest: f = (along/(1 + λ), across/(1 + λ/e²)), so that a sliding wheel's force points against its slip
    as the ellipse's normal does. Newton's steps for λ grow from below the root.
    """
    reach = sideways_grip * cap
    if (along / cap) ** 2 + (across / reach) ** 2 <= 1.0:
        return along, across
    e_2 = sideways_grip**2
    excess = max(0.0, abs(along) / cap - 1.0, e_2 * (abs(across) / reach - 1.0))
    for _ in range(N_NEWTON):
        p, q = along / (1.0 + excess) / cap, across / (1.0 + excess / e_2) / reach
        slope = 2.0 * (p * p / (1.0 + excess) + q * q / (e_2 + excess))
        excess += (p * p + q * q - 1.0) / slope
    return along / (1.0 + excess), across / (1.0 + excess / e_2)


@compiled
def forces(wanted: Pair, free: F64, mu: Triple, dt: float, rig: Rig, out: F64) -> None:
    """Specific forces (f_R, f_L, f_y,R, f_y,L) in m/s² after ``dt``, into ``out``.

    ``wanted`` is (v_long*, l_e·yaw_rate*), ``free`` v_long, l_e·yaw_rate and q as they would be without
    friction.
    """
    own, other = 1.0 + 1.0 / rig.yaw_inertia, 1.0 - 1.0 / rig.yaw_inertia
    for i in range(4):
        out[i] = 0.0
    for _ in range(N_ITERATIONS):
        for i in range(2):
            side = 1.0 - 2.0 * i
            hub = free[0] + side * free[1]
            soft = rig.compliance * max(abs(hub), LEAST_SPEED_MPS)
            slip = wanted[0] + side * wanted[1] - hub
            along = (slip - dt * other * out[1 - i]) / (dt * own + soft)
            across = -(free[2] + dt * out[3 - i]) / (dt + soft)
            out[i], out[2 + i] = within(along, across, mu[i] * rig.load_mps2, mu[2])


@compiled
def slide(  # noqa: PLR0913, PLR0917 – compiled
    t: float, dt: float, rough: F64, push: F64, mu: Triple, state: F64, rig: Rig, h: RollingHidden, work: F64
) -> None:
    """The body ``dt`` seconds later, in place, with what is derived of it.

    ``rough`` (3,) and ``push`` (3,) are held: unevenness of unit variance, accelerations from outside.
    ``mu`` holds the coefficient of friction under the right and the left wheels, and e.
    """
    rims = rig.right_radius_m * state[W_R], rig.left_radius_m * state[W_L]
    speed = 0.5 * (abs(rims[0]) + abs(rims[1]))
    smooth = share_of(dt, ROUND_S)
    for k in range(3):
        state[ROUGH_LONG + k] += smooth * (rough[k] - state[ROUGH_LONG + k])
    uneven = rig.roughness * speed
    cosine, sine = math.cos(state[YAW]), math.sin(state[YAW])
    gate = rolling_forms.drift_share(speed, h.plain)
    ahead = gate * (h.drift_x_mps * cosine + h.drift_y_mps * sine)
    aside = gate * (h.drift_y_mps * cosine - h.drift_x_mps * sine)
    kept = kept_by(1.0, t, state, h), kept_by(-1.0, t, state, h)
    bumps = uneven * state[ROUGH_LONG], uneven * state[ROUGH_TURN]
    v_wanted, turn_wanted, own, own_turn = gripped(rims, bumps, dt, kept, ahead, state, rig, h)
    yaw_rate = state[TURN] / rig.half_track_m
    carried = state[V_LAT] * yaw_rate + push[0]
    work[0] = state[V] + dt * carried
    work[1] = state[TURN] + dt * push[2]
    work[2] = state[SKID] + dt * (push[1] - state[V] * yaw_rate)
    forces((v_wanted, turn_wanted), work, mu, dt, rig, work[3:])
    f_right, f_left = work[3], work[4]
    state[PULL_R], state[PULL_L] = f_right, f_left
    state[A_LONG] = carried + f_right + f_left
    turning = push[2] + (f_right - f_left) / rig.yaw_inertia
    state[YAW_ACC] = turning / rig.half_track_m
    v, v_lat = state[V], state[V_LAT]
    state[V] += dt * state[A_LONG]
    state[TURN] += dt * turning
    state[SKID] = work[2] + dt * (work[5] + work[6])
    state[LOST_LAT] = state[SKID] + uneven * state[ROUGH_LAT]
    state[V_LAT] = sideways(dt, state, rig, h) + aside + state[LOST_LAT]
    turned = 0.5 * dt * (yaw_rate + state[TURN] / rig.half_track_m)
    heading = state[YAW] + 0.5 * turned
    along, across = 0.5 * dt * (v + state[V]), 0.5 * dt * (v_lat + state[V_LAT])
    state[X] += along * math.cos(heading) - across * math.sin(heading)
    state[Y] += along * math.sin(heading) + across * math.cos(heading)
    state[YAW] += turned
    state[SLIP_R], state[SLIP_L] = rims[0] - state[V] - state[TURN], rims[1] - state[V] + state[TURN]
    state[LOST_R], state[LOST_L] = state[SLIP_R] - own - own_turn, state[SLIP_L] - own + own_turn

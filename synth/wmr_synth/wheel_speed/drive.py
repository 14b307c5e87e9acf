"""From commands to wheel speeds: a driver that tracks references, and the drive behind the commands.

    command   v = v_ref cos e_ψ + k_x e_x      ω = ω_ref + v_ref k_y e_y + k_ψ sin e_ψ      (Kanayama 1990)
              u_R = (v + l_c ω)/r      u_L = (v − l_c ω)/r, r the stated radius, l_c the driver's half-track
    drive     u(t − delay), its rate limited, then φ̈ = (u − φ̇)/T

A wheel's controller is stiff: the ground does not slow the wheel down.
"""

import math
from typing import NamedTuple

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_synth.driving.path_tracking import towards_path
from wmr_synth.hidden import forms
from wmr_synth.hidden.rolling import RollingHidden

X, Y, YAW, V, TURN, SKID, PHI_R, PHI_L, W_R, W_L = range(10)
TARGET_R, TARGET_L, LAG_R, LAG_L = 10, 11, 12, 13
DEFLECTED, BUILT_UP, ROUGH_LONG, ROUGH_LAT, ROUGH_TURN = 14, 15, 16, 17, 18
A_LONG, YAW_ACC, V_LAT, SLIP_R, SLIP_L, LOST_R, LOST_L, LOST_LAT = 19, 20, 21, 22, 23, 24, 25, 26
PULL_R, PULL_L, SPIN_R, SPIN_L = 27, 28, 29, 30
TURNING = 31
N_STATES = 32
"""Pose; v_long, l_e·yaw_rate, and the sideways velocity by friction; wheel angles and speeds; states of the
drive; states of the slip. Derived: accelerations, v_lat, slip velocities at the wheels, the slip that is
not the robot's own, at the wheels and sideways; specific tractions and angular accelerations of the wheels.
Last: half the difference of the wheel speeds behind a limit of its rate.
"""


class Tracking(NamedTuple):
    """The driver's gains k_x (1/s), k_y (1/m²), k_ψ (1/s), and the largest commands; 0 gains: open loop."""

    ahead_per_s: float = 0.0
    across_per_m2: float = 0.0
    heading_per_s: float = 0.0
    v_mps: float = 3.0
    yaw_rate_radps: float = 3.0


class Rig(NamedTuple):
    """A robot's coefficients as the compiled plant reads them."""

    right_radius_m: float
    left_radius_m: float
    stated_radius_m: float
    half_track_m: float
    stated_half_track_m: float
    icr_offset_m: float
    lateral_slip_s: float
    load_mps2: float
    """Load of a wheel by the robot's mass, g·carried/2."""
    yaw_inertia: float
    """(gyration/l_e)²."""
    compliance: float
    """Slip by force at 1 m/s; 0 without elastic slip."""
    roughness: float
    lag_s: float
    acceleration_radps2: float


@compiled
def commanded(wanted: F64, state: F64, tracking: Tracking, rig: Rig) -> tuple[float, float]:
    """The commanded wheel speeds (left, right) in rad/s; ``wanted``: v, ω, x, y, yaw of the reference."""
    v, yaw_rate = wanted[0], wanted[1]
    if tracking.heading_per_s > 0.0 and abs(v) + abs(yaw_rate) > 1e-3:
        off = wanted[2] - state[X], wanted[3] - state[Y], wanted[4] - state[YAW]
        heading = math.cos(state[YAW]), math.sin(state[YAW])
        gains = tracking.ahead_per_s, tracking.across_per_m2, tracking.heading_per_s
        v, yaw_rate = towards_path(v, yaw_rate, off, heading, gains)
    v = max(-tracking.v_mps, min(tracking.v_mps, v))
    turn = rig.half_track_m * max(-tracking.yaw_rate_radps, min(tracking.yaw_rate_radps, yaw_rate))
    return (v - turn) / rig.stated_radius_m, (v + turn) / rig.stated_radius_m


@compiled
def shaped(left: float, right: float, rig: Rig, h: RollingHidden) -> tuple[float, float]:
    """Commands behind what acts on them at once: gains, limit of the turning, dead zone, limits of the
    speed.
    """
    mean, half = h.gain * 0.5 * (right + left), h.gain * h.turn_gain * 0.5 * (right - left)
    r = rig.stated_radius_m
    half = forms.saturation(half, h.turn_saturation_radps * rig.stated_half_track_m / r, h.plain)
    left_mps = forms.dead_zone((mean - half) * r, h.deadzone_mps, h.plain)
    right_mps = forms.dead_zone((mean + half) * r, h.deadzone_mps, h.plain)
    left_mps = forms.saturation(left_mps, h.saturation_mps, h.plain)
    right_mps = forms.saturation(right_mps, h.saturation_mps, h.plain)
    fastest = max(abs(left_mps), abs(right_mps), 1e-9)
    share = forms.saturation(fastest, h.desaturation_mps, h.plain) / (fastest * r)
    return left_mps * share, right_mps * share


@compiled
def turning(
    left: float, right: float, dt: float, state: F64, rig: Rig, h: RollingHidden
) -> tuple[float, float]:
    """Wanted wheel speeds whose half difference changes by at most the hidden limit within ``dt``."""
    if h.turn_acceleration_radps2 == math.inf:
        return left, right
    most = dt * h.turn_acceleration_radps2 * rig.stated_half_track_m / rig.stated_radius_m
    mean, change = 0.5 * (right + left), 0.5 * (right - left) - state[TURNING]
    state[TURNING] += max(-most, min(most, change))
    half = state[TURNING]
    return mean - half, mean + half


@compiled
def share_of(dt: float, time_constant_s: float) -> float:
    """Share of a step that a first-order lag makes within ``dt``."""
    return 1.0 if time_constant_s <= 0.0 else -math.expm1(-dt / time_constant_s)


@compiled
def turn_wheel(wheel: int, u: float, dt: float, state: F64, rig: Rig, h: RollingHidden) -> None:
    """A wheel's angle and speed ``dt`` seconds later; ``wheel`` is 0 for the right, 1 for the left one.

    The hidden lag has two poles of T/2 each, the second with the drive's own lag; plain one of T.
    """
    target, lag, speed, angle = TARGET_R + wheel, LAG_R + wheel, W_R + wheel, PHI_R + wheel
    spin = SPIN_R + wheel
    most = dt * min(rig.acceleration_radps2, h.acceleration_mps2 / rig.stated_radius_m)
    before = state[target]
    state[target] += max(-most, min(most, u - before))
    through = state[target]
    if h.lag_s > 0.0:
        share = share_of(dt, h.lag_s if h.plain else 0.5 * h.lag_s)
        state[lag] += share * (through - state[lag])
        through = state[lag]
    was = state[speed]
    behind_s = rig.lag_s + (0.0 if h.plain else 0.5 * h.lag_s)
    state[speed] += share_of(dt, behind_s) * (through - was)
    state[spin] = (state[speed] - was) / dt
    state[angle] += 0.5 * dt * (was + state[speed])

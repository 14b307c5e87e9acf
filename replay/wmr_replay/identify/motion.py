"""Body-frame motion from the derivatives of x, y and yaw, with standard deviations."""

import math
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean


class Motion(NamedTuple):
    """Motion of N at the instants t − δ: each (n,), NaN where unknown, with its standard deviation."""

    v_long_mps: F64
    v_lat_mps: F64
    yaw_rate_radps: F64
    a_long_mps2: F64
    yaw_acc_radps2: F64
    v_long_mps_sd: F64
    v_lat_mps_sd: F64
    yaw_rate_radps_sd: F64
    a_long_mps2_sd: F64
    yaw_acc_radps2_sd: F64


@lean
def body_motion(estimates: F64, gains: F64, variances: F64, out: F64) -> None:
    """``out`` ← rows of :class:`Motion`, (10, n), from ``estimates`` (3, 3, n) (signal, order), ``gains`` (3,
    3, n), ``variances`` (2, n).

    With e = (cos ψ, sin ψ), n = (−sin ψ, cos ψ), p = (x, y) and ω = ψ̇: v_long = ṗ·e, v_lat = ṗ·n, dv_long/dt
    = p̈·e + ω v_lat (paper §4.2 in REP 103). First-order propagation of white noise of variance s² on x and y
    and s_ψ² on ψ, G_ab = Σ h_a h_b: var v_long = s² G₁₁ + v_lat² s_ψ² G₀₀; var v_lat = s² G₁₁ + v_long² s_ψ²
    G₀₀; var ω = s_ψ² G₁₁; var ω̇ = s_ψ² G₂₂; var a = s² (G₂₂ + ω² G₁₁) + s_ψ² (d² G₀₀ + 2 d v_lat G₀₁ +
    v_lat² G₁₁), d = p̈·n − ω v_long.
    """
    for i in range(estimates.shape[2]):
        cos, sin = math.cos(estimates[2, 0, i]), math.sin(estimates[2, 0, i])
        vx, vy, ax, ay = estimates[0, 1, i], estimates[1, 1, i], estimates[0, 2, i], estimates[1, 2, i]
        rate = estimates[2, 1, i]
        v_long, v_lat = vx * cos + vy * sin, vy * cos - vx * sin
        g00, g01, g11, g22 = gains[0, 0, i], gains[0, 1, i], gains[1, 1, i], gains[2, 2, i]
        position, yaw = variances[0, i], variances[1, i]
        d = ay * cos - ax * sin - rate * v_long
        out[0, i], out[1, i], out[2, i] = v_long, v_lat, rate
        out[3, i], out[4, i] = ax * cos + ay * sin + rate * v_lat, estimates[2, 2, i]
        out[5, i] = math.sqrt(position * g11 + v_lat**2 * yaw * g00)
        out[6, i] = math.sqrt(position * g11 + v_long**2 * yaw * g00)
        out[7, i], out[9, i] = math.sqrt(yaw * g11), math.sqrt(yaw * g22)
        from_yaw = d * d * g00 + 2 * d * v_lat * g01 + v_lat**2 * g11
        out[8, i] = math.sqrt(position * (g22 + rate**2 * g11) + yaw * max(from_yaw, 0.0))


def motion_of(estimates: F64, gains: F64, variances: F64) -> Motion:
    """The rows of :func:`body_motion` as a :class:`Motion`."""
    out = np.empty((len(Motion._fields), estimates.shape[2]))
    contiguous = np.ascontiguousarray  # one layout, so that one version is compiled
    body_motion(contiguous(estimates), contiguous(gains), contiguous(variances), out)
    return Motion(*out)


class Slip(NamedTuple):
    """Slip velocities of the wheels (−σ₂ and −σ₁), (n,), NaN where wheel speeds or dimensions are unknown."""

    sum_mps: F64
    diff_mps: F64


def wheel_slip(
    motion: Motion, wheel_radps: F64, wheel_radius_m: float | None, half_track_m: float | None
) -> Slip:
    """σ from wheel speeds through the same window: r(ω_R + ω_L)/2 = v_long + (3/2) sum; r(ω_R − ω_L)/2 = l ω
    + (3/2) diff.

    ``wheel_radps`` (2, n): left and right.
    """
    radius = np.nan if wheel_radius_m is None else wheel_radius_m
    half_track = np.nan if half_track_m is None else half_track_m
    left, right = wheel_radps * radius
    total = (right + left) / 2 - motion.v_long_mps
    difference = (right - left) / 2 - half_track * motion.yaw_rate_radps
    return Slip(total / 1.5, difference / 1.5)

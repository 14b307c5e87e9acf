"""Body-frame motion from the derivatives of x, y and yaw, with standard deviations."""

import math
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import inlined, lean


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


class Derived(NamedTuple):
    """What the differentiator knows of each row, (n,): velocities and accelerations along x and y, yaw, yaw
    rate and its derivative, Σ h_a h_b of the kernel's orders, and variances of position and yaw.
    """

    v_x: F64
    v_y: F64
    a_x: F64
    a_y: F64
    yaw: F64
    yaw_rate: F64
    yaw_acc: F64
    g00: F64
    g01: F64
    g11: F64
    g22: F64
    position: F64
    heading: F64

    @classmethod
    def of(cls, estimates: F64, gains: F64, variances: F64) -> "Derived":
        """Views of ``estimates`` (3, 3, n) (signal, order), ``gains`` (3, 3, n) and ``variances`` (2, n)."""
        (_, v_x, a_x), (_, v_y, a_y), (yaw, yaw_rate, yaw_acc) = estimates
        g = gains[0, 0], gains[0, 1], gains[1, 1], gains[2, 2]
        return cls(v_x, v_y, a_x, a_y, yaw, yaw_rate, yaw_acc, *g, *variances)


@inlined
def put_deviations(
    out: F64,
    i: int,
    motion: tuple[float, float, float, float],
    position: tuple[float, float],
    yaw: tuple[float, float, float, float],
) -> None:
    """Column ``i`` of ``out`` (5, n) ← the deviations of :class:`Motion`, in its order.

    ``motion``: v_long, v_lat, ω and d = p̈·n − ω v_long; ``position``: mean squares of ṗ and p̈, s² G₁₁ and
    s² G₂₂; ``yaw``: s_ψ² times G₀₀, G₀₁, G₁₁, G₂₂.
    """
    v_long, v_lat, rate, d = motion
    (p11, p22), (y00, y01, y11, y22) = position, yaw
    from_yaw = max(d * d * y00 + 2 * d * v_lat * y01 + v_lat * v_lat * y11, 0.0)
    out[0, i] = math.sqrt(p11 + v_lat * v_lat * y00)
    out[1, i] = math.sqrt(p11 + v_long * v_long * y00)
    out[2, i], out[4, i] = math.sqrt(y11), math.sqrt(y22)
    out[3, i] = math.sqrt(p22 + rate * rate * p11 + from_yaw)


@lean
def body_motion(rows: Derived, out: F64, deviations: F64) -> None:
    """``out`` and ``deviations`` ← rows of :class:`Motion`, (5, n) each.

    With e = (cos ψ, sin ψ), n = (−sin ψ, cos ψ), p = (x, y) and ω = ψ̇: v_long = ṗ·e, v_lat = ṗ·n, dv_long/dt
    = p̈·e + ω v_lat (paper §4.2 in REP 103). First-order propagation of white noise of variance s² on x and y
    and s_ψ² on ψ, G_ab = Σ h_a h_b: var v_long = s² G₁₁ + v_lat² s_ψ² G₀₀; var v_lat = s² G₁₁ + v_long² s_ψ²
    G₀₀; var ω = s_ψ² G₁₁; var ω̇ = s_ψ² G₂₂; var a = s² (G₂₂ + ω² G₁₁) + s_ψ² (d² G₀₀ + 2 d v_lat G₀₁ +
    v_lat² G₁₁), d = p̈·n − ω v_long.
    """
    for i in range(out.shape[1]):
        cos, sin = math.cos(rows.yaw[i]), math.sin(rows.yaw[i])
        vx, vy, ax, ay, rate = rows.v_x[i], rows.v_y[i], rows.a_x[i], rows.a_y[i], rows.yaw_rate[i]
        v_long, v_lat = vx * cos + vy * sin, vy * cos - vx * sin
        out[0, i], out[1, i], out[2, i] = v_long, v_lat, rate
        out[3, i], out[4, i] = ax * cos + ay * sin + rate * v_lat, rows.yaw_acc[i]
        g11, g22, position, yaw = rows.g11[i], rows.g22[i], rows.position[i], rows.heading[i]
        motion = v_long, v_lat, rate, ay * cos - ax * sin - rate * v_long
        of_yaw = yaw * rows.g00[i], yaw * rows.g01[i], yaw * g11, yaw * g22
        put_deviations(deviations, i, motion, (position * g11, position * g22), of_yaw)


def motion_of(rows: Derived) -> Motion:
    """The rows of :func:`body_motion` as a :class:`Motion`."""
    out = np.empty((len(Motion._fields), len(rows.yaw)))
    body_motion(rows, out[:5], out[5:])
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

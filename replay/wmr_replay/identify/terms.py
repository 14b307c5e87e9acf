"""Accelerations that a model knows of besides α times the torques: resistance, drag, slope, friction."""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64

SOFT_SIGN_MPS = 0.02
"""Friction changes its sign over this speed: sgn(v) is taken as tanh(v/.02 m/s)."""


class Terms(NamedTuple):
    """Coefficients by the names of the effects' catalogue; 0 where the model has no such effect."""

    rolling_c0_mps2: float = 0.0
    viscous_c1_per_s: float = 0.0
    drag_c2_per_m: float = 0.0
    grade_x_mps2: float = 0.0
    grade_y_mps2: float = 0.0
    scrub_d0_mps2: float = 0.0
    damping_d1_per_s: float = 0.0
    wheel_coulomb_nm: float = 0.0
    wheel_viscous_nm_per_mps: float = 0.0
    com_offset_m: float = 0.0
    com_yaw_per_m2: float = 0.0
    half_track_m: float = 0.0


@njit(cache=True)
def soft_sign(speed: float) -> float:
    """Sgn, softened about standstill."""
    return float(np.tanh(speed / SOFT_SIGN_MPS))


@njit(cache=True)
def extra_accelerations(
    v_long: float, yaw: float, yaw_rate: float, alpha: float, alpha_yaw: float, terms: Terms
) -> tuple[float, float]:
    """(dv_long/dt, d(yaw_rate)/dt) beyond the torques, in m/s² and rad/s².

    dv_long/dt: −c₀ sgn v − c₁ v − c₂ v|v| + g_x cos ψ + g_y sin ψ + d ω² − α Σ_i (τ sgn v_i + c v_i);
    l·dω/dt: −d₀ sgn ω − d₁ l ω − k v ω − α_yaw Σ_i ± (τ sgn v_i + c v_i), over the wheels' ground speeds v_i
    = v ± l ω.
    """
    l = terms.half_track_m
    ahead = -terms.rolling_c0_mps2 * soft_sign(v_long) - terms.viscous_c1_per_s * v_long
    ahead -= terms.drag_c2_per_m * v_long * abs(v_long)
    ahead += terms.grade_x_mps2 * np.cos(yaw) + terms.grade_y_mps2 * np.sin(yaw)
    ahead += terms.com_offset_m * yaw_rate**2
    turning = -terms.scrub_d0_mps2 * soft_sign(l * yaw_rate) - terms.damping_d1_per_s * l * yaw_rate
    turning -= terms.com_yaw_per_m2 * v_long * yaw_rate
    if terms.wheel_coulomb_nm != 0.0 or terms.wheel_viscous_nm_per_mps != 0.0:
        right, left = v_long + l * yaw_rate, v_long - l * yaw_rate
        lost_right = terms.wheel_coulomb_nm * soft_sign(right) + terms.wheel_viscous_nm_per_mps * right
        lost_left = terms.wheel_coulomb_nm * soft_sign(left) + terms.wheel_viscous_nm_per_mps * left
        ahead -= alpha * (lost_right + lost_left)
        turning -= alpha_yaw * (lost_right - lost_left)
    return ahead, (turning / l if l > 0.0 else 0.0)


@njit(cache=True)
def extra_along(v_long: F64, yaw: F64, yaw_rate: F64, alpha: float, terms: Terms) -> F64:
    """The longitudinal part of :func:`extra_accelerations` at each row, (n,)."""
    out = np.empty(v_long.shape[0])
    for i in range(v_long.shape[0]):
        out[i] = extra_accelerations(v_long[i], yaw[i], yaw_rate[i], alpha, alpha, terms)[0]
    return out

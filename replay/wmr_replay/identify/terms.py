"""Accelerations that a model knows of besides α times the torques: resistance, drag, slope, friction, and
terms of the dictionary.
"""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_schemas.terms import FACTORS, SOFT_SIGN

N_FACTORS = len(FACTORS)
NO_PRODUCTS = np.zeros((0, N_FACTORS + 2))


class Terms(NamedTuple):
    """Coefficients by the names of the effects' catalogue; 0 where the model has no such effect.

    ``products`` (k, 17) are terms of the dictionary: channel, as a position in ``CHANNELS``, coefficient, and
    the power of each of ``FACTORS``.
    """

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
    products: F64 = NO_PRODUCTS

    @property
    def any(self) -> bool:
        """Whether the model knows of any."""
        *coefficients, _, products = self
        return any(coefficients) or len(products) > 0


class Moving(NamedTuple):
    """The motion at which terms are taken, and the torques: effort sum and difference, in N·m."""

    v_long: float
    v_lat: float
    yaw: float
    yaw_rate: float
    force: float
    turn: float


@compiled
def soft_sign(speed: float) -> float:
    """Sgn, softened about standstill."""
    return float(np.tanh(speed / SOFT_SIGN))


@compiled
def factors_at(at: Moving) -> tuple[float, ...]:
    """Every one of ``FACTORS``, in their order."""
    return (
        1.0,
        at.v_long,
        abs(at.v_long),
        soft_sign(at.v_long),
        at.v_lat,
        abs(at.v_lat),
        at.yaw_rate,
        abs(at.yaw_rate),
        soft_sign(at.yaw_rate),
        np.cos(at.yaw),
        np.sin(at.yaw),
        at.force,
        abs(at.force),
        at.turn,
        abs(at.turn),
    )


@compiled
def add_products(at: Moving, products: F64, out: F64) -> None:
    """Coefficient · term of each of the ``products`` onto its channel of ``out`` (3,)."""
    factors = factors_at(at)
    for row in products:
        value = row[1]
        for k in range(N_FACTORS):
            for _ in range(int(row[2 + k])):
                value *= factors[k]
        out[int(row[0])] += value


@compiled
def extra_accelerations(
    at: Moving, alpha: float, alpha_yaw: float, terms: Terms
) -> tuple[float, float, float]:
    """(dv_long/dt, dv_lat/dt, d(yaw_rate)/dt) beyond the torques, in m/s² and rad/s²; the second applies to
    skids.

    dv_long/dt: −c₀ sgn v − c₁ v − c₂ v|v| + g_x cos ψ + g_y sin ψ + d ω² − α Σ_i (τ sgn v_i + c v_i);
    l·dω/dt: −d₀ sgn ω − d₁ l ω − k v ω − α_yaw Σ_i ± (τ sgn v_i + c v_i), over the wheels' ground speeds v_i
    = v ± l ω; and the products.
    """
    l, v_long, yaw_rate, aside = terms.half_track_m, at.v_long, at.yaw_rate, 0.0
    ahead = -terms.rolling_c0_mps2 * soft_sign(v_long) - terms.viscous_c1_per_s * v_long
    ahead -= terms.drag_c2_per_m * v_long * abs(v_long)
    ahead += terms.grade_x_mps2 * np.cos(at.yaw) + terms.grade_y_mps2 * np.sin(at.yaw)
    ahead += terms.com_offset_m * yaw_rate**2
    turning = -terms.scrub_d0_mps2 * soft_sign(l * yaw_rate) - terms.damping_d1_per_s * l * yaw_rate
    turning -= terms.com_yaw_per_m2 * v_long * yaw_rate
    if terms.wheel_coulomb_nm != 0.0 or terms.wheel_viscous_nm_per_mps != 0.0:
        right, left = v_long + l * yaw_rate, v_long - l * yaw_rate
        lost_right = terms.wheel_coulomb_nm * soft_sign(right) + terms.wheel_viscous_nm_per_mps * right
        lost_left = terms.wheel_coulomb_nm * soft_sign(left) + terms.wheel_viscous_nm_per_mps * left
        ahead -= alpha * (lost_right + lost_left)
        turning -= alpha_yaw * (lost_right - lost_left)
    if terms.products.shape[0]:
        known = np.array([ahead, aside, turning])
        add_products(at, terms.products, known)
        ahead, aside, turning = known
    return ahead, aside, (turning / l if l > 0.0 else 0.0)


@compiled
def extra_along(motion: F64, efforts: F64, alpha: float, terms: Terms) -> F64:
    """The longitudinal part of :func:`extra_accelerations` at each row, (n,).

    ``motion`` (4, n) are v_long, v_lat, yaw and yaw rate, ``efforts`` (2, n) left and right.
    """
    out = np.empty(motion.shape[1])
    for i in range(motion.shape[1]):
        v_long, v_lat, yaw, yaw_rate = motion[:, i]
        force, turn = efforts[1, i] + efforts[0, i], efforts[1, i] - efforts[0, i]
        out[i] = extra_accelerations(Moving(v_long, v_lat, yaw, yaw_rate, force, turn), alpha, alpha, terms)[
            0
        ]
    return out

"""Friction in the swivels of casters: it holds the direction in which a robot moves.

A caster trails: its fork points along the velocity of the pin that carries it. At a distance l ahead of the
axle, or behind it, that is (v, w), w = l·yaw_rate. Where its direction turns, the fork turns against the dry
friction T of its swivel, and the ground, a trail L behind the pin, pushes it round with T/L across the
direction. With V² = v² + w², k = v/V and the rate at which (v, w) would turn without it,

    q = (v dw/dt − w dv/dt)/V        dw/dt −= s₀ k·sgn q        s₀ = l² T/(L I) of all casters together

As dry friction holds what does not move, it takes no more than keeps the direction: sgn q is u = q/(s₀ k²),
clipped to ±1 with a round corner. Torques below it change no curvature. A fit without it finds α_yaw too
small.
"""

import math

from wmr_replay.effects.theta import Theta
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

Pair = tuple[float, float]
Six = tuple[float, float, float, float, float, float]

DIRECTED_MPS = 0.05
"""Speed below which casters follow no direction, m/s. Judgement: that of a robot that sways on its tyres."""
CREEP_MPS2 = 0.002
"""Least q at which the friction acts in full, m/s²: dry joints creep before they slide."""
SHARPNESS = 4.0
"""Of the corner between holding and sliding. Judgement: on the engine's casters as likely as a tanh, which
lets go of a sixth at half the friction; 8 is less likely there, and nearer to dry friction."""


@lean
def clipped(u: float) -> float:
    """u/(1 + |u|ⁿ)^(1/n), within ±1; n is ``SHARPNESS``."""
    return float(u / (1.0 + abs(u) ** SHARPNESS) ** (1.0 / SHARPNESS))


@lean
def by_swivels(free: Pair, v: float, w: float, theta: F64) -> float:
    """What the friction adds to dw/dt in m/s², with the accelerations ``free`` (dv, dw)/dt without it."""
    size, speed = theta[Theta.SWIVEL], math.sqrt(v * v + w * w + DIRECTED_MPS * DIRECTED_MPS)
    k, q = v / speed, (v * free[1] - w * free[0]) / speed
    return float(-size * k * clipped(q / (size * k * k + CREEP_MPS2)))


@lean
def slopes_by_swivels(free: Pair, slopes: Six, v: float, w: float, theta: F64) -> tuple[float, float, float]:
    """Slopes of :func:`by_swivels` by v, w and yaw, from those of ``free``: of dv/dt, then of dw/dt, each by
    v, w and yaw.
    """
    size, speed = theta[Theta.SWIVEL], math.sqrt(v * v + w * w + DIRECTED_MPS * DIRECTED_MPS)
    (dv, dw), (v_v, v_w, v_yaw, w_v, w_w, w_yaw) = free, slopes
    k, j = v / speed, w / speed
    q = k * dw - j * dv
    most = size * k * k + CREEP_MPS2
    held, fall = clipped(q / most), (1.0 + abs(q / most) ** SHARPNESS) ** (-1.0 / SHARPNESS - 1.0)
    by_k = -size * (held - 2.0 * size * k * k * fall * q / (most * most))
    by_q = -size * k * fall / most
    k_v, k_w = (1.0 - k * k) / speed, -k * j / speed
    q_v = (dw - k * q) / speed + k * w_v - j * v_v
    q_w = -(dv + j * q) / speed + k * w_w - j * v_w
    return by_k * k_v + by_q * q_v, by_k * k_w + by_q * q_w, by_q * (k * w_yaw - j * v_yaw)

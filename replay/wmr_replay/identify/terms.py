"""Accelerations that a model has besides α times the torques: its effects and terms of the dictionary."""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.effects.motion import Carried, sign, wheel_losses, with_body_effects
from wmr_replay.effects.swivels import by_swivels
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean
from wmr_schemas.terms import CHANNELS, FACTORS

N_FACTORS = len(FACTORS)
AHEAD, ASIDE = CHANNELS.index("longitudinal"), CHANNELS.index("lateral")
NO_EFFECTS = np.zeros(N_THETA)
NO_PRODUCTS = np.zeros((0, N_FACTORS + 2))


class Terms(NamedTuple):
    """The effects on acceleration: θ (29,) of :class:`~wmr_replay.effects.theta.Theta`, 0 without an effect.

    ``com_yaw_per_m`` is l m/I, 0 where unknown. ``products`` (k, 17) are terms of the dictionary: channel, as
    a position in ``CHANNELS``, coefficient, and the power of each of ``FACTORS``.
    """

    theta: F64 = NO_EFFECTS
    half_track_m: float = 0.0
    com_yaw_per_m: float = 0.0
    products: F64 = NO_PRODUCTS

    @property
    def any(self) -> bool:
        """Whether the model has any effect on acceleration."""
        return bool(np.any(self.theta)) or len(self.products) > 0


class Moving(NamedTuple):
    """The motion at which terms are taken, and the torques: effort sum and difference, in N·m."""

    v_long: float
    v_lat: float
    yaw: float
    yaw_rate: float
    force: float
    turn: float


@lean
def factors_at(at: Moving) -> tuple[float, ...]:
    """Every one of ``FACTORS``, in their order."""
    return (
        1.0,
        at.v_long,
        abs(at.v_long),
        sign(at.v_long),
        at.v_lat,
        abs(at.v_lat),
        at.yaw_rate,
        abs(at.yaw_rate),
        sign(at.yaw_rate),
        math.cos(at.yaw),
        math.sin(at.yaw),
        at.force,
        abs(at.force),
        at.turn,
        abs(at.turn),
    )


@lean
def with_products(given: tuple[float, float, float], at: Moving, products: F64) -> tuple[float, float, float]:
    """``given`` values of the three channels, and coefficient · term of each of the ``products``."""
    ahead, aside, turning = given
    factors = factors_at(at)
    for i in range(len(products)):
        value = products[i, 1]
        for k in range(N_FACTORS):
            for _ in range(int(products[i, 2 + k])):
                value *= factors[k]
        channel = int(products[i, 0])
        if channel == AHEAD:
            ahead += value
        elif channel == ASIDE:
            aside += value
        else:
            turning += value
    return ahead, aside, turning


@lean
def extra_accelerations(
    at: Moving, alpha: float, alpha_yaw: float, terms: Terms
) -> tuple[float, float, float]:
    """(dv_long/dt, dv_lat/dt, d(yaw_rate)/dt) beyond the torques, in m/s² and rad/s²; the second applies to
    skids.

    The effects on the body as in :func:`~wmr_replay.effects.motion.with_body_effects`; torques τ_i lost at
    the wheels, of ground speeds v ± l ω, as −α (τ_R + τ_L) ahead and −α_yaw (τ_R − τ_L) on l·dω/dt; the
    friction of swivels; and the products.
    """
    l, v_long, w = terms.half_track_m, at.v_long, terms.half_track_m * at.yaw_rate
    ahead, turning = with_body_effects(
        (0.0, 0.0), v_long, (w, at.yaw_rate), at.yaw, Carried(terms.com_yaw_per_m, 1.0), terms.theta
    )
    lost_right, lost_left = wheel_losses(v_long + w, v_long - w, terms.theta)
    ahead -= alpha * (lost_right + lost_left)
    turning -= alpha_yaw * (lost_right - lost_left)
    aside = 0.0
    if terms.theta[Theta.SWIVEL] != 0.0:
        free = ahead + alpha * at.force, turning + alpha_yaw * at.turn
        turning += by_swivels(free, v_long, w, terms.theta)
    if len(terms.products) > 0:
        ahead, aside, turning = with_products((ahead, aside, turning), at, terms.products)
    return ahead, aside, (turning / l if l > 0.0 else 0.0)


def extra_along(motion: F64, efforts: F64, gains: tuple[float, float], terms: Terms) -> F64:
    """dv_long/dt and l·d(yaw_rate)/dt of :func:`extra_accelerations` at each row, (2, n) in m/s².

    ``motion`` (4, n) are v_long, v_lat, yaw and yaw rate, ``efforts`` (2, n) left and right, ``gains`` α and
    α_yaw.
    """
    out = np.empty((2, motion.shape[1]))
    contiguous = np.ascontiguousarray  # one layout, so that one version is compiled
    fill_along(contiguous(motion), contiguous(efforts), gains[0], gains[1], terms, out)
    return out


@lean
def fill_along(motion: F64, efforts: F64, alpha: float, alpha_yaw: float, terms: Terms, out: F64) -> None:
    """Fill the answer of :func:`extra_along`."""
    for i in range(out.shape[1]):
        force, turn = efforts[1, i] + efforts[0, i], efforts[1, i] - efforts[0, i]
        at = Moving(motion[0, i], motion[1, i], motion[2, i], motion[3, i], force, turn)
        ahead, _, turning = extra_accelerations(at, alpha, alpha_yaw, terms)
        out[0, i], out[1, i] = ahead, turning * terms.half_track_m

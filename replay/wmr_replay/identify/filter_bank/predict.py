"""One step of a hypothesis through its mode's dynamics, mean and covariance."""

import math
from typing import NamedTuple

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import (
    AHEAD,
    AROUND,
    LN_ALPHA,
    LN_BETA,
    LN_C,
    N_MOVING,
    N_STATES,
    OMEGA,
    PSI,
    RHO,
    SKIDDING,
    SKIDDING_SLIPPING,
    V_LAT,
    V_LONG,
    Prior,
    X,
    Y,
)
from wmr_replay.identify.filter_bank.traction import traction
from wmr_replay.identify.terms import Moving, Terms, extra_accelerations
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

MOST_C_MPS2 = PRIORS.most_c_mps2
AVERAGE_SPEED_FLOOR_MPS = PRIORS.average_speed_floor_mps
DISTURBANCE_TIME_S = PRIORS.disturbance_time_s


class Efforts(NamedTuple):
    """Σeffort ``force`` and effort difference ``turn`` in N·m, as far as they tell modes apart; dv_long/dt
    and dω/dt that are the same in every mode.
    """

    force: float
    turn: float
    ahead: float
    turning: float


@lean
def lateral_step(
    mean: F64, dt: float, middle: tuple[float, float, float], prior: Prior, jacobian: F64
) -> float:
    """v_lat after a step of dv_lat/dt = −(c/v) v_lat − v_long ω + a, exact for v_long, ω and a as at
    ``middle``; c counts up to ``MOST_C_MPS2``.
    """
    v_long, omega, aside = middle
    speed = prior.average_speed_mps
    if math.isnan(speed):
        turning = prior.half_track_m * mean[OMEGA]
        speed = max(math.sqrt(mean[V_LONG] ** 2 + mean[V_LAT] ** 2 + turning**2), AVERAGE_SPEED_FLOOR_MPS)
    rate = min(math.exp(mean[LN_C]), MOST_C_MPS2) / speed
    left = math.exp(-rate * dt)
    reach = (1.0 - left) / rate
    push = aside - v_long * omega
    jacobian[V_LAT, V_LAT] = left
    jacobian[V_LAT, V_LONG], jacobian[V_LAT, OMEGA] = -omega * reach, -v_long * reach
    jacobian[V_LAT, LN_C] = -rate * dt * left * mean[V_LAT] + push * (dt * left - reach)
    moved: float = mean[V_LAT] * left + push * reach
    return moved


@lean
def clear(rows: F64, i: int) -> None:
    """Set row i to zero."""
    for j in range(N_STATES):
        rows[i, j] = 0.0


@lean
def predict_mean(
    mean: F64,
    mode: int,
    efforts: Efforts,
    dt: float,
    prior: Prior,
    terms: Terms | None,
    jacobian: F64,
) -> None:
    """Advance the mean by dt under the efforts; fill the Jacobian's moving rows.

    dv_long/dt and dω/dt as in ``traction``, and s v_lat ω ahead; s = 1/3 in skidding, 1 − 2ρ/3 with both, 0
    elsewhere (σ quasi-steady). Velocities are trapezoidal, the heading is that of the
    step's middle. Without ``terms`` their code is not compiled.
    """
    skids = mode in (SKIDDING, SKIDDING_SLIPPING)
    by = traction(mean, mode, efforts.force, efforts.turn, prior)
    v_long, v_lat, omega = mean[V_LONG], mean[V_LAT], mean[OMEGA]
    ahead, aside, turning = 0.0, 0.0, 0.0
    if terms is not None:
        ahead, aside, turning = extra_accelerations(
            Moving(v_long, v_lat, mean[PSI], omega, efforts.force, efforts.turn),
            math.exp(mean[LN_ALPHA]),
            math.exp(mean[LN_BETA]) * prior.half_track_m,
            terms,
        )
    new_v, new_omega, new_lat = (
        v_long + (by.ahead + ahead + mean[AHEAD] + efforts.ahead) * dt,
        omega + (by.turning + turning + mean[AROUND] + efforts.turning) * dt,
        0.0,
    )
    for i in range(N_MOVING):
        clear(jacobian, i)
        jacobian[i, i] = 1.0
    jacobian[V_LONG, LN_ALPHA], jacobian[OMEGA, LN_BETA] = by.ahead_by_alpha * dt, by.turning_by_beta * dt
    jacobian[V_LONG, RHO], jacobian[OMEGA, RHO] = by.ahead_by_own * dt, by.turning_by_own * dt
    jacobian[V_LONG, AHEAD] = jacobian[OMEGA, AROUND] = dt
    middle_omega = 0.5 * (omega + new_omega)
    if skids:
        new_lat = lateral_step(mean, dt, (0.5 * (v_long + new_v), middle_omega, aside), prior, jacobian)
        coupling = (1.0 - 2.0 * mean[RHO] / 3.0 if mode == SKIDDING_SLIPPING else 1.0 / 3.0) * dt
        middle_lat = 0.5 * (v_lat + new_lat)
        new_v += coupling * middle_lat * middle_omega
        jacobian[V_LONG, V_LAT] = coupling * middle_omega
        jacobian[V_LONG, OMEGA] = coupling * middle_lat
        if mode == SKIDDING_SLIPPING:
            jacobian[V_LONG, RHO] -= 2.0 / 3.0 * dt * middle_lat * middle_omega
    else:
        jacobian[V_LAT, V_LAT] = 0.0
        middle_lat = 0.0
    middle_v = 0.5 * (v_long + new_v)
    heading = mean[PSI] + 0.5 * middle_omega * dt
    cos, sin = math.cos(heading), math.sin(heading)
    along_x, along_y = middle_v * cos - middle_lat * sin, middle_v * sin + middle_lat * cos
    mean[X] += dt * along_x
    mean[Y] += dt * along_y
    mean[PSI] += dt * middle_omega
    mean[V_LONG], mean[V_LAT], mean[OMEGA] = new_v, new_lat, new_omega
    jacobian[X, PSI], jacobian[Y, PSI] = -dt * along_y, dt * along_x
    jacobian[X, V_LONG], jacobian[Y, V_LONG] = dt * cos, dt * sin
    if skids:
        jacobian[X, V_LAT], jacobian[Y, V_LAT] = -dt * sin, dt * cos
    jacobian[X, OMEGA], jacobian[Y, OMEGA] = -0.5 * dt * dt * along_y, 0.5 * dt * dt * along_x
    half_drive = 0.5 * dt * jacobian[V_LONG, LN_ALPHA]
    jacobian[X, LN_ALPHA], jacobian[Y, LN_ALPHA] = cos * half_drive, sin * half_drive
    jacobian[PSI, OMEGA], jacobian[PSI, LN_BETA] = dt, 0.5 * dt * jacobian[OMEGA, LN_BETA]


@lean
def predict_covariance(covariance: F64, jacobian: F64, work: F64) -> None:
    """P ← J P Jᵀ, with the zeros of J left out: first the rows of J P. ``work`` (6, 12) is scratch.

    Written out, with J in variables (``x_v``: how x depends on v_long), the compiler takes several columns at
    once.
    """
    n_states = work.shape[1]  # no constant, or the compiler unrolls the loops
    P, J, W = covariance, jacobian, work
    x_p, x_v, x_u, x_w, x_a = J[X, PSI], J[X, V_LONG], J[X, V_LAT], J[X, OMEGA], J[X, LN_ALPHA]
    y_p, y_v, y_u, y_w, y_a = J[Y, PSI], J[Y, V_LONG], J[Y, V_LAT], J[Y, OMEGA], J[Y, LN_ALPHA]
    w_b, w_r, w_d = J[OMEGA, LN_BETA], J[OMEGA, RHO], J[OMEGA, AROUND]
    p_w, p_b, v_d = J[PSI, OMEGA], J[PSI, LN_BETA], J[V_LONG, AHEAD]
    v_u, v_w, v_a, v_r = J[V_LONG, V_LAT], J[V_LONG, OMEGA], J[V_LONG, LN_ALPHA], J[V_LONG, RHO]
    u_v, u_u, u_w, u_c = J[V_LAT, V_LONG], J[V_LAT, V_LAT], J[V_LAT, OMEGA], J[V_LAT, LN_C]
    w_b, w_r, w_d = J[OMEGA, LN_BETA], J[OMEGA, RHO], J[OMEGA, AROUND]
    for j in range(n_states):
        p, v, u, w, a = P[PSI, j], P[V_LONG, j], P[V_LAT, j], P[OMEGA, j], P[LN_ALPHA, j]
        b, c, r = P[LN_BETA, j], P[LN_C, j], P[RHO, j]
        W[X, j] = P[X, j] + x_p * p + x_v * v + x_u * u + x_w * w + x_a * a
        W[Y, j] = P[Y, j] + y_p * p + y_v * v + y_u * u + y_w * w + y_a * a
        W[PSI, j] = p + p_w * w + p_b * b
        W[V_LONG, j] = v + v_u * u + v_w * w + v_a * a + v_r * r + v_d * P[AHEAD, j]
        W[V_LAT, j] = u_v * v + u_u * u + u_w * w + u_c * c
        W[OMEGA, j] = w + w_b * b + w_r * r + w_d * P[AROUND, j]
    for i in range(N_MOVING):
        row = W[i]
        p, v, u, w, a = row[PSI], row[V_LONG], row[V_LAT], row[OMEGA], row[LN_ALPHA]
        b, c, r = row[LN_BETA], row[LN_C], row[RHO]
        P[i, X] = row[X] + p * x_p + v * x_v + u * x_u + w * x_w + a * x_a
        P[i, Y] = row[Y] + p * y_p + v * y_v + u * y_u + w * y_w + a * y_a
        P[i, PSI] = p + w * p_w + b * p_b
        P[i, V_LONG] = v + u * v_u + w * v_w + a * v_a + r * v_r + row[AHEAD] * v_d
        P[i, V_LAT] = v * u_v + u * u_u + w * u_w + c * u_c
        P[i, OMEGA] = w + b * w_b + r * w_r + row[AROUND] * w_d
        for j in range(N_MOVING, n_states):
            P[i, j] = P[j, i] = row[j]
    for i in range(N_MOVING):
        for j in range(i):
            P[i, j] = P[j, i]


@lean
def let_disturbances_fade(mean: F64, covariance: F64, variance: float, around: float, dt: float) -> None:
    """Disturbances after dt: the old ones fade with the time constant τ, new ones keep their ``variance`` in
    (m/s²)², ``around`` times as large for dω/dt in (rad/s²)².
    """
    left = math.exp(-dt / DISTURBANCE_TIME_S)
    for k in (AHEAD, AROUND):
        mean[k] *= left
        for j in range(N_STATES):
            covariance[k, j] *= left
            covariance[j, k] *= left
    fresh = variance * (1.0 - left * left)
    covariance[AHEAD, AHEAD] += fresh
    covariance[AROUND, AROUND] += around * fresh

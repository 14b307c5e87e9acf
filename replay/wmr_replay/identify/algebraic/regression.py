"""One linear regression for each contact mode: how the unknowns move on, and what a pose says about them.

The unknowns are z = (x, y, ψ, v, s, ω, α, β, ℓ): pose, v = v_long, ω = yaw rate, the gains of F =
effort_right + effort_left and D = effort_right − effort_left, and ℓ = log λ, λ the rate at which v_lat dies
out. s belongs to the mode: v_lat while skidding, the gain ρα that is left while slipping, nothing in ideal
rolling.

    ideal      dv/dt = αF                 dω/dt = βD
    skidding   dv/dt = αF + ωs/3          dω/dt = βD        ds/dt = −λs − vω
    slipping   dv/dt = sF                 dω/dt = ρβD

after the paper's (3) to (5), the side force and the traction left being unknown instead of modelled. All
products of unknowns (in the rotation into the world's frame, vω, λs) are linearised about one shared
reference, so that all hypotheses of a mode share the same matrices: z⁺ = A (z, 1) + noise.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.algebraic.priors import Priors
from wmr_replay.identify.algebraic.rules import RULES
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode

X, Y, YAW, V_LONG, MODE_STATE, YAW_RATE, ALPHA, YAW_GAIN, LOG_DECAY, ONE = range(10)
N_UNKNOWNS, N_MOVING = 9, 6
"""x … ω move; α, β and ℓ stay, but for their drift."""


class Reference(NamedTuple):
    """The motion about which everything is linearised, yaw half-way through the step, and the gains."""

    yaw_rad: float
    v_long_mps: float
    v_lat_mps: float
    yaw_rate_radps: float
    alpha: float
    yaw_gain: float
    log_decay: float


class Step(NamedTuple):
    """A step in time: its length, the mean of F and D over it, NaN where no torque is known, and the
    accelerations that the model knows of besides.
    """

    dt_s: float
    force: float
    difference: float
    ahead_mps2: float = 0.0
    aside_mps2: float = 0.0
    turning_radps2: float = 0.0


@compiled
def add_row(out: F64, row: int, factor: float, source: int) -> None:
    """Row operation ``out[row] += factor · out[source]``."""
    for j in range(out.shape[1]):
        out[row, j] += factor * out[source, j]


@compiled
def transition(mode: int, at: Reference, step: Step, priors: Priors, out: F64) -> None:
    """A of z⁺ = A (z, 1) into ``out`` (6, 10): the unknowns that move, the midpoint rule throughout."""
    dt_s = step.dt_s
    known = not np.isnan(step.force)
    force, difference = step.force if known else 0.0, step.difference if known else 0.0
    out[:, :] = 0.0
    for i in range(N_MOVING):
        out[i, i] = 1.0
    out[V_LONG, MODE_STATE if mode == ContactMode.SLIPPING else ALPHA] = force * dt_s
    out[YAW_RATE, YAW_GAIN] = difference * dt_s * (priors.traction if mode == ContactMode.SLIPPING else 1.0)
    out[V_LONG, ONE], out[YAW_RATE, ONE] = step.ahead_mps2 * dt_s, step.turning_radps2 * dt_s
    if mode == ContactMode.SKIDDING:
        skid(at, step, out)
    add_row(out, YAW, 0.5 * dt_s, YAW_RATE)
    out[YAW, YAW_RATE] += 0.5 * dt_s
    displace(mode, at, dt_s, out)


@compiled
def skid(at: Reference, step: Step, out: F64) -> None:
    """v_lat, exact for a constant λ and a constant drive a − vω, and its share in dv_long/dt."""
    dt_s = step.dt_s
    log_decay = min(max(at.log_decay, RULES.min_log_decay), RULES.max_log_decay)
    decay = np.exp(log_decay)
    left = np.exp(-decay * dt_s)
    reach_s = (1.0 - left) / decay
    linear = -at.v_long_mps * at.yaw_rate_radps
    drive = linear + step.aside_mps2
    by_decay = -decay * dt_s * left * at.v_lat_mps + drive * (decay * dt_s * left - (1.0 - left)) / decay
    out[MODE_STATE, MODE_STATE] = left
    out[MODE_STATE, V_LONG], out[MODE_STATE, YAW_RATE] = (
        -reach_s * at.yaw_rate_radps,
        -reach_s * at.v_long_mps,
    )
    out[MODE_STATE, LOG_DECAY] = by_decay
    out[MODE_STATE, ONE] = reach_s * (step.aside_mps2 - linear) - by_decay * log_decay
    share = at.yaw_rate_radps * dt_s / 6.0
    add_row(out, V_LONG, share, MODE_STATE)
    out[V_LONG, MODE_STATE] += share


@compiled
def displace(mode: int, at: Reference, dt_s: float, out: F64) -> None:
    """Position: the mean of the body's velocity over the step, turned by the mean yaw."""
    cos, sin = np.cos(at.yaw_rad), np.sin(at.yaw_rad)
    v_lat = at.v_lat_mps if mode == ContactMode.SKIDDING else 0.0
    half = 0.5 * dt_s
    for row, along, across in ((X, cos, -sin), (Y, sin, cos)):
        turned = at.v_long_mps * across - v_lat * along
        add_row(out, row, half * along, V_LONG)
        add_row(out, row, half * turned, YAW)
        out[row, V_LONG] += half * along
        out[row, YAW] += half * turned
        out[row, ONE] -= dt_s * turned * at.yaw_rad
        if mode == ContactMode.SKIDDING:
            add_row(out, row, half * across, MODE_STATE)
            out[row, MODE_STATE] += half * across


@compiled
def process_noise(mode: int, at: Reference, step: Step, priors: Priors, out: F64) -> None:
    """What the regression leaves out, as white noise over the step: variances into ``out`` (9,)."""
    dt_s, known = step.dt_s, not np.isnan(step.force)
    out[:] = 0.0
    out[V_LONG] = (priors.long_diffusion if known else priors.free_long_diffusion) ** 2 * dt_s
    out[YAW_RATE] = (priors.yaw_diffusion if known else priors.free_yaw_diffusion) ** 2 * dt_s
    if mode == ContactMode.SLIPPING and known:
        out[YAW_RATE] += (priors.yaw_traction_diffusion * at.yaw_gain * step.difference) ** 2 * dt_s
    if mode == ContactMode.SKIDDING:
        side = priors.side_force_diffusion * at.v_long_mps * at.yaw_rate_radps
        out[MODE_STATE] = (side**2 + priors.long_diffusion**2) * dt_s
    out[ALPHA] = (priors.gain_drift * at.alpha) ** 2 * dt_s
    out[YAW_GAIN] = (priors.gain_drift * at.yaw_gain) ** 2 * dt_s
    out[LOG_DECAY] = priors.log_decay_drift**2 * dt_s


@compiled(fastmath={"contract", "reassoc"})
def time_update(mean: F64, covariance: F64, matrix: F64, noise: F64, work: F64) -> None:
    """Z ← A (z, 1), P ← A P Aᵀ + diag(noise), in place; ``work`` (6, 10) is scratch."""
    multiply(mean, covariance, matrix, work)
    for i in range(N_MOVING):
        mean[i] = work[i, ONE]
        for j in range(N_MOVING, N_UNKNOWNS):
            covariance[i, j] = covariance[j, i] = work[i, j]
        for j in range(i + 1):
            total = 0.0
            for k in range(N_UNKNOWNS):
                total += work[i, k] * matrix[j, k]
            covariance[i, j] = covariance[j, i] = total
    for i in range(N_UNKNOWNS):
        covariance[i, i] += noise[i]


@compiled(fastmath={"contract", "reassoc"})
def multiply(mean: F64, covariance: F64, matrix: F64, out: F64) -> None:
    """A P, with A (z, 1) as its last column, into ``out`` (6, 10); zeros of A are passed over."""
    for i in range(N_MOVING):
        moved = matrix[i, ONE]
        for j in range(N_UNKNOWNS):
            out[i, j] = 0.0
        for k in range(N_UNKNOWNS):
            weight = matrix[i, k]
            if weight != 0.0:
                moved += weight * mean[k]
                for j in range(N_UNKNOWNS):
                    out[i, j] += weight * covariance[k, j]
        out[i, ONE] = moved


@compiled(fastmath={"contract", "reassoc"})
def measurement_update(
    mean: F64, covariance: F64, pose: F64, variances: F64, row: F64
) -> tuple[float, float]:
    """Least squares with one more pose, (3,) each; returns its log likelihood and the χ² of its errors.

    ``row`` (9,) is scratch.
    """
    log_likelihood, chi_square = 0.0, 0.0
    for c in range(3):
        variance = covariance[c, c] + variances[c]
        error, certainty = pose[c] - mean[c], 1.0 / variance
        chi_square += error * error * certainty
        log_likelihood -= 0.5 * (error * error * certainty + np.log(variance))
        for i in range(N_UNKNOWNS):
            row[i] = covariance[c, i]
        for i in range(N_UNKNOWNS):
            gain = row[i] * certainty
            mean[i] += gain * error
            for j in range(N_UNKNOWNS):
                covariance[i, j] -= gain * row[j]
    return log_likelihood, chi_square

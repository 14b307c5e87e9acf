"""Prediction errors: an extended Kalman filter over the log, with the sensitivity of every innovation.

Innovations are whitened one measured component after the other (scalar updates, Joseph's form), so no matrix
is inverted. The sensitivity of the state to each parameter runs through the same gains:
S⁻ = F S + ∂f/∂θ, ψ = (H S⁻ + ∂h/∂θ)/√s, S = S⁻ − K (H S⁻ + ∂h/∂θ), so that e(θ + δ) ≈ e(θ) − ψᵀδ.
Source: Kristensen, Madsen, Jørgensen, Automatica 40 (2004) 225, for prediction-error estimation with a
diffusion; sensitivities after Ljung, System Identification (1999), ch. 10.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.sensitivity import (
    Wanted,
    carry,
    first_live,
    measured_slopes,
    push,
    settle,
    wanted_columns,
)
from wmr_replay.gap.model.dynamics import (
    D_LAT,
    D_LONG,
    D_YAW,
    N_MOTION,
    N_STATE,
    V_LAT,
    Base,
    Row,
    V,
    W,
    X,
    Y,
    halfway,
    is_skidding,
    is_slipping,
    measured,
    responses,
    step_from,
)
from wmr_replay.gap.model.jacobians import jacobian, slopes_of_measurement
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

LOG_TWO_PI = float(np.log(2 * np.pi))
SLIP_DISTURBANCE_MPS2 = 0.5
SWITCH_SD_MPS = 0.05
OUTLIER_SD = 6.0


class Diffusion(NamedTuple):
    """Disturbances: standard deviation and correlation time of each; the lateral one is a velocity."""

    long_sd_mps2: float
    long_tau_s: float
    yaw_sd_mps2: float
    yaw_tau_s: float
    lat_sd_mps: float
    lat_tau_s: float

    @property
    def densities_mps2_rthz(self) -> tuple[float, float]:
        """Root density at low frequency ahead and in yaw, √Q = s √(2 τ), of correlation s² exp(−|t|/τ)."""
        long = self.long_sd_mps2 * np.sqrt(2 * self.long_tau_s)
        yaw = self.yaw_sd_mps2 * np.sqrt(2 * self.yaw_tau_s)
        return float(long), float(yaw)


class Data(NamedTuple):
    """Input rows (n, 11), poses (n, 3), their variances (n, 3), and the state of row 0 (9,), known poorly."""

    rows: F64
    poses: F64
    variances: F64
    first: F64


class Passed(NamedTuple):
    """What a pass gives: −2 log likelihood per row (n,), whitened innovations (n, 3), filtered states (n, 9),
    whitened sensitivities (n, 3, p), logarithms of the innovations' variances (n, 3).
    """

    deviance: F64
    innovations: F64
    states: F64
    sensitivities: F64
    log_variances: F64


@compiled(error_model="numpy")
def decays(dt: float, noise: Diffusion) -> tuple[float, float, float]:
    """What a step leaves of the disturbances of v_long and v_lat, of w's, and of a lateral velocity."""
    kept_long, kept_yaw = np.exp(-dt / noise.long_tau_s), np.exp(-dt / noise.yaw_tau_s)
    return float(kept_long), float(kept_yaw), float(np.exp(-dt / noise.lat_tau_s))


@compiled(error_model="numpy")
def add_noise(
    P: F64, row: F64, previous_mode: float, noise: Diffusion, kept: tuple[float, float, float]
) -> None:
    """Process noise of one step onto ``P``: exact for the Ornstein–Uhlenbeck states."""
    dt, mode = row[Row.DT], row[Row.MODE]
    kept_long, kept_yaw, kept_lat = kept
    P[D_LONG, D_LONG] += noise.long_sd_mps2**2 * (1 - kept_long**2)
    P[D_LAT, D_LAT] += noise.long_sd_mps2**2 * (1 - kept_long**2)
    P[D_YAW, D_YAW] += noise.yaw_sd_mps2**2 * (1 - kept_yaw**2)
    if is_skidding(mode):
        P[V_LAT, V_LAT] += noise.lat_sd_mps**2 * dt
    else:
        P[V_LAT, V_LAT] += noise.lat_sd_mps**2 * (1 - kept_lat**2)
    if row[Row.LOOSE] > 0.0:
        P[V_LAT, V_LAT] += row[Row.LOOSE] ** 2
        P[X, X] += (row[Row.LOOSE] * dt) ** 2 / 3
        P[Y, Y] += (row[Row.LOOSE] * dt) ** 2 / 3
    if is_slipping(mode):
        P[V, V] += SLIP_DISTURBANCE_MPS2**2 * dt
        P[W, W] += SLIP_DISTURBANCE_MPS2**2 * dt
    if mode != previous_mode:
        P[V, V] += SWITCH_SD_MPS**2
        P[W, W] += SWITCH_SD_MPS**2


@compiled(error_model="numpy")
def fade(F: F64, z: F64, kept: tuple[float, float, float]) -> None:
    """The disturbances die out over the step: their rows of ``F`` and of ``z``."""
    for d, share in ((D_LONG, kept[0]), (D_LAT, kept[0]), (D_YAW, kept[1])):
        z[d] *= share
        F[d, d] *= share


@compiled(error_model="numpy")
def transform(F: F64, P: F64, out: F64) -> None:
    """``out`` ← F P; F is the identity in its first two columns and behind its first six rows, but for the
    disturbances' diagonal, and most of the rest is 0.
    """
    for i in range(N_STATE):
        for j in range(N_STATE):
            out[i, j] = F[i, i] * P[i, j]
        if i < N_MOTION:
            for m in range(2, N_STATE):
                if m != i and F[i, m] != 0.0:
                    for j in range(N_STATE):
                        out[i, j] += F[i, m] * P[m, j]


@compiled(error_model="numpy")
def spread(F: F64, P: F64, scratch: F64) -> None:
    """``P`` ← F P Fᵀ = F (F P)ᵀ."""
    transform(F, P, scratch)
    for i in range(N_STATE):
        for j in range(i):
            scratch[i, j], scratch[j, i] = scratch[j, i], scratch[i, j]
    transform(F, scratch, P)


@compiled(error_model="numpy")
def update(z: F64, P: F64, h: F64, error: float, variance: float, gain: F64) -> float:
    """One scalar measurement with slope ``h`` (3,) on x, y, yaw; leaves the gain; gives the innovation's
    variance.
    """
    for i in range(N_STATE):
        gain[i] = P[i, 0] * h[0] + P[i, 1] * h[1] + P[i, 2] * h[2]
    s = variance + h[0] * gain[0] + h[1] * gain[1] + h[2] * gain[2]
    share = 1.0 / s
    for i in range(N_STATE):
        lost = gain[i] * share
        for j in range(i + 1):
            P[i, j] -= lost * gain[j]
            P[j, i] = P[i, j]
    for i in range(N_STATE):
        gain[i] *= share
        z[i] += gain[i] * error
        P[i, i] = max(P[i, i], 1e-16)
    return float(s)


@compiled(error_model="numpy")
def first_covariance(noise: Diffusion) -> F64:
    """(9, 9): half a metre, radian and metre per second; disturbances in their stationary distribution."""
    P = np.zeros((N_STATE, N_STATE))
    for i in range(N_STATE):
        P[i, i] = 0.25
    P[D_LONG, D_LONG] = noise.long_sd_mps2**2
    P[D_LAT, D_LAT] = noise.long_sd_mps2**2
    P[D_YAW, D_YAW] = noise.yaw_sd_mps2**2
    P[V_LAT, V_LAT] = noise.lat_sd_mps**2 + 1e-6
    return P


@compiled(error_model="numpy")
def filter_pass(data: Data, theta: F64, base: Base, noise: Diffusion, wanted: Wanted, keep: bool) -> Passed:
    """One pass over the data. With ``keep`` false, states and sensitivities are left out."""
    n, p = len(data.rows), wanted_columns(wanted)
    deviance, innovations, log_variances = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3))
    states, sensitivities = np.zeros((n if keep else 0, N_STATE)), np.zeros((n if keep else 0, 3, p))
    S, S_ahead, slopes = np.zeros((N_STATE, p)), np.zeros((N_MOTION, p)), np.zeros(p)
    live = first_live(wanted)
    z, P = data.first.copy(), first_covariance(noise)
    F, scratch = np.zeros((N_STATE, N_STATE)), np.zeros((N_STATE, N_STATE))
    moved, undisturbed, middle = np.zeros(N_STATE), np.zeros(N_STATE), np.zeros(N_STATE)
    kept, dt, H, at, gain = (0.0, 0.0, 0.0), np.nan, np.zeros((3, 3)), np.zeros(3), np.zeros(N_STATE)
    for k in range(n):
        row = data.rows[k]
        if k > 0:
            if row[Row.DT] != dt:
                dt = row[Row.DT]
                kept = decays(dt, noise)
            halfway(z, responses(row, theta, base), row, theta, base, middle)
            step_from(middle, z, row, theta, base, moved)
            jacobian(z, row, theta, base, moved, middle, F)
            undisturbed[:] = moved
            fade(F, moved, kept)
            if keep:
                carry(F, S, live, S_ahead)
                push(S, live, z, undisturbed, k, data.rows, theta, base, wanted)
            z[:] = moved
            spread(F, P, scratch)
            add_noise(P, row, data.rows[k - 1, Row.MODE], noise, kept)
        slopes_of_measurement(z, theta, H)
        for c in range(3):
            measured(z, row, theta, at)
            error = data.poses[k, c] - at[c]
            if keep:
                measured_slopes(slopes, S, live, H[c], c, z, row[Row.AGE], wanted.places)
            s = update(z, P, H[c], error, data.variances[k, c], gain)
            e = error / np.sqrt(s)
            innovations[k, c], log_variances[k, c] = e, np.log(s)
            deviance[k] += log_variances[k, c] + LOG_TWO_PI + min(e * e, OUTLIER_SD**2)
            if keep:
                settle(S, live, gain, slopes, sensitivities[k, c], np.sqrt(s))
        if keep:
            states[k] = z
    return Passed(deviance, innovations, states, sensitivities, log_variances)

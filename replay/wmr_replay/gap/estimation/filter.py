"""Prediction errors: an extended Kalman filter over the log, with the sensitivity of every innovation.

Innovations are whitened one measured component after the other (scalar updates, Joseph's form), so no matrix
is inverted. The sensitivity of the state to each parameter runs through the same gains:
S⁻ = F S + ∂f/∂θ, ψ = (H S⁻ + ∂h/∂θ)/√s, S = S⁻ − K (H S⁻ + ∂h/∂θ), so that e(θ + δ) ≈ e(θ) − ψᵀδ.
Source: Kristensen, Madsen, Jørgensen, Automatica 40 (2004) 225, for prediction-error estimation with a
diffusion; sensitivities after Ljung, System Identification (1999), ch. 10.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.process_noise import (
    Diffusion,
    add_noise,
    decay_disturbances,
    decays,
    first_covariance,
)
from wmr_replay.gap.estimation.sensitivity import (
    SensitivityTargets,
    active_ranges,
    add_step_slopes,
    measurement_sensitivity,
    n_columns,
    predict_sensitivities,
    update_sensitivities,
)
from wmr_replay.gap.model.dynamics import (
    N_MOTION,
    N_STATE,
    Base,
    Row,
    halfway,
    measured,
    responses,
    step_from,
)
from wmr_replay.gap.model.jacobians import jacobian, slopes_of_measurement
from wmr_replay.gap.settings.filter import FilterSettings
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

LOG_TWO_PI = float(np.log(2 * np.pi))


class FilterInput(NamedTuple):
    """Input rows (n, 11), poses (n, 3), their variances (n, 3), and a rough state of row 0 (9,)."""

    rows: F64
    poses: F64
    variances: F64
    first: F64


class FilterOutput(NamedTuple):
    """Of one pass: −2 log likelihood per row (n,), whitened innovations (n, 3), filtered states (n, 9),
    whitened sensitivities (n, 3, p), logarithms of the innovations' variances (n, 3).
    """

    deviance: F64
    innovations: F64
    states: F64
    sensitivities: F64
    log_variances: F64


@compiled(error_model="numpy")
def transform(F: F64, P: F64, out: F64) -> None:
    """``out`` ← F P. F is the identity in its first two columns and behind its first six rows, except for
    the disturbances' diagonal; most of the rest is 0.
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
def predict_covariance(F: F64, P: F64, scratch: F64) -> None:
    """``P`` ← F P Fᵀ = F (F P)ᵀ."""
    transform(F, P, scratch)
    for i in range(N_STATE):
        for j in range(i):
            scratch[i, j], scratch[j, i] = scratch[j, i], scratch[i, j]
    transform(F, scratch, P)


@compiled(error_model="numpy")
def update(z: F64, P: F64, h: F64, error: float, variance: float, gain: F64) -> float:
    """Update ``z`` (9,) and ``P`` (9, 9) with one scalar measurement of slope ``h`` (3,) on x, y, yaw.

    Writes the gain to ``gain`` (9,) and returns the innovation's variance.
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
def filter_pass(
    data: FilterInput,
    theta: F64,
    base: Base,
    noise: Diffusion,
    targets: SensitivityTargets,
    settings: FilterSettings,
    keep: bool,
) -> FilterOutput:
    """One pass of the filter over the data, with the sensitivities to ``targets`` (p columns).

    With ``keep`` false, states and sensitivities are left out (0 rows each).
    """
    n, p = len(data.rows), n_columns(targets)
    deviance, innovations, log_variances = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3))
    states, sensitivities = np.zeros((n if keep else 0, N_STATE)), np.zeros((n if keep else 0, 3, p))
    S, S_ahead, slopes = np.zeros((N_STATE, p)), np.zeros((N_MOTION, p)), np.zeros(p)
    active = active_ranges(targets)
    z, P = data.first.copy(), first_covariance(noise, settings.first_variance)
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
            decay_disturbances(F, moved, kept)
            if keep:
                predict_sensitivities(F, S, active, S_ahead)
                add_step_slopes(S, active, z, undisturbed, k, data.rows, theta, base, targets)
            z[:] = moved
            predict_covariance(F, P, scratch)
            add_noise(P, row, data.rows[k - 1, Row.MODE], noise, kept, settings)
        slopes_of_measurement(z, theta, H)
        for c in range(3):
            measured(z, row, theta, at)
            error = data.poses[k, c] - at[c]
            if keep:
                measurement_sensitivity(slopes, S, active, H[c], c, z, row[Row.AGE], targets.places)
            s = update(z, P, H[c], error, data.variances[k, c], gain)
            e = error / np.sqrt(s)
            innovations[k, c], log_variances[k, c] = e, np.log(s)
            deviance[k] += log_variances[k, c] + LOG_TWO_PI + min(e * e, settings.outlier_sd**2)
            if keep:
                update_sensitivities(S, active, gain, slopes, sensitivities[k, c], np.sqrt(s))
        if keep:
            states[k] = z
    return FilterOutput(deviance, innovations, states, sensitivities, log_variances)

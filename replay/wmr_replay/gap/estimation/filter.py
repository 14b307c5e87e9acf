"""Prediction errors: an extended Kalman filter over the log, with the sensitivity of every innovation.

Innovations are whitened one measured component after the other (scalar updates), so no matrix is inverted.
The sensitivity of the state to each parameter runs through the same gains:
S⁻ = F S + ∂f/∂θ, ψ = (H S⁻ + ∂h/∂θ)/√s, S = S⁻ − K (H S⁻ + ∂h/∂θ), so that e(θ + δ) ≈ e(θ) − ψᵀδ.
Source: Kristensen, Madsen, Jørgensen, Automatica 40 (2004) 225, for prediction-error estimation with a
diffusion; sensitivities after Ljung, System Identification (1999), ch. 10.
"""

import math
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
    Columns,
    SensitivityTargets,
    StepScratch,
    add_step_slopes,
    laid_out,
    n_blocks,
    n_columns,
    step_scratch,
)
from wmr_replay.gap.estimation.sensitivity_blocks import (
    Measurement,
    blocks_for,
    leave_forgotten,
    predict_sensitivities,
    slopes_by_theta,
    update_sensitivities,
)
from wmr_replay.gap.model.dynamics import (
    N_MOTION,
    N_STATE,
    YAW,
    Base,
    Row,
    halfway,
    heading,
    measured,
    responses,
    step_from,
)
from wmr_replay.gap.model.jacobians import jacobian, slopes_of_measurement
from wmr_replay.gap.settings.filter import FilterSettings
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lanes import WIDTH
from wmr_schemas.compiled.lean import inlined, lean

LOG_TWO_PI = float(np.log(2 * np.pi))


class FilterInput(NamedTuple):
    """Input rows (n, 16), poses (n, 3), their variances (n, 3), and a rough state of row 0 (9,)."""

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


@inlined
def copy(out: F64, x: F64) -> None:
    """``out`` (9,) ← x (9,)."""
    for i in range(N_STATE):
        out[i] = x[i]


@inlined
def correct(z: F64, error: float, gain: F64) -> None:
    """``z`` (9,) += error times gain (9,).

    Loops of one length are unrolled: a vector that is loaded from numbers just stored has to wait for them.
    """
    for i in range(N_STATE):
        z[i] += error * gain[i]


@inlined
def across(f: F64, p: F64) -> float:
    """Σ f[m] p[m] over all but the first two of 9, which are the identity's."""
    return float(
        f[2] * p[2] + f[3] * p[3] + f[4] * p[4] + f[5] * p[5] + f[6] * p[6] + f[7] * p[7] + f[8] * p[8]
    )


@inlined
def predict_covariance(F: F64, P: F64, ahead: F64) -> None:
    """``P`` ← F P Fᵀ, its lower triangle computed; ``ahead`` (6, 9) is scratch.

    F is the identity in its first two columns and behind its first six rows, except for the disturbances'
    diagonal. Its first two rows are full, most of the others is 0.
    """
    for i in range(2):
        predict_place(F[i], P, P[i], ahead[i])
    for i in range(2, N_MOTION):
        predict_motion(F[i], P, i, ahead[i])
    for i in range(N_MOTION, N_STATE):
        for j in range(N_MOTION):
            P[i, j] = F[i, i] * ahead[j, i]
            P[j, i] = P[i, j]
        for j in range(N_MOTION, N_STATE):
            P[i, j] *= F[i, i] * F[j, j]
    for i in range(2):
        for j in range(i + 1):
            P[i, j] = ahead[j, i] + across(F[i], ahead[j])
            P[j, i] = P[i, j]
    for i in range(2, N_MOTION):
        predict_row(F[i], ahead, i, P)


@inlined
def predict_place(f: F64, P: F64, own: F64, out: F64) -> None:
    """``out`` (9,) ← one of the first two rows of F P: ``f`` (9,) is that row of F, ``own`` (9,) of P."""
    f2, f3, f4, f5, f6, f7, f8 = f[2], f[3], f[4], f[5], f[6], f[7], f[8]
    for j in range(N_STATE):
        out[j] = own[j] + (
            f2 * P[2, j]
            + f3 * P[3, j]
            + f4 * P[4, j]
            + f5 * P[5, j]
            + f6 * P[6, j]
            + f7 * P[7, j]
            + f8 * P[8, j]
        )


@inlined
def predict_motion(f: F64, P: F64, i: int, out: F64) -> None:
    """``out`` (9,) ← row ``i`` of F P, one of the next four, but for its first two columns.

    ``f`` (9,) is that row of F.
    """
    own = f[i]
    for j in range(2, N_STATE):
        out[j] = own * P[i, j]
    for m in range(2, N_STATE):
        other = f[m]
        if m != i and other != 0.0:
            for j in range(2, N_STATE):
                out[j] += other * P[m, j]


@inlined
def predict_row(f: F64, ahead: F64, i: int, P: F64) -> None:
    """Row and column ``i`` of ``P`` ← those of F ``ahead``ᵀ, of which ``f`` (9,) is the row of F.

    What is behind the diagonal is replaced by the rows that follow: loops of one length are faster.
    """
    own = f[i]
    for j in range(N_MOTION):
        P[i, j] = own * ahead[j, i]
    for m in range(2, N_STATE):
        other = f[m]
        if m != i and other != 0.0:
            for j in range(N_MOTION):
                P[i, j] += other * ahead[j, m]
    for j in range(N_MOTION):
        P[j, i] = P[i, j]


@inlined
def gain_of(c: int, P: F64, slope: float, variance: float, crossed: F64, gains: F64) -> float:
    """The innovation's variance of the component ``c`` of a pose, after the components before it.

    Its slope is 1 by itself and ``slope`` by yaw beside it. ``P`` is the covariance before all of them;
    writes row ``c`` of ``crossed`` (3, 9), P hᵀ, and of ``gains`` (3, 9), P hᵀ/s.
    """
    for i in range(N_STATE):
        crossed[c, i] = P[i, c] + slope * P[i, YAW]
    for d in range(c):
        known = crossed[d, c] + slope * crossed[d, YAW]
        for i in range(N_STATE):
            crossed[c, i] -= gains[d, i] * known
    s = variance + crossed[c, c] + slope * crossed[c, YAW]
    share = 1.0 / s
    for i in range(N_STATE):
        gains[c, i] = crossed[c, i] * share
    return float(s)


@inlined
def update_covariance(P: F64, crossed: F64, gains: F64) -> None:
    """``P`` ← P − Σ K (P hᵀ)ᵀ over the three components of a pose, its lower triangle computed."""
    for i in range(N_STATE):
        x, y, yaw = gains[0, i], gains[1, i], gains[2, i]
        for j in range(i):
            P[i, j] = P[i, j] - x * crossed[0, j] - y * crossed[1, j] - yaw * crossed[2, j]
            P[j, i] = P[i, j]
        P[i, i] = max(P[i, i] - x * crossed[0, i] - y * crossed[1, i] - yaw * crossed[2, i], 1e-16)


class FilterScratch(NamedTuple):
    """Memory of one pass, overwritten row by row.

    The state ``z`` (9,), its covariance ``P`` (9, 9) and sensitivities ``S`` in their ``columns``. Of a time
    update: the states half-way and after it, with and without the disturbances' decay, and its Jacobian ``F``
    (9, 9). Of a measurement: the pose ``at`` (3,), the components' P hᵀ ``crossed`` (3, 9), and what its
    sensitivities need. ``covariance`` (6, 9) and ``ahead`` (6, ``WIDTH``) are products.
    """

    z: F64
    P: F64
    S: F64
    middle: F64
    moved: F64
    undisturbed: F64
    F: F64
    at: F64
    crossed: F64
    covariance: F64
    ahead: F64
    columns: Columns
    measurement: Measurement
    step: StepScratch


def scratch_for(data: FilterInput, theta: F64, targets: SensitivityTargets, covariance: F64) -> FilterScratch:
    """The memory before row 0, where the state has this ``covariance`` (9, 9)."""
    columns, zeros = laid_out(targets), np.zeros
    by_theta = zeros((3 * int(blocks_for(int(columns.size[0]))), WIDTH))
    return FilterScratch(
        z=data.first.copy(),
        P=covariance,
        S=zeros((N_STATE * n_blocks(columns), WIDTH)),
        middle=zeros(N_STATE),
        moved=zeros(N_STATE),
        undisturbed=zeros(N_STATE),
        F=zeros((N_STATE, N_STATE)),
        at=zeros(3),
        crossed=zeros((3, N_STATE)),
        covariance=zeros((N_MOTION, N_STATE)),
        ahead=zeros((N_MOTION, WIDTH)),
        columns=columns,
        measurement=Measurement(zeros((3, 3)), zeros((3, N_STATE)), zeros(3), by_theta, zeros((1, WIDTH))),
        step=step_scratch(theta),
    )


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
    m = n if keep else 0
    output = FilterOutput(
        np.zeros(n), np.zeros((n, 3)), np.zeros((m, N_STATE)), np.zeros((m, 3, p)), np.zeros((n, 3))
    )
    scratch = scratch_for(data, theta, targets, first_covariance(noise, settings.first_variance))
    filter_rows(data, theta, base, noise, targets, settings, keep, scratch, output)
    return output


@lean
def filter_rows(  # noqa: PLR0913, PLR0917 – compiled; arrays that a pass reuses
    data: FilterInput,
    theta: F64,
    base: Base,
    noise: Diffusion,
    targets: SensitivityTargets,
    settings: FilterSettings,
    keep: bool,
    scratch: FilterScratch,
    output: FilterOutput,
) -> None:
    """Fill the ``output`` of :func:`filter_pass` row by row."""
    z, P, S, F, H = scratch.z, scratch.P, scratch.S, scratch.F, scratch.measurement.slopes
    moved, undisturbed, middle, at = scratch.moved, scratch.undisturbed, scratch.middle, scratch.at
    crossed, columns, measurement = scratch.crossed, scratch.columns, scratch.measurement
    gains, places, by_theta = measurement.gains, targets.places, measurement.by_theta
    innovations, log_variances = output.innovations, output.log_variances
    n, whitened = output.sensitivities.shape[2], output.sensitivities.reshape(-1)
    kept, dt = (0.0, 0.0, 0.0), np.nan
    for k in range(len(data.rows)):
        row = data.rows[k]
        if k > 0:
            if row[Row.DT] != dt:
                dt = row[Row.DT]
                kept = decays(dt, noise)
            acts = responses(row, theta, base)
            halfway(z, acts, row, theta, base, middle)
            towards = heading(middle)
            step_from(middle, towards, z, acts, row, theta, base, moved)
            jacobian(z, acts, row, theta, base, moved, middle, towards, F)
            if keep:
                copy(undisturbed, moved)
            decay_disturbances(F, moved, kept)
            if keep:
                predict_sensitivities(F, S, columns.active, scratch.ahead)
                add_step_slopes(S, columns, z, undisturbed, k, data.rows, theta, base, targets, scratch.step)
            copy(z, moved)
            predict_covariance(F, P, scratch.covariance)
            add_noise(P, row, data.rows[k - 1, Row.MODE], noise, kept, settings)
        slopes_of_measurement(z, theta, H)
        for c in range(3):
            measured(z, row, theta, at)
            error = data.poses[k, c] - at[c]
            if keep:
                slopes_by_theta(c, z[YAW], row[Row.AGE], places, by_theta)
            s = gain_of(c, P, H[c, YAW] if c < YAW else 0.0, data.variances[k, c], crossed, gains)
            correct(z, error, gains[c])
            e = error / math.sqrt(s)
            innovations[k, c], log_variances[k, c] = e, math.log(s)
            output.deviance[k] += log_variances[k, c] + LOG_TWO_PI + min(e * e, settings.outlier_sd**2)
            measurement.sd[c] = math.sqrt(s)
        update_covariance(P, crossed, gains)
        if keep:
            update_sensitivities(S, columns, measurement, whitened, 3 * n * k, n)
            leave_forgotten(S, columns.active, settings.forgotten)
            copy(output.states[k], z)

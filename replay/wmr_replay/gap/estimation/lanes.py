"""Several passes of the filter over one log at once, each with its own model and noise: its lanes.

The states move one after the other, by the functions of a single pass. The covariances, which take more than
half of the time of a pass, are computed together: :mod:`.lane_covariance`. Innovations and variances are
those of single passes, bit by bit.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.filter import LOG_TWO_PI, FilterOutput, copy
from wmr_replay.gap.estimation.lane_covariance import gains_of_lanes, predict_covariances, update_covariances
from wmr_replay.gap.estimation.process_noise import (
    Diffusion,
    add_noise,
    decay_disturbances,
    decays,
    first_covariance,
)
from wmr_replay.gap.model.dynamics import (
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
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lanes import WIDTH
from wmr_schemas.compiled.lean import inlined, lean


class Lane(NamedTuple):
    """What a lane has to itself: input rows (n, 16), θ (29,) and its noise."""

    rows: F64
    theta: F64
    noise: Diffusion


class LaneInput(NamedTuple):
    """Different input rows (r, n, 12), and of each of m lanes which, θ (m, 25) and its noise (m, 8).

    Of the log: poses (n, 3) and their variances (n, 3).
    """

    rows: F64
    which: I64
    thetas: F64
    noises: F64
    poses: F64
    variances: F64


class LaneScratch(NamedTuple):
    """Memory of the lanes, overwritten row by row.

    Of each: its state ``z`` and the one after a step ``moved`` (lanes, 9), its Jacobian ``F`` (lanes, 9, 9),
    and the length of a step with what it leaves of the disturbances, ``kept`` (lanes, 4).

    Of all: ``P`` (9, 9, lanes) and ``ahead`` (54, lanes), a product with it; ``slopes`` and ``s`` (3, lanes),
    ``crossed`` and ``gains`` (27, lanes) of a measurement. Of one after the other: the state half-way, a pose
    ``at`` (3,), and its slopes ``H`` (3, 3).
    """

    z: F64
    moved: F64
    F: F64
    kept: F64
    P: F64
    ahead: F64
    slopes: F64
    s: F64
    crossed: F64
    gains: F64
    middle: F64
    at: F64
    H: F64


def scratch_for(first: F64, noises: list[Diffusion], settings: FilterSettings) -> LaneScratch:
    """The memory before row 0, where the state is about ``first`` (9,)."""
    noises, zeros = [*noises, *noises[-1:] * (WIDTH - len(noises))], np.zeros
    covariances = [first_covariance(noise, settings.first_variance) for noise in noises]
    return LaneScratch(
        z=np.tile(first, (WIDTH, 1)),
        moved=zeros((WIDTH, N_STATE)),
        F=zeros((WIDTH, N_STATE, N_STATE)),
        kept=np.full((WIDTH, 4), np.nan),
        P=np.ascontiguousarray(np.stack(covariances, axis=-1)),
        ahead=zeros((6 * N_STATE, WIDTH)),
        slopes=zeros((3, WIDTH)),
        s=zeros((3, WIDTH)),
        crossed=zeros((3 * N_STATE, WIDTH)),
        gains=zeros((3 * N_STATE, WIDTH)),
        middle=zeros(N_STATE),
        at=zeros(3),
        H=zeros((3, 3)),
    )


def filter_lanes(
    lanes: Sequence[Lane], poses: F64, variances: F64, first: F64, base: Base, settings: FilterSettings
) -> list[FilterOutput]:
    """One pass of the filter with each of 1 to ``WIDTH`` lanes; states and sensitivities are left out.

    ``poses`` and ``variances`` (n, 3) are those of the log, ``first`` (9,) a rough state of row 0.
    """
    m, n = len(lanes), len(poses)
    different = list({id(lane.rows): lane.rows for lane in lanes}.values())
    rows = different[0][np.newaxis] if len(different) == 1 else np.stack(different)
    which = np.array([[lane.rows is one for one in different].index(True) for lane in lanes])
    noises = [lane.noise for lane in lanes]
    data = LaneInput(
        rows, which, np.array([lane.theta for lane in lanes]), np.array(noises), poses, variances
    )
    deviance, innovations, log_variances = np.zeros((m, n)), np.zeros((m, n, 3)), np.zeros((m, n, 3))
    scratch = scratch_for(first, noises, settings)
    filter_rows_of_lanes(data, base, settings, scratch, deviance, innovations, log_variances)
    none = np.zeros((0, N_STATE)), np.zeros((0, 3, 0))
    return [FilterOutput(deviance[i], innovations[i], *none, log_variances[i]) for i in range(m)]


@lean
def filter_rows_of_lanes(
    data: LaneInput,
    base: Base,
    settings: FilterSettings,
    scratch: LaneScratch,
    deviance: F64,
    innovations: F64,
    log_variances: F64,
) -> None:
    """Fill (m, n), (m, n, 3) and (m, n, 3) of :func:`filter_lanes` row by row."""
    m, P = len(data.thetas), scratch.P.reshape(N_STATE * N_STATE, WIDTH)
    flat = scratch.F.reshape(WIDTH, N_STATE * N_STATE)
    for k in range(len(data.poses)):
        if k > 0:
            for i in range(m):
                move(i, data.rows[data.which[i], k], data.thetas[i], base, noise_of(data.noises[i]), scratch)
            predict_covariances(flat, P, scratch.ahead)
            for i in range(m):
                noise, rows = noise_of(data.noises[i]), data.rows[data.which[i]]
                kept = scratch.kept[i, 1], scratch.kept[i, 2], scratch.kept[i, 3]
                add_noise(scratch.P[:, :, i], rows[k], rows[k - 1, Row.MODE], noise, kept, settings)
        for i in range(m):
            slopes_of_measurement(scratch.z[i], data.thetas[i], scratch.H)
            scratch.slopes[0, i], scratch.slopes[1, i] = scratch.H[0, YAW], scratch.H[1, YAW]
        gains_of_lanes(P, scratch.slopes, data.variances[k], scratch.crossed, scratch.gains, scratch.s)
        for i in range(m):
            row, theta = data.rows[data.which[i], k], data.thetas[i]
            deviance[i, k] = correct_lane(
                i, row, theta, data.poses[k], settings, scratch, innovations[i, k], log_variances[i, k]
            )
        update_covariances(P, scratch.crossed, scratch.gains)


@inlined
def noise_of(x: F64) -> Diffusion:
    """The noise of a lane out of its numbers (8,)."""
    return Diffusion(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7])


@inlined
def move(i: int, row: F64, theta: F64, base: Base, noise: Diffusion, scratch: LaneScratch) -> None:
    """The time update of the lane ``i``, but for its covariance."""
    z, moved, F, middle, own = scratch.z[i], scratch.moved[i], scratch.F[i], scratch.middle, scratch.kept[i]
    if row[Row.DT] != own[0]:
        own[0] = row[Row.DT]
        own[1], own[2], own[3] = decays(row[Row.DT], noise)
    acts = responses(row, theta, base)
    halfway(z, acts, row, theta, base, middle)
    towards = heading(middle)
    step_from(middle, towards, z, acts, row, theta, base, moved)
    jacobian(z, acts, row, theta, base, moved, middle, towards, F)
    decay_disturbances(F, moved, (own[1], own[2], own[3]))
    copy(z, moved)


@inlined
def correct_lane(
    i: int,
    row: F64,
    theta: F64,
    pose: F64,
    settings: FilterSettings,
    scratch: LaneScratch,
    innovations: F64,
    log_variances: F64,
) -> float:
    """The state of the lane ``i`` after a measurement; writes (3,) and (3,), returns the row's deviance."""
    z, gains, total = scratch.z[i], scratch.gains, 0.0
    for c in range(3):
        measured(z, row, theta, scratch.at)
        error, s = pose[c] - scratch.at[c], scratch.s[c, i]
        for j in range(N_STATE):
            z[j] += error * gains[N_STATE * c + j, i]
        e = error / math.sqrt(s)
        innovations[c], log_variances[c] = e, math.log(s)
        total += log_variances[c] + LOG_TWO_PI + min(e * e, settings.outlier_sd**2)
    return total

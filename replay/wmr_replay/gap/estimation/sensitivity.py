"""Sensitivity of the filtered state to parameters, S = ∂z/∂parameter (9, p), beside the filter.

Time update S⁻ = F S + ∂step/∂parameter; measurement update S = S⁻ − K (H S⁻ + ∂h/∂parameter). Only
columns whose parameter has acted already, and is not forgotten, are computed. Source: see :mod:`.filter`.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.effects.measurement import ON_POSE, slope_by_place
from wmr_replay.gap.model.dynamics import DIFFERENCE, N_MOTION, N_ROW, N_STATE, YAW, Base, Row, step
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import inlined, lean


class SensitivityTargets(NamedTuple):
    """The parameters of the sensitivities, in the order of their columns.

    First θ at ``places``. Then each of ``efforts`` (q, n, 2): changes of the left and right effort [N·m] per
    unit of a parameter. Then a loss of α within each of ``n_cells`` cells, and of α_yaw likewise; ``cells``
    (n,) is the cell of each row.
    """

    places: I64
    efforts: F64
    cells: I64
    n_cells: int


NO_TARGETS = SensitivityTargets(np.zeros(0, np.int64), np.zeros((0, 0, 2)), np.zeros(0, np.int64), 0)


def n_columns(targets: SensitivityTargets) -> int:
    """Number of columns p."""
    return len(targets.places) + len(targets.efforts) + 2 * targets.n_cells


class StepScratch(NamedTuple):
    """Memory for difference quotients of a step: the state after it (9,), a changed θ (25,), which is θ
    between two quotients, a changed row (12,), and the slopes by the left and the right effort (6,).
    """

    ahead: F64
    theta: F64
    row: F64
    left: F64
    right: F64


def step_scratch(theta: F64) -> StepScratch:
    """The memory for a pass with this θ."""
    zeros = np.zeros
    return StepScratch(zeros(N_STATE), theta.copy(), zeros(N_ROW), zeros(N_MOTION), zeros(N_MOTION))


def active_ranges(targets: SensitivityTargets) -> I64:
    """Ranges [a, b) (3, 2) of the columns that may differ from 0 at the first row.

    Places and efforts act from the start. The two blocks of cells grow as their rows are reached.
    """
    known = len(targets.places) + len(targets.efforts)
    return np.array([[0, known], [known, known], [known + targets.n_cells, known + targets.n_cells]])


@inlined
def predict_sensitivities(F: F64, S: F64, active: I64, ahead: F64) -> None:
    """S ← F S, with ``ahead`` (6, p) as scratch.

    F is the identity in its first two columns and behind its first six rows, except for the disturbances'
    diagonal.
    """
    for k in range(len(active)):
        a, b = active[k, 0], active[k, 1]
        if a == b:
            continue
        for i in range(2):
            add_others(S[i, a:b], F[i], i, S, a, b)
        for i in range(2, N_MOTION):
            scale(ahead[i, a:b], F[i, i], S[i, a:b])
            add_others(ahead[i, a:b], F[i], i, S, a, b)
        for i in range(2, N_MOTION):
            scale(S[i, a:b], 1.0, ahead[i, a:b])
        for i in range(N_MOTION, N_STATE):
            scale(S[i, a:b], F[i, i], S[i, a:b])


@inlined
def add_others(out: F64, f: F64, i: int, S: F64, a: int, b: int) -> None:
    """``out`` += f S over columns [a, b), without rows 0, 1 and ``i`` of S; most of ``f`` (9,) is 0."""
    for m in range(2, N_STATE):
        if m != i and f[m] != 0.0:
            add(out, f[m], S[m, a:b])


@lean
def scale(out: F64, factor: float, x: F64) -> None:
    """``out`` ← factor x."""
    for j in range(len(out)):
        out[j] = factor * x[j]


@lean
def add(out: F64, factor: float, x: F64) -> None:
    """``out`` += factor x."""
    for j in range(len(out)):
        out[j] += factor * x[j]


@inlined
def add_step_slopes(  # noqa: PLR0913, PLR0917 – compiled; arrays that a pass reuses
    S: F64,
    active: I64,
    z: F64,
    moved: F64,
    k: int,
    rows: F64,
    theta: F64,
    base: Base,
    targets: SensitivityTargets,
    scratch: StepScratch,
) -> None:
    """S ← S + ∂step/∂parameter at the state ``z`` before row ``k``; ``moved`` is step(z)."""
    ahead, changed, row, left, right = scratch.ahead, scratch.theta, scratch.row, scratch.left, scratch.right
    for i in range(N_ROW):
        row[i] = rows[k, i]
    n_places, n_efforts = len(targets.places), len(targets.efforts)
    for j in range(n_places):
        place = targets.places[j]
        if place not in ON_POSE:
            changed[place] = theta[place] + DIFFERENCE
            step(z, row, changed, base, ahead)
            changed[place] = theta[place]
            for i in range(N_MOTION):
                S[i, j] += (ahead[i] - moved[i]) / DIFFERENCE
    if n_efforts > 0 or targets.n_cells > 0:
        slope_of_effort(Row.LEFT, z, moved, row, theta, base, ahead, left)
        slope_of_effort(Row.RIGHT, z, moved, row, theta, base, ahead, right)
        for j in range(n_efforts):
            add_effort_slopes(
                S, n_places + j, left, right, targets.efforts[j, k, 0], targets.efforts[j, k, 1]
            )
        if targets.n_cells > 0:
            j = n_places + n_efforts + targets.cells[k]
            active[1, 1], active[2, 1] = j + 1, j + targets.n_cells + 1
            mean, half = (row[Row.LEFT] + row[Row.RIGHT]) / 2, (row[Row.RIGHT] - row[Row.LEFT]) / 2
            add_effort_slopes(S, j, left, right, -mean, -mean)
            add_effort_slopes(S, j + targets.n_cells, left, right, half, -half)


@lean
def slope_of_effort(
    side: int, z: F64, moved: F64, row: F64, theta: F64, base: Base, ahead: F64, out: F64
) -> None:
    """``out`` (6,) ← ∂step/∂effort of one side; ``row`` is restored, ``ahead`` (9,) is scratch."""
    effort = row[side]
    row[side] = effort + DIFFERENCE
    step(z, row, theta, base, ahead)
    row[side] = effort
    for i in range(N_MOTION):
        out[i] = (ahead[i] - moved[i]) / DIFFERENCE


@lean
def add_effort_slopes(S: F64, j: int, left: F64, right: F64, by_left: float, by_right: float) -> None:
    """Add to column ``j`` the slope by a change of both efforts, from the slopes (6,) by each of them."""
    for i in range(N_MOTION):
        S[i, j] += left[i] * by_left + right[i] * by_right


@inlined
def measurement_sensitivity(
    slopes: F64, S: F64, active: I64, h: F64, c: int, z: F64, age_s: float, places: I64
) -> None:
    """``slopes`` (p,) ← H S + ∂h/∂θ of component ``c``, ``age_s`` after the first pose."""
    for k in range(len(active)):
        a, b = active[k, 0], active[k, 1]
        if a == b:
            continue
        scale(slopes[a:b], h[0], S[0, a:b])
        for i in range(1, 3):
            add(slopes[a:b], h[i], S[i, a:b])
    for j in range(len(places)):
        slopes[j] += slope_by_place(places[j], c, z[YAW], age_s)


@inlined
def update_sensitivities(S: F64, active: I64, gain: F64, slopes: F64, whitened: F64, sd: float) -> None:
    """S ← S − K slopes; writes slopes/sd to ``whitened`` (p,)."""
    for k in range(len(active)):
        a, b = active[k, 0], active[k, 1]
        if a == b:
            continue
        scale(whitened[a:b], 1.0 / sd, slopes[a:b])
        for i in range(N_STATE):
            add(S[i, a:b], -gain[i], slopes[a:b])


@inlined
def leave_forgotten(S: F64, active: I64, least: float) -> None:
    """Set to 0, and leave, the first columns of cells whose sensitivities are all below ``least``.

    The filter forgets a loss that is over within seconds. What is left of it falls below the smallest normal
    number, with which processors are a hundred times slower.
    """
    for k in range(1, len(active)):
        while active[k, 0] < active[k, 1] - 1 and is_below(S[:, active[k, 0]], least):
            for i in range(N_STATE):
                S[i, active[k, 0]] = 0.0
            active[k, 0] += 1


@lean
def is_below(values: F64, least: float) -> bool:
    """Whether all values are closer to 0 than ``least``."""
    most = 0.0
    for i in range(len(values)):
        most = max(most, abs(values[i]))
    return bool(most < least)

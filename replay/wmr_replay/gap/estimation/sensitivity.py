"""Sensitivity of the filtered state to parameters, S = ∂z/∂parameter (9, p), beside the filter.

Time update S⁻ = F S + ∂step/∂parameter; measurement update S = S⁻ − K (H S⁻ + ∂h/∂parameter). Here are the
parameters, where their columns stand, and ∂step/∂parameter; the products are :mod:`.sensitivity_blocks`.
Source: see :mod:`.filter`.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.effects.measurement import ON_POSE
from wmr_replay.gap.model.dynamics import DIFFERENCE, N_MOTION, N_ROW, N_STATE, Base, Row, step
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lanes import WIDTH
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
    """Memory for difference quotients of a step: the state after it (9,), a changed θ (29,), which is θ
    between two quotients, a changed row (16,), and the slopes by the left and the right effort (6,).
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


class Columns(NamedTuple):
    """Where the columns stand: ``S`` (9·blocks, ``WIDTH``) has ``WIDTH`` of them in 9 rows, block by block.

    Of three kinds, θ and efforts, losses of α, and those of α_yaw: each begins a block, ``first`` (3,), and
    has ``size`` (3,) columns, in results from ``outer`` (3,) on. ``active`` (3, 2) are the ranges [a, b), in
    the order of ``S``, that may differ from 0: θ and efforts act from the start, the others grow as their
    cells are reached.
    """

    first: I64
    size: I64
    outer: I64
    active: I64


def laid_out(targets: SensitivityTargets) -> Columns:
    """The columns before the first row."""
    size = np.array([len(targets.places) + len(targets.efforts), targets.n_cells, targets.n_cells])
    blocks = -(-size // WIDTH)
    first, outer = WIDTH * (np.cumsum(blocks) - blocks), np.cumsum(size) - size
    active = np.column_stack([first, first])
    active[0, 1] = size[0]
    return Columns(first, size, outer, active)


def n_blocks(columns: Columns) -> int:
    """How many blocks all columns take."""
    return int(np.sum(-(-columns.size // WIDTH)))


@inlined
def add_step_slopes(  # noqa: PLR0913, PLR0917 – compiled; arrays that a pass reuses
    S: F64,
    columns: Columns,
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
                S[row_of(j) + i, j % WIDTH] += (ahead[i] - moved[i]) / DIFFERENCE
    if n_efforts > 0 or targets.n_cells > 0:
        slope_of_effort(Row.LEFT, z, moved, row, theta, base, ahead, left)
        slope_of_effort(Row.RIGHT, z, moved, row, theta, base, ahead, right)
        for j in range(n_efforts):
            add_effort_slopes(
                S, n_places + j, left, right, targets.efforts[j, k, 0], targets.efforts[j, k, 1]
            )
        if targets.n_cells > 0:
            ahead_of, turning = columns.first[1] + targets.cells[k], columns.first[2] + targets.cells[k]
            columns.active[1, 1], columns.active[2, 1] = ahead_of + 1, turning + 1
            mean, half = (row[Row.LEFT] + row[Row.RIGHT]) / 2, (row[Row.RIGHT] - row[Row.LEFT]) / 2
            add_effort_slopes(S, ahead_of, left, right, -mean, -mean)
            add_effort_slopes(S, turning, left, right, half, -half)


@inlined
def row_of(j: int) -> int:
    """The first row of ``S`` that holds the column ``j``."""
    return N_STATE * (j // WIDTH)


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
        S[row_of(j) + i, j % WIDTH] += left[i] * by_left + right[i] * by_right

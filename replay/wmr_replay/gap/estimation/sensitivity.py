"""How the filtered state, and with it every innovation, moves with each parameter: S (9, p)."""

from typing import NamedTuple

import numpy as np

from wmr_replay.effects.measurement import ON_POSE, slope_by_place
from wmr_replay.gap.model.dynamics import DIFFERENCE, N_MOTION, N_STATE, YAW, Base, Row, step
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled


class Wanted(NamedTuple):
    """What sensitivities are to, in the order of their columns: θ at ``places``; each of ``efforts``
    (q, n, 2), changes of the left and right effort per unit of a parameter; a loss of α within each of
    ``n_cells`` cells (``cells`` (n,) says in which a row lies), and of α_yaw likewise.
    """

    places: I64
    efforts: F64
    cells: I64
    n_cells: int


NOTHING = Wanted(np.zeros(0, np.int64), np.zeros((0, 0, 2)), np.zeros(0, np.int64), 0)


@compiled(error_model="numpy")
def wanted_columns(wanted: Wanted) -> int:
    """How many columns that makes."""
    return len(wanted.places) + len(wanted.efforts) + 2 * wanted.n_cells


@compiled(error_model="numpy")
def first_live(wanted: Wanted) -> I64:
    """Ranges [a, b) (3, 2) of the columns that may differ from 0: places and efforts, and of either block of
    cells those whose first row is reached.
    """
    known = len(wanted.places) + len(wanted.efforts)
    return np.array([[0, known], [known, known], [known + wanted.n_cells, known + wanted.n_cells]])


@compiled(error_model="numpy")
def carry(F: F64, S: F64, live: I64, ahead: F64) -> None:
    """S ← F S, by way of ``ahead`` (6, p); F is the identity in its first two columns and behind its first
    six rows, but for the disturbances' diagonal.
    """
    for a, b in live:
        for i in range(2):
            add_others(S[i, a:b], F[i], i, S, a, b)
        for i in range(2, N_MOTION):
            scale(ahead[i, a:b], F[i, i], S[i, a:b])
            add_others(ahead[i, a:b], F[i], i, S, a, b)
        for i in range(2, N_MOTION):
            scale(S[i, a:b], 1.0, ahead[i, a:b])
        for i in range(N_MOTION, N_STATE):
            scale(S[i, a:b], F[i, i], S[i, a:b])


@compiled(error_model="numpy")
def add_others(out: F64, f: F64, i: int, S: F64, a: int, b: int) -> None:
    """``out`` += f S over columns [a, b), but for rows 0, 1 and ``i`` of S; most of ``f`` (9,) is 0."""
    for m in range(2, N_STATE):
        if m != i and f[m] != 0.0:
            add(out, f[m], S[m, a:b])


@compiled(error_model="numpy")
def scale(out: F64, factor: float, x: F64) -> None:
    """``out`` ← factor x."""
    for j in range(len(out)):
        out[j] = factor * x[j]


@compiled(error_model="numpy")
def add(out: F64, factor: float, x: F64) -> None:
    """``out`` += factor x."""
    for j in range(len(out)):
        out[j] += factor * x[j]


@compiled(error_model="numpy")
def push(  # noqa: PLR0913, PLR0917 – compiled; arrays that a pass reuses
    S: F64, live: I64, z: F64, moved: F64, k: int, rows: F64, theta: F64, base: Base, wanted: Wanted
) -> None:
    """S ← S + ∂step/∂parameter at the state ``z`` before row ``k``; ``moved`` is step(z)."""
    ahead, changed, row = np.zeros(N_STATE), theta.copy(), rows[k].copy()
    n_places, n_efforts = len(wanted.places), len(wanted.efforts)
    for j in range(n_places):
        place = wanted.places[j]
        if place not in ON_POSE:
            changed[place] = theta[place] + DIFFERENCE
            step(z, row, changed, base, ahead)
            changed[place] = theta[place]
            for i in range(N_MOTION):
                S[i, j] += (ahead[i] - moved[i]) / DIFFERENCE
    if n_efforts > 0 or wanted.n_cells > 0:
        left = slope_of_effort(Row.LEFT, z, moved, row, theta, base, ahead)
        right = slope_of_effort(Row.RIGHT, z, moved, row, theta, base, ahead)
        for j in range(n_efforts):
            push_efforts(S, n_places + j, left, right, wanted.efforts[j, k, 0], wanted.efforts[j, k, 1])
        if wanted.n_cells > 0:
            j = n_places + n_efforts + wanted.cells[k]
            live[1, 1], live[2, 1] = j + 1, j + wanted.n_cells + 1
            mean, half = (row[Row.LEFT] + row[Row.RIGHT]) / 2, (row[Row.RIGHT] - row[Row.LEFT]) / 2
            push_efforts(S, j, left, right, -mean, -mean)
            push_efforts(S, j + wanted.n_cells, left, right, half, -half)


@compiled(error_model="numpy")
def slope_of_effort(side: int, z: F64, moved: F64, row: F64, theta: F64, base: Base, ahead: F64) -> F64:
    """∂step/∂effort (6,) of one side; ``row`` is left as it was."""
    effort = row[side]
    row[side] = effort + DIFFERENCE
    step(z, row, theta, base, ahead)
    row[side] = effort
    return (ahead[:N_MOTION] - moved[:N_MOTION]) / DIFFERENCE


@compiled(error_model="numpy")
def push_efforts(S: F64, j: int, left: F64, right: F64, by_left: float, by_right: float) -> None:
    """Column ``j`` by a change of the efforts, from the slopes (6,) by either of them."""
    for i in range(N_MOTION):
        S[i, j] += left[i] * by_left + right[i] * by_right


@compiled(error_model="numpy")
def measured_slopes(
    slopes: F64, S: F64, live: I64, h: F64, c: int, z: F64, age_s: float, places: I64
) -> None:
    """``slopes`` (p,) ← H S + ∂h/∂θ of component ``c``, ``age_s`` after the first pose."""
    for a, b in live:
        scale(slopes[a:b], h[0], S[0, a:b])
        for i in range(1, 3):
            add(slopes[a:b], h[i], S[i, a:b])
    for j in range(len(places)):
        slopes[j] += slope_by_place(places[j], c, z[YAW], age_s)


@compiled(error_model="numpy")
def settle(S: F64, live: I64, gain: F64, slopes: F64, whitened: F64, sd: float) -> None:
    """S ← S − K slopes; the whitened slopes are left in ``whitened`` (p,)."""
    for a, b in live:
        scale(whitened[a:b], 1.0 / sd, slopes[a:b])
        for i in range(N_STATE):
            add(S[i, a:b], -gain[i], slopes[a:b])

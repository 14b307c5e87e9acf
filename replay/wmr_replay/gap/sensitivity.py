"""How the filtered state, and with it every innovation, moves with each parameter: S (9, p)."""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_replay.gap.field import DIFFERENCE, N_MOTION, N_STATE, Base, Row, Theta, measured, step
from wmr_schemas.arrays import F64, I64, Bool


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


@njit(cache=True)
def wanted_columns(wanted: Wanted) -> int:
    """How many columns that makes."""
    return len(wanted.places) + len(wanted.efforts) + 2 * wanted.n_cells


@njit(cache=True)
def first_live(wanted: Wanted, p: int) -> Bool:
    """Columns (p,) that may differ from 0; those of a cell do once its first row is reached."""
    live = np.zeros(p, np.bool_)
    live[: len(wanted.places) + len(wanted.efforts)] = True
    return live


@njit(cache=True)
def carry(F: F64, S: F64, live: Bool) -> None:
    """S ← F S; F is the identity but for its first six rows and the disturbances' diagonal."""
    column = np.zeros(N_STATE)
    for j in range(S.shape[1]):
        if live[j]:
            column[:] = S[:, j]
            for i in range(N_STATE):
                total = 0.0
                if i < N_MOTION:
                    for m in range(N_STATE):
                        total += F[i, m] * column[m]
                else:
                    total = F[i, i] * column[i]
                S[i, j] = total


@njit(cache=True)
def push(  # noqa: PLR0913, PLR0917 – compiled; arrays that a pass reuses
    S: F64, live: Bool, z: F64, moved: F64, k: int, rows: F64, theta: F64, base: Base, wanted: Wanted
) -> None:
    """S ← S + ∂step/∂parameter at the state ``z`` before row ``k``; ``moved`` is step(z)."""
    ahead, changed, row = np.zeros(N_STATE), theta.copy(), rows[k].copy()
    n_places, n_efforts = len(wanted.places), len(wanted.efforts)
    for j in range(n_places):
        place = wanted.places[j]
        changed[place] = theta[place] + DIFFERENCE
        step(z, row, changed, base, ahead)
        changed[place] = theta[place]
        add_difference(S, j, ahead, moved)
    for j in range(n_efforts):
        push_efforts(S, n_places + j, z, moved, row, wanted.efforts[j, k], theta, base, ahead)
    if wanted.n_cells > 0:
        j = n_places + n_efforts + wanted.cells[k]
        live[j], live[j + wanted.n_cells] = True, True
        mean = (rows[k, Row.LEFT] + rows[k, Row.RIGHT]) / 2
        half = (rows[k, Row.RIGHT] - rows[k, Row.LEFT]) / 2
        push_efforts(S, j, z, moved, row, np.array([-mean, -mean]), theta, base, ahead)
        push_efforts(S, j + wanted.n_cells, z, moved, row, np.array([half, -half]), theta, base, ahead)


@njit(cache=True)
def push_efforts(  # noqa: PLR0913, PLR0917 – compiled; arrays that a pass reuses
    S: F64, j: int, z: F64, moved: F64, row: F64, change: F64, theta: F64, base: Base, ahead: F64
) -> None:
    """Column ``j`` by a change (left, right) of the efforts; ``row`` is left as it was."""
    if change[0] == 0.0 and change[1] == 0.0:
        return
    left, right = row[Row.LEFT], row[Row.RIGHT]
    row[Row.LEFT] = left + DIFFERENCE * change[0]
    row[Row.RIGHT] = right + DIFFERENCE * change[1]
    step(z, row, theta, base, ahead)
    row[Row.LEFT], row[Row.RIGHT] = left, right
    add_difference(S, j, ahead, moved)


@njit(cache=True)
def add_difference(S: F64, j: int, ahead: F64, moved: F64) -> None:
    """Column ``j`` of S plus (ahead − moved)/DIFFERENCE."""
    for i in range(N_MOTION):
        S[i, j] += (ahead[i] - moved[i]) / DIFFERENCE


@njit(cache=True)
def measured_slopes(slopes: F64, S: F64, live: Bool, h: F64, c: int, z: F64, theta: F64, places: I64) -> None:
    """``slopes`` (p,) ← H S + ∂h/∂θ of component ``c``."""
    for j in range(S.shape[1]):
        if live[j]:
            slopes[j] = h[0] * S[0, j] + h[1] * S[1, j] + h[2] * S[2, j]
    at, other, changed = np.zeros(3), np.zeros(3), theta.copy()
    for j in range(len(places)):
        if places[j] in (Theta.HEADING, Theta.ARM_X, Theta.ARM_Y):
            measured(z, theta, at)
            changed[places[j]] += DIFFERENCE
            measured(z, changed, other)
            changed[places[j]] = theta[places[j]]
            slopes[j] += (other[c] - at[c]) / DIFFERENCE


@njit(cache=True)
def settle(S: F64, live: Bool, gain: F64, slopes: F64, whitened: F64, sd: float) -> None:
    """S ← S − K slopes; the whitened slopes are left in ``whitened`` (p,)."""
    for j in range(S.shape[1]):
        if live[j]:
            whitened[j] = slopes[j] / sd
            for i in range(N_STATE):
                S[i, j] -= gain[i] * slopes[j]

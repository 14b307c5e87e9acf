"""The products of a filter step with sensitivities, a block of columns after the other, its columns as lanes.

A block is read once and written once in each step. Every number is rounded as if its column were computed
alone, in the order of the sums of :mod:`.filter`.
"""

from typing import Any, NamedTuple

from wmr_replay.effects.measurement import slope_by_place
from wmr_replay.gap.estimation.sensitivity import Columns
from wmr_replay.gap.model.dynamics import N_MOTION, N_STATE
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lanes import (
    WIDTH,
    alike,
    at,
    less_product,
    plus,
    plus_product,
    put,
    put_from,
    times,
)
from wmr_schemas.compiled.lean import inlined, lean


class Measurement(NamedTuple):
    """Of the three components of a pose: their slopes by x, y and yaw (3, 3), ``gains`` (3, 9), standard
    deviations of the innovations (3,), and slopes by θ, ``by_theta`` (3·blocks, ``WIDTH``) as the columns.
    ``few`` (1, ``WIDTH``) is scratch.
    """

    slopes: F64
    gains: F64
    sd: F64
    by_theta: F64
    few: F64


@inlined
def blocks_for(n: int) -> int:
    """How many blocks hold n columns."""
    return (n + WIDTH - 1) // WIDTH


@lean
def predict_sensitivities(F: F64, S: F64, active: I64, ahead: F64) -> None:
    """S ← F S, with ``ahead`` (6, ``WIDTH``) as scratch.

    F is the identity in its first two columns and behind its first six rows, except for the disturbances'
    diagonal.
    """
    for kind in range(3):
        if active[kind, 0] < active[kind, 1]:
            for block in range(active[kind, 0] // WIDTH, blocks_for(active[kind, 1])):
                predict_block(F, S, N_STATE * block, ahead)


@inlined
def predict_block(F: F64, S: F64, first: int, ahead: F64) -> None:
    """The block whose rows begin at ``first`` ← F times it; most of F is 0."""
    for i in range(N_MOTION):
        x = at(S, first + i) if i < 2 else times(alike(F[i, i]), at(S, first + i))
        for m in range(2, N_STATE):
            if m != i and F[i, m] != 0.0:
                x = plus_product(x, alike(F[i, m]), at(S, first + m))
        put(ahead, i, x)
    for i in range(N_MOTION):
        put(S, first + i, at(ahead, i))
    for i in range(N_MOTION, N_STATE):
        put(S, first + i, times(alike(F[i, i]), at(S, first + i)))


@inlined
def slopes_by_theta(c: int, yaw: float, age_s: float, places: I64, by_theta: F64) -> None:
    """``by_theta`` of the component ``c`` of a pose, ``age_s`` after the first one, at this yaw."""
    n = len(by_theta) // 3
    for j in range(len(places)):
        by_theta[c * n + j // WIDTH, j % WIDTH] = slope_by_place(places[j], c, yaw, age_s)


@lean
def update_sensitivities(
    S: F64, columns: Columns, measurement: Measurement, whitened: F64, start: int, n: int
) -> None:
    """S ← S − K (H S + ∂h/∂θ), one component of a pose after the other.

    ``whitened`` (·,) holds the ``n`` columns of (H S + ∂h/∂θ)/√s of each of them from ``start`` on.
    """
    for kind in range(3):
        first, last = columns.active[kind, 0], columns.active[kind, 1]
        if first < last:
            for block in range(first // WIDTH, blocks_for(last)):
                inside = WIDTH * block - columns.first[kind]
                there, left = start + columns.outer[kind] + inside, columns.size[kind] - inside
                update_block(S, block, measurement, kind == 0, whitened, there, n, left)


@inlined
def write(x: Any, left: int, few: F64, numbers: F64, start: int) -> None:
    """``numbers`` (·,) from ``start`` on ← the first ``left`` of the lanes ``x``."""
    if left >= WIDTH:
        put_from(numbers, start, x)
    else:
        put(few, 0, x)
        for j in range(left):
            numbers[start + j] = few[0, j]


@inlined
def update_block(
    S: F64, block: int, measurement: Measurement, measured: bool, whitened: F64, start: int, n: int, left: int
) -> None:
    """:func:`update_sensitivities` of one block, whose columns stand in ``whitened`` from ``start`` on.

    ``left`` are those from there to the last one of their kind; ``measured``: θ may act on a pose itself.
    """
    first, H, gains, by_theta = N_STATE * block, measurement.slopes, measurement.gains, measurement.by_theta
    x, y, yaw = at(S, first), at(S, first + 1), at(S, first + 2)
    v, w, v_lat = at(S, first + 3), at(S, first + 4), at(S, first + 5)
    ahead, turning, sideways = at(S, first + 6), at(S, first + 7), at(S, first + 8)
    for c in range(3):
        e = plus_product(plus_product(times(alike(H[c, 0]), x), alike(H[c, 1]), y), alike(H[c, 2]), yaw)
        if measured:
            e = plus(e, at(by_theta, c * (len(by_theta) // 3) + block))
        write(times(alike(1.0 / measurement.sd[c]), e), left, measurement.few, whitened, start + c * n)
        x, y = less_product(x, alike(gains[c, 0]), e), less_product(y, alike(gains[c, 1]), e)
        yaw, v = less_product(yaw, alike(gains[c, 2]), e), less_product(v, alike(gains[c, 3]), e)
        w, v_lat = less_product(w, alike(gains[c, 4]), e), less_product(v_lat, alike(gains[c, 5]), e)
        ahead = less_product(ahead, alike(gains[c, 6]), e)
        turning = less_product(turning, alike(gains[c, 7]), e)
        sideways = less_product(sideways, alike(gains[c, 8]), e)
    put(S, first, x)
    put(S, first + 1, y)
    put(S, first + 2, yaw)
    put(S, first + 3, v)
    put(S, first + 4, w)
    put(S, first + 5, v_lat)
    put(S, first + 6, ahead)
    put(S, first + 7, turning)
    put(S, first + 8, sideways)


@lean
def leave_forgotten(S: F64, active: I64, least: float) -> None:
    """Set to 0, and leave, the first columns of cells whose sensitivities are all below ``least``.

    The filter forgets a loss that is over within seconds. What is left of it falls below the smallest normal
    number, with which processors are a hundred times slower.
    """
    for kind in range(1, 3):
        while active[kind, 0] < active[kind, 1] - 1 and is_below(S, active[kind, 0], least):
            first, lane = N_STATE * (active[kind, 0] // WIDTH), active[kind, 0] % WIDTH
            for i in range(N_STATE):
                S[first + i, lane] = 0.0
            active[kind, 0] += 1


@inlined
def is_below(S: F64, column: int, least: float) -> bool:
    """Whether all numbers of a column are closer to 0 than ``least``."""
    first, lane, most = N_STATE * (column // WIDTH), column % WIDTH, 0.0
    for i in range(N_STATE):
        most = max(most, abs(S[first + i, lane]))
    return bool(most < least)

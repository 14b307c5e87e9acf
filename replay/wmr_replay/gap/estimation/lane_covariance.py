"""The covariances of several passes of the filter at once, as :mod:`.filter` computes each of them.

Arrays have the numbers of a matrix in rows, one after the other, and the passes last: entry (i, j) of P
(9, 9) is row 9 i + j of ``P`` (81, lanes). The order of every sum is that of the single pass.
"""

from typing import Any

from wmr_replay.gap.model.dynamics import N_MOTION, N_STATE, YAW
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lanes import (
    alike,
    at,
    at_least,
    gathered,
    is_any,
    less_product,
    over,
    plus,
    plus_product,
    put,
    times,
)
from wmr_schemas.compiled.lean import inlined


@inlined
def across_lanes(f: Any, a: F64, first: int, step: int) -> Any:
    """Σ f a over seven rows of ``a``, ``step`` apart, one after the other."""
    x = times(f[0], at(a, first))
    x = plus_product(x, f[1], at(a, first + step))
    x = plus_product(x, f[2], at(a, first + 2 * step))
    x = plus_product(x, f[3], at(a, first + 3 * step))
    x = plus_product(x, f[4], at(a, first + 4 * step))
    x = plus_product(x, f[5], at(a, first + 5 * step))
    return plus_product(x, f[6], at(a, first + 6 * step))


@inlined
def row_of(F: F64, i: int) -> Any:
    """Row ``i`` of F without its first two columns, which are the identity's."""
    return (
        gathered(F, 9 * i + 2),
        gathered(F, 9 * i + 3),
        gathered(F, 9 * i + 4),
        gathered(F, 9 * i + 5),
        gathered(F, 9 * i + 6),
        gathered(F, 9 * i + 7),
        gathered(F, 9 * i + 8),
    )


@inlined
def predict_motion_of_lanes(F: F64, P: F64, i: int, out: F64) -> None:
    """Row ``i`` of ``out`` ← that of F P, one of the third to the sixth, but for its first two columns.

    Most of F is 0: rows of P that no lane takes are passed over.
    """
    own, p = gathered(F, 10 * i), 9 * i
    a, b, c, d = (
        times(own, at(P, p + 2)),
        times(own, at(P, p + 3)),
        times(own, at(P, p + 4)),
        times(own, at(P, p + 5)),
    )
    e, g, h = times(own, at(P, p + 6)), times(own, at(P, p + 7)), times(own, at(P, p + 8))
    for m in range(2, N_STATE):
        f, q = gathered(F, 9 * i + m), 9 * m
        if m != i and is_any(f):
            a, b = plus_product(a, f, at(P, q + 2)), plus_product(b, f, at(P, q + 3))
            c, d = plus_product(c, f, at(P, q + 4)), plus_product(d, f, at(P, q + 5))
            e, g = plus_product(e, f, at(P, q + 6)), plus_product(g, f, at(P, q + 7))
            h = plus_product(h, f, at(P, q + 8))
    put(out, p + 2, a)
    put(out, p + 3, b)
    put(out, p + 4, c)
    put(out, p + 5, d)
    put(out, p + 6, e)
    put(out, p + 7, g)
    put(out, p + 8, h)


@inlined
def predict_row_of_lanes(F: F64, ahead: F64, i: int, P: F64) -> None:
    """Row and column ``i`` of ``P`` ← those of F ``ahead``ᵀ, one of the third to the sixth.

    What is behind the diagonal is replaced by the rows that follow.
    """
    own = gathered(F, 10 * i)
    a, b, c = times(own, at(ahead, i)), times(own, at(ahead, 9 + i)), times(own, at(ahead, 18 + i))
    d, e, g = times(own, at(ahead, 27 + i)), times(own, at(ahead, 36 + i)), times(own, at(ahead, 45 + i))
    for m in range(2, N_STATE):
        f = gathered(F, 9 * i + m)
        if m != i and is_any(f):
            a, b = plus_product(a, f, at(ahead, m)), plus_product(b, f, at(ahead, 9 + m))
            c, d = plus_product(c, f, at(ahead, 18 + m)), plus_product(d, f, at(ahead, 27 + m))
            e, g = plus_product(e, f, at(ahead, 36 + m)), plus_product(g, f, at(ahead, 45 + m))
    put_both(P, i, 0, a)
    put_both(P, i, 1, b)
    put_both(P, i, 2, c)
    put_both(P, i, 3, d)
    put_both(P, i, 4, e)
    put_both(P, i, 5, g)


@inlined
def predict_covariances(F: F64, P: F64, ahead: F64) -> None:
    """``P`` (81, lanes) ← F P Fᵀ of each lane, F in ``F`` (lanes, 81); ``ahead`` (54, lanes) is scratch."""
    for i in range(2):
        f = row_of(F, i)
        for j in range(N_STATE):
            put(ahead, 9 * i + j, plus(at(P, 9 * i + j), across_lanes(f, P, 18 + j, 9)))
    for i in range(2, N_MOTION):
        predict_motion_of_lanes(F, P, i, ahead)
    for i in range(N_MOTION, N_STATE):
        own = gathered(F, 10 * i)
        for j in range(N_MOTION):
            put_both(P, i, j, times(own, at(ahead, 9 * j + i)))
        for j in range(N_MOTION, N_STATE):
            put(P, 9 * i + j, times(at(P, 9 * i + j), times(own, gathered(F, 10 * j))))
    for i in range(2):
        f = row_of(F, i)
        for j in range(i + 1):
            put_both(P, i, j, plus(at(ahead, 9 * j + i), across_lanes(f, ahead, 9 * j + 2, 1)))
    for i in range(2, N_MOTION):
        predict_row_of_lanes(F, ahead, i, P)


@inlined
def put_both(P: F64, i: int, j: int, x: Any) -> None:
    """Entries (i, j) and (j, i) of ``P`` (81, lanes) ← x."""
    put(P, 9 * i + j, x)
    put(P, 9 * j + i, x)


@inlined
def gains_of_lanes(P: F64, slopes: F64, variances: F64, crossed: F64, gains: F64, s: F64) -> None:
    """``crossed``, ``gains`` (27, lanes) and ``s`` (3, lanes) ← P hᵀ, P hᵀ/s and the innovations' variances.

    One component of the pose after the other; ``slopes`` (3, lanes) are theirs by yaw, ``variances`` (3,)
    those of the measurement.
    """
    for c in range(3):
        slope = at(slopes, c)
        for i in range(N_STATE):
            put(crossed, 9 * c + i, plus_product(at(P, 9 * i + c), slope, at(P, 9 * i + YAW)))
        for d in range(c):
            known = plus_product(at(crossed, 9 * d + c), slope, at(crossed, 9 * d + YAW))
            for i in range(N_STATE):
                put(crossed, 9 * c + i, less_product(at(crossed, 9 * c + i), at(gains, 9 * d + i), known))
        own = plus(alike(variances[c]), at(crossed, 10 * c))
        variance = plus_product(own, slope, at(crossed, 9 * c + YAW))
        put(s, c, variance)
        share = over(alike(1.0), variance)
        for i in range(N_STATE):
            put(gains, 9 * c + i, times(at(crossed, 9 * c + i), share))


@inlined
def update_covariances(P: F64, crossed: F64, gains: F64) -> None:
    """``P`` (81, lanes) ← P − Σ K (P hᵀ)ᵀ over the three components of a pose."""
    for i in range(N_STATE):
        x, y, yaw = at(gains, i), at(gains, 9 + i), at(gains, 18 + i)
        for j in range(i + 1):
            left = less_product(at(P, 9 * i + j), x, at(crossed, j))
            left = less_product(less_product(left, y, at(crossed, 9 + j)), yaw, at(crossed, 18 + j))
            put_both(P, i, j, at_least(left, alike(1e-16)) if i == j else left)

"""α as a weighted regression over time, (14) and (15) of the paper."""

import math
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean


class AlphaState(NamedTuple):
    """Running regression of α: sums (2,) Σ w F² and Σ w F y; pending row (3,) F, y, w; stamps (3,) of the
    pending row, the last row taken up, the last slip.
    """

    sums: F64
    pending: F64
    stamps_ns: I64


def fresh_alpha() -> AlphaState:
    """The regression before its first row."""
    long_ago = np.int64(-(2**61))
    return AlphaState(np.zeros(2), np.zeros(3), np.array([long_ago, long_ago, long_ago]))


@lean
def regress_alpha(
    state: AlphaState, t_ns: int, window_ns: int, seen: tuple[float, float, float], slips: bool
) -> int:
    """One step of α = Σ w F y / Σ w F², w = 1/var y, over rows a window apart, whose noise is independent;
    ``seen`` are F, y and var y.

    y = dv_long/dt − v_lat ω/3 = α F in ideal rolling and in skidding, (14) and (15). A row counts once a
    window has passed after it, and one before it, without a sign of slip: it then holds no slip itself.
    Returns the stamp before which a call without slip changes nothing.
    """
    sums, pending, stamps = state.sums, state.pending, state.stamps_ns
    if slips:
        stamps[2] = t_ns
        pending[2] = 0.0
    if pending[2] > 0.0 and t_ns - stamps[0] >= window_ns:
        weighted = pending[2] * pending[0]
        sums[0] += weighted * pending[0]
        sums[1] += weighted * pending[1]
        pending[2] = 0.0
    if pending[2] == 0.0 and t_ns - stamps[1] >= window_ns and t_ns - stamps[2] >= window_ns:
        force, response, variance = seen
        if variance > 0.0:
            pending[0], pending[1], pending[2] = force, response, 1.0 / variance
            stamps[0] = stamps[1] = t_ns
    return int((stamps[0] if pending[2] > 0.0 else max(stamps[1], stamps[2])) + window_ns)


@lean
def fit_of(state: AlphaState) -> tuple[float, float]:
    """α and its standard deviation so far."""
    weight = state.sums[0]
    return (state.sums[1] / weight, 1.0 / math.sqrt(weight)) if weight > 0.0 else (math.nan, math.nan)

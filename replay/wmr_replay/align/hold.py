"""Zero-order hold: the mean, over each pose interval, of inputs that are held from their stamps on."""

import math

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean


def hold_mean(
    pose_ns: I64, before_ns: int, t_ns: I64, values: F64, held_ns: int, held: F64, max_hold_ns: int
) -> tuple[F64, int, int]:
    """Mean of held inputs over each interval (previous pose stamp, pose stamp].

    With u(s) = values[:, j] for t_j ≤ s < t_{j+1}: mean_i = ∫ u ds / (t_i − t_{i−1}); ``before_ns`` precedes
    the first row (where it equals the first stamp, that row has the input in force). An input that stands for
    longer than ``max_hold_ns`` is unknown from then on (NaN), as is one not yet seen. No stamp after t_i
    enters row i.

    ``pose_ns`` (n,) and ``t_ns`` (m,) increase; ``held`` (k,), stamped ``held_ns``, is in force before the
    first of ``t_ns`` and is carried on in place. Returns the means (k, n), the stamp of the input in force at
    the last pose, and how many of the m rows were used up; the rest belong to later intervals.
    """
    means = np.empty((len(held), len(pose_ns)))
    values = np.ascontiguousarray(values)
    state = np.array([before_ns, held_ns, max_hold_ns], np.int64)
    used = hold_rows(pose_ns, t_ns, values, state, held, means, np.empty(len(held)))
    return means, int(state[1]), used


def last_before(pose_ns: I64, t_ns: I64, values: F64, held: float) -> tuple[F64, int]:
    """The value in force at each pose stamp: that of the last ``t_ns`` ≤ it, ``held`` before the first; rows
    used up.
    """
    out = np.empty(len(pose_ns))
    return out, fill_last_before(pose_ns, t_ns, np.ascontiguousarray(values), held, out)


@lean
def hold_rows(pose_ns: I64, t_ns: I64, values: F64, state: I64, held: F64, means: F64, total: F64) -> int:
    """:func:`hold_mean` into ``means``; the rows used up. ``state`` (3,) – stamps of the pose before and of
    the input in force, longest hold – and ``held`` are carried on; ``total`` (k,) is scratch.
    """
    n_inputs, n_values, max_hold_ns = held.shape[0], t_ns.shape[0], state[2]
    j = 0
    for i in range(pose_ns.shape[0]):
        end, before_ns = pose_ns[i], state[0]
        for k in range(n_inputs):
            total[k] = 0.0
        at = before_ns
        whole = end > before_ns and (j == n_values or t_ns[j] > end)
        while not whole:
            until = min(end, t_ns[j]) if j < n_values else end
            if until > at:
                share = (until - at) / (end - before_ns)
                unknown = until > state[1] + max_hold_ns
                for k in range(n_inputs):
                    total[k] += math.nan if unknown else held[k] * share
                at = until
            if j == n_values or t_ns[j] > end:
                break
            state[1] = t_ns[j]
            for k in range(n_inputs):
                held[k] = values[k, j]
            j += 1
        unknown = whole and end > state[1] + max_hold_ns
        for k in range(n_inputs):
            mean = held[k] if whole or end == before_ns else total[k]
            means[k, i] = math.nan if unknown else mean
        state[0] = end
    return j


@lean
def fill_last_before(pose_ns: I64, t_ns: I64, values: F64, held: float, out: F64) -> int:
    """:func:`last_before` into ``out``."""
    j = 0
    for i in range(pose_ns.shape[0]):
        while j < t_ns.shape[0] and t_ns[j] <= pose_ns[i]:
            held = values[j]
            j += 1
        out[i] = held
    return j

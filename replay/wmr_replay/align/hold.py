"""Zero-order hold: the mean, over each pose interval, of inputs that are held from their stamps on."""

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled


@compiled
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
    n_inputs = held.shape[0]
    means = np.empty((n_inputs, pose_ns.shape[0]))
    total = np.empty(n_inputs)
    j = 0
    for i in range(pose_ns.shape[0]):
        end = pose_ns[i]
        if end > before_ns and (j == t_ns.shape[0] or t_ns[j] > end):
            for k in range(n_inputs):
                means[k, i] = np.nan if end > held_ns + max_hold_ns else held[k]
            before_ns = end
            continue
        total[:] = 0.0
        at = before_ns
        while True:
            until = min(end, t_ns[j]) if j < t_ns.shape[0] else end
            if until > at:
                share = (until - at) / (end - before_ns)
                unknown = until > held_ns + max_hold_ns
                for k in range(n_inputs):
                    total[k] += np.nan if unknown else held[k] * share
                at = until
            if j == t_ns.shape[0] or t_ns[j] > end:
                break
            held_ns = t_ns[j]
            held[:] = values[:, j]
            j += 1
        means[:, i] = held if end == before_ns else total
        before_ns = end
    return means, held_ns, j


@compiled
def last_before(pose_ns: I64, t_ns: I64, values: F64, held: float) -> tuple[F64, int]:
    """The value in force at each pose stamp: that of the last ``t_ns`` ≤ it, ``held`` before the first; rows
    used up.
    """
    out = np.empty(pose_ns.shape[0])
    j = 0
    for i in range(pose_ns.shape[0]):
        while j < t_ns.shape[0] and t_ns[j] <= pose_ns[i]:
            held = values[j]
            j += 1
        out[i] = held
    return out, j

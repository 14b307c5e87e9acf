"""Finite impulse responses, summed in one fixed order so that chunking changes no bit."""

import numpy as np

from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled import compiled

BLOCK = 64


@compiled
def apply_taps(taps: F64, sums: F64, signal: F64, wanted: Bool, out: F64) -> None:
    """out[o, i] = Σ_k taps[o, k]·signal[i − k] for every i with ``wanted[i]``.

    ``taps`` (o, L) newest first, ``sums`` (o,) the sums that they have in exact arithmetic, so that a large
    offset costs no digits; ``signal`` (n,), ``out`` (o, n). Each output is summed from the newest sample to
    the oldest, whatever its neighbours: the compiler vectorises over outputs, which leaves every sum's order
    alone.
    """
    n_orders, n_taps = taps.shape
    total, gap = np.empty((n_orders, BLOCK)), np.empty(BLOCK)
    for start in range(0, len(signal), BLOCK):
        stop = min(start + BLOCK, len(signal))
        if not wanted[start:stop].any():
            continue
        first = max(start, n_taps - 1)
        newest, here = signal[first:stop], wanted[first:stop]
        total[:] = 0.0
        for k in range(n_taps):
            older = signal[first - k : stop - k]
            for b in range(len(newest)):
                gap[b] = older[b] - newest[b]
            for o in range(n_orders):
                row, weight = total[o], taps[o, k]
                for b in range(len(newest)):
                    row[b] += weight * gap[b]
        for o in range(n_orders):
            for b in range(len(newest)):
                if here[b]:
                    out[o, first + b] = total[o, b] + sums[o] * newest[b]

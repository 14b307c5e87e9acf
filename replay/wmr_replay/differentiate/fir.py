"""Finite impulse responses, summed in one fixed order so that chunking changes no bit."""

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64, Bool

BLOCK = 64


@njit(cache=True)
def apply_taps(taps: F64, samples: F64, wanted: Bool) -> F64:
    """out[o, i] = Σ_k taps[o, k]·samples[i + L − 1 − k] for every i with ``wanted[i]``, NaN elsewhere.

    ``taps`` (o, L) newest first, ``samples`` (n + L − 1,), ``wanted`` (n,). Each output is summed from the
    newest sample to the oldest, whatever its neighbours: the compiler vectorises over outputs, which leaves
    every sum's order alone.
    """
    n_orders, n_taps = taps.shape
    n = wanted.shape[0]
    out = np.full((n_orders, n), np.nan)
    total = np.empty(BLOCK)
    for start in range(0, n, BLOCK):
        size = min(BLOCK, n - start)
        if not wanted[start : start + size].any():
            continue
        for o in range(n_orders):
            total[:] = 0.0
            for k in range(n_taps):
                weight = taps[o, k]
                offset = start + n_taps - 1 - k
                for b in range(size):
                    total[b] += weight * samples[offset + b]
            for b in range(size):
                if wanted[start + b]:
                    out[o, start + b] = total[b]
    return out

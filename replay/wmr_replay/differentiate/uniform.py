"""Block backend on uniform stamps: constant work per row (see ``blocks``)."""

import numpy as np

from wmr_replay.differentiate.blocks import (
    Signals,
    block_of,
    centred_samples,
    integrated_input,
    moments_about_head,
)
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled import compiled


def anchor_powers(n_taps: int, n_powers: int) -> F64:
    """(k/(L−1))^p for k = −L … L−1, shape (n_powers, 2L)."""
    return (np.arange(-n_taps, n_taps) / (n_taps - 1)) ** np.arange(n_powers)[:, None]


@compiled
def add_products(taps: F64, moments: F64, total: F64) -> None:
    """``total[i] += taps[i]·moments[i]`` as far as all three reach."""
    for i in range(min(len(taps), len(moments), len(total))):
        total[i] += taps[i] * moments[i]


@compiled
def weigh(taps: F64, moments: F64, low: int, head: int, row: int, wanted: Bool, out: F64) -> None:
    """``out[i] = Σ_p taps[p, i]·moment_p`` of the L samples up to row + i, for i with ``wanted[i]``."""
    n_taps = taps.shape[1]
    total = np.zeros(len(wanted))
    for p in range(taps.shape[0]):
        here = taps[p, row - head :]
        add_products(here, moments[p, row - low :], total)
        add_products(here, moments[p, row - n_taps + 1 - low : head - low], total)
    for i in range(len(wanted)):
        if wanted[i]:
            out[i] = total[i]


@compiled
def uniform_rows(
    signals: Signals, step_s: float, wanted: Bool, design: tuple[F64, F64], out: tuple[F64, F64]
) -> None:
    """Fill the columns with ``wanted`` of ``out``: estimates (s, 3, n) and filtered inputs (k, n).

    ``design`` is (:func:`anchor_powers`, ``exact.anchored_taps``). The window of each wanted row is its last
    L samples, and these are uniform.
    """
    powers, taps = design
    estimates, filtered = out
    samples, inputs = signals.samples, signals.inputs
    n_powers, n_taps = taps.shape[1:]
    row = 0
    while row < len(wanted):
        if not wanted[row]:
            row += 1
            continue
        _, head, stop = block_of(signals, row)
        stop = min(stop, head + n_taps)
        low, here = min(row - n_taps + 1, head), wanted[row:stop]
        span = powers[:, low - head + n_taps : stop - head + n_taps]
        local, dt_s = np.empty(stop - low), np.full(stop, step_s)
        moments = np.empty((n_powers, stop - low))
        for s in range(len(samples)):
            centred_samples(samples[s], low, head, stop, local)
            moments_about_head(local, span, head - low, moments)
            for order in range(len(taps)):
                weigh(taps[order], moments, low, head, row, here, estimates[s, order, row:stop])
            estimates[s, 0, row:stop] += samples[s, head]
        for k in range(len(inputs)):
            integrated_input(inputs[k], dt_s, signals.folds[k], low, head, stop, local)
            moments_about_head(local, span, head - low, moments)
            weigh(taps[signals.folds[k]], moments, low, head, row, here, filtered[k, row:stop])
        row = stop

"""Block backend on uniform stamps: constant work per row (see ``blocks``)."""

from typing import NamedTuple

import numpy as np

from wmr_replay.differentiate.blocks import (
    Signals,
    block_of,
    centred_samples,
    integrated_input,
    moments_about_head,
)
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled.lean import lean


def anchor_powers(n_taps: int, n_powers: int) -> F64:
    """(k/(L−1))^p for k = −L … L−1, shape (n_powers, 2L)."""
    return (np.arange(-n_taps, n_taps) / (n_taps - 1)) ** np.arange(n_powers)[:, None]


@lean
def add_products(taps: F64, moments: F64, total: F64) -> None:
    """``total[i] += taps[i]·moments[i]`` as far as all three reach."""
    for i in range(min(len(taps), len(moments), len(total))):
        total[i] += taps[i] * moments[i]


@lean
def weigh(taps: F64, moments: F64, low: int, head: int, row: int, total: F64) -> None:
    """``total[i]`` ← Σ_p taps[p, i]·moment_p of the L samples up to row + i."""
    n_taps = taps.shape[1]
    for i in range(len(total)):
        total[i] = 0.0
    for p in range(taps.shape[0]):
        here = taps[p, row - head :]
        add_products(here, moments[p, row - low :], total)
        add_products(here, moments[p, row - n_taps + 1 - low : head - low], total)


@lean
def put(total: F64, row: int, wanted: Bool, out: F64) -> None:
    """``out[row + i]`` ← ``total[i]`` in the ``wanted`` rows."""
    for i in range(len(total)):
        if wanted[row + i]:
            out[row + i] = total[i]


class BlockScratch(NamedTuple):
    """Memory for one block, whose rows reach over at most 2L samples.

    Values (2L,) about the block's anchor, their moments (n_powers, 2L), weighted sums (2L,), and the length
    of every interval (n,) in s.
    """

    values: F64
    moments: F64
    total: F64
    dt_s: F64


def uniform_rows(
    signals: Signals, step_s: float, wanted: Bool, design: tuple[F64, F64], out: tuple[F64, F64]
) -> None:
    """Fill the columns with ``wanted`` of ``out``: estimates (s, 3, n) and filtered inputs (k, n).

    ``design`` is (:func:`anchor_powers`, ``exact.anchored_taps``). The window of each wanted row is its last
    L samples, and these are uniform.
    """
    _, n_powers, n_taps = design[1].shape
    size = 2 * n_taps
    scratch = BlockScratch(
        np.empty(size), np.empty((n_powers, size)), np.empty(size), np.full(len(wanted), step_s)
    )
    fill_blocks(signals, wanted, *design, scratch, *out)


@lean
def fill_blocks(
    signals: Signals,
    wanted: Bool,
    powers: F64,
    taps: F64,
    scratch: BlockScratch,
    estimates: F64,
    filtered: F64,
) -> None:
    """See :func:`uniform_rows`: one block after the other."""
    samples, inputs, folds = signals.samples, signals.inputs, signals.folds
    n_signals, n_taps, moments = len(samples), taps.shape[2], scratch.moments
    row = 0
    while row < len(wanted):
        if not wanted[row]:
            row += 1
            continue
        _, head, stop = block_of(signals, row)
        stop = min(stop, head + n_taps)
        low = min(row - n_taps + 1, head)
        span = powers[:, low - head + n_taps : stop - head + n_taps]
        local, total = scratch.values[: stop - low], scratch.total[: stop - row]
        for s in range(n_signals + len(inputs)):
            k = s - n_signals
            if k < 0:
                first, end = 0, len(taps)
                centred_samples(samples[s], low, head, stop, local)
            else:
                first, end = folds[k], folds[k] + 1
                integrated_input(inputs[k], scratch.dt_s, folds[k], low, head, stop, local)
            moments_about_head(local, span, head - low, moments)
            for order in range(first, end):
                weigh(taps[order], moments, low, head, row, total)
                put(total, row, wanted, estimates[s, order] if k < 0 else filtered[k])
            if k < 0:
                for i in range(row, stop):
                    estimates[s, 0, i] += samples[s, head]
        row = stop

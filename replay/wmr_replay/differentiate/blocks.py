"""Sliding sums in O(1) per row without drift: moments about anchors at fixed instants.

Time is cut into blocks of the window's length, counted from the log's first stamp. A window that ends in a
block is the end of the block before (a suffix, summed backwards from the anchor, the block's start) and the
beginning of its own (a prefix, summed forwards). Both are moments about the same anchor, so a window's moment
is their sum. Nothing is carried from block to block: no drift however long the log; a sample that is not a
number spoils the windows that hold it and no other; and what a row gets depends on its own window and the
first stamp alone, so batches change no bit (van Herk 1992, Gil and Werman 1993, for sums in place of maxima).
"""

from typing import NamedTuple

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean


class Signals(NamedTuple):
    """The buffer of n samples: stamps (n,), ``samples`` (s, n), ``inputs`` (k, n), ``folds`` (k,); and the
    grid of blocks: the log's first stamp, the blocks' length.
    """

    t_ns: I64
    samples: F64
    inputs: F64
    folds: I64
    start_ns: int
    block_ns: int


@lean
def block_of(signals: Signals, row: int) -> tuple[int, int, int]:
    """Anchor of the block that holds ``row``, its first sample there, and the row behind the block's last."""
    start_ns, block_ns = signals.start_ns, signals.block_ns
    anchor_ns = start_ns + (signals.t_ns[row] - start_ns) // block_ns * block_ns
    return anchor_ns, first_from(signals.t_ns, anchor_ns), first_from(signals.t_ns, anchor_ns + block_ns)


@lean
def first_from(t_ns: I64, start_ns: int) -> int:
    """The first of increasing stamps (n,) at or after ``start_ns``; n where there is none."""
    low, high = 0, len(t_ns)
    while low < high:
        middle = (low + high) // 2
        if t_ns[middle] < start_ns:
            low = middle + 1
        else:
            high = middle
    return low


@lean
def centred_samples(signal: F64, low: int, head: int, stop: int, out: F64) -> None:
    """``out[j] = signal[low + j] − signal[head]``: a large offset costs no digits."""
    part, origin = signal[low:stop], signal[head]
    for j in range(len(part)):
        out[j] = part[j] - origin


@lean
def integrated_input(means: F64, dt_s: F64, fold: int, low: int, head: int, stop: int, out: F64) -> None:
    """The ``fold``-times integral of an input that is constant over each interval, zero at ``head``: (stop −
    low,).

    ``means[j]`` holds over the interval of length ``dt_s[j]`` that ends at sample j. Its derivative of order
    ``fold``, estimated like any signal's, is the input behind the integrated kernel (see
    ``design.input_taps``): Σ h_k ∫∫u = ∫ g u, summed by parts.
    """
    speed, place = 0.0, 0.0
    out[head - low] = 0.0
    for j in range(head + 1, stop):
        gain = means[j] * dt_s[j]
        place += gain if fold == 1 else (speed + 0.5 * gain) * dt_s[j]
        speed += gain
        out[j - low] = place
    speed, place = 0.0, 0.0
    for j in range(head, low, -1):
        gain = means[j] * dt_s[j]
        speed -= gain
        place -= gain if fold == 1 else (speed + 0.5 * gain) * dt_s[j]
        out[j - 1 - low] = place


@lean
def moments_about_head(values: F64, powers: F64, split: int, out: F64) -> None:
    """Running moments on both sides of the anchor, ``out`` (p, n) from ``values`` (n,) and ``powers`` (p, n).

    Column j < split is Σ_{k=j}^{split−1}, column j ≥ split is Σ_{k=split}^{j}.
    """
    for p in range(len(powers)):
        factor, side = powers[p], out[p]
        total = 0.0
        for j in range(split - 1, -1, -1):
            total += factor[j] * values[j]
            side[j] = total
        total = 0.0
        for j in range(split, len(values)):
            total += factor[j] * values[j]
            side[j] = total

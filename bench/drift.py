"""Drift: the last window of 1e8 streamed samples against exact rationals and a log that begins late."""

import time
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from wmr_replay.differentiate import Differentiator, KernelSpec
from wmr_schemas.arrays import F64, I64

STEP_S, WINDOW_S, BATCH = 0.001, 0.5, 10_000
N_TAPS = 501
STEP_NS, START_NS = 1_000_000, 10**18
OFFSET, NOISE = 1e6, 0.01
MOST_SD = 1e-9


def batches(n_rows: int, seed: int) -> Iterator[tuple[I64, F64]]:
    """Stamps (10,000,) and samples (1, 10,000) of a noisy sine on an offset of a million."""
    rng = np.random.default_rng(seed)
    for first in range(0, n_rows, BATCH):
        index = np.arange(first, first + BATCH)
        noise = NOISE * rng.standard_normal(BATCH)
        yield START_NS + index * STEP_NS, (OFFSET + np.sin(index * STEP_S) + noise)[None]


def exact_last(samples: F64) -> tuple[Fraction, Fraction]:
    """First and second derivative at the middle of a parabola fitted to 501 samples, oldest first."""
    place, values = range(-(N_TAPS // 2), N_TAPS // 2 + 1), [Fraction(float(x)) for x in samples]
    s2, s4 = sum(k**2 for k in place), sum(k**4 for k in place)
    sums = [sum((k**p * x for k, x in zip(place, values, strict=True)), Fraction(0)) for p in (0, 1, 2)]
    step = Fraction(1, 1000)
    second = 2 * (N_TAPS * sums[2] - s2 * sums[0]) / (N_TAPS * s4 - s2**2)
    return sums[1] / s2 / step, second / step**2


def drift_lines(n_rows: int) -> Iterator[str]:
    """Report lines: the error of the last row in standard deviations of the estimate, and the time taken."""
    stage = Differentiator(KernelSpec(2), window_s=WINDOW_S, step_s=STEP_S)
    start, held = time.perf_counter(), []
    for t_ns, samples in batches(n_rows, seed=3):
        out = stage.push(t_ns, samples, np.empty((0, BATCH)))
        held = [*held[-1:], (t_ns, samples)]
    seconds = time.perf_counter() - start
    exact = exact_last(held[-1][1][0, -N_TAPS:])
    sd = out.sd(NOISE)[0, :, -1]
    late = Differentiator(KernelSpec(2), window_s=WINDOW_S, step_s=STEP_S)
    fresh = [late.push(t_ns, samples, np.empty((0, BATCH))) for t_ns, samples in held][-1]
    yield f"{n_rows:.0e} samples in batches of {BATCH}, {seconds:.1f} s with making them"
    for n in (1, 2):
        off = abs(float(Fraction(float(out.estimates[0, n, -1])) - exact[n - 1])) / sd[n]
        apart = np.max(np.abs(out.estimates[0, n, -N_TAPS:] - fresh.estimates[0, n, -N_TAPS:])) / sd[n]
        yield (
            f"{verdict(max(off, apart) < MOST_SD)}: order {n}, the last row {off:.1e} sd off the exact fit, "
            f"the last 501 at most {apart:.1e} sd off a log's that begins 20,000 samples earlier"
        )


def verdict(holds: bool) -> str:
    """PASS or SHORTFALL for a line of the report."""
    return "PASS" if holds else "SHORTFALL"

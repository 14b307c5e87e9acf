"""The monitors' sums: compiled and plain give the same bits, whatever the rows and the batches."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.quality.sum_rules import N_SUMS
from wmr_replay.quality.sums import COMPILED, PLAIN

SHARES, CENTRES = np.array([0.25, 0.5, 0.75]), np.linspace(-1.0, 1.0, 9)


def spoilt(rng, values):
    """The values, some of them unknown or huge."""
    values[rng.random(values.shape) < 0.02] = np.nan
    values[rng.random(values.shape) < 0.01] = rng.choice([1e300, -1e31, np.inf, 0.0])
    return values


def add_up(sums, rng, cuts):
    values, total = spoilt(rng, rng.normal(size=(17, cuts[-1]))), np.zeros(34)
    begins, told = np.flatnonzero(rng.random(cuts[-1]) < 0.1), []
    for a, b in itertools.pairwise(cuts):
        own = begins[(begins >= a) & (begins < b)] - a
        edges = np.zeros((34, 1 + len(own)))
        sums.add_up(np.ascontiguousarray(values[:, a:b]), own, total, edges)
        told += [edges[:, 1:], total[:, None].copy()]
    return told


def add_rows(sums, rng, cuts):
    measured = rng.normal(size=(8, cuts[-1]))
    measured[0], measured[1] = 0.05, np.abs(measured[1])
    measured[5:7] = 0.02 * np.abs(measured[5:7])
    spoilt(rng, measured[1:2]), spoilt(rng, measured[5:6])
    wheels, total, told = spoilt(rng, rng.normal(size=(2, cuts[-1]))), np.zeros(N_SUMS), []
    for a, b in itertools.pairwise(cuts):
        ends, found = np.zeros(b - a, np.int64), np.zeros((b - a, N_SUMS))
        parts = np.ascontiguousarray(measured[:, a:b]), np.ascontiguousarray(wheels[:, a:b])
        k = sums.add_rows(*parts, total, ends, found)
        told += [ends[:k] + a, found[:k], total.copy()]
    return told


def add_differences(sums, rng, cuts):
    t_ns = np.cumsum(np.where(rng.random(cuts[-1]) < 0.05, 3e6, 1e6))
    columns, told = np.stack([t_ns, *rng.normal(size=(3, cuts[-1]))]), np.zeros(3)
    usable_s = rng.choice([0.0, 0.02, 1.0], size=cuts[-1])
    for b in cuts[1:]:
        sums.add_differences(np.ascontiguousarray(columns[:, :b]), usable_s, (6, 2, 2), 2e6, told)
    return [told]


def count_votes(sums, rng, cuts):
    bins, below, told = rng.integers(-1, len(CENTRES), cuts[-1]), np.zeros(len(CENTRES), np.int64), []
    for a, b in itertools.pairwise(cuts):
        n, quantiles = np.zeros(b - a), np.zeros((b - a, len(SHARES)))
        sums.count_votes(bins[a:b], below, SHARES, CENTRES, n, quantiles)
        told += [n, quantiles, below.copy()]
    return told


@pytest.mark.parametrize("work", [add_up, add_rows, add_differences, count_votes])
@given(seed=st.integers(0, 2**32), lengths=st.lists(st.integers(0, 90), min_size=1, max_size=4))
def test_compiled_and_plain_sums_are_the_same_to_the_bit(work, seed, lengths):
    cuts = np.cumsum([0, *lengths])
    with np.errstate(all="ignore"):
        one, other = (work(sums, np.random.default_rng(seed), cuts) for sums in (COMPILED, PLAIN))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)

"""Tests of paired differences against those of scipy."""

import numpy as np
import pytest
from scipy.stats import bootstrap, wilcoxon

from wmr_replay.gap.evidence.paired import bootstrap_interval, signed_rank_p


@pytest.mark.parametrize("n", [3, 12, 50, 51, 200])
def test_signed_ranks_agree_with_scipy(n):
    rng = np.random.default_rng(n)
    for shift in (-0.3, 0.0, 0.4):
        differences = rng.normal(shift, 1.0, n)
        expected = wilcoxon(differences, alternative="greater").pvalue
        assert signed_rank_p(differences) == pytest.approx(expected, rel=1e-9)


def test_ties_and_zeros_agree_with_scipy():
    differences = np.array([0.0, 1.0, 1.0, -1.0, 2.0, 3.0, -2.0, 4.0, 0.0, 5.0, 1.5, 2.5, -0.5, 6.0] * 5)
    expected = wilcoxon(differences, alternative="greater", method="approx").pvalue
    assert signed_rank_p(differences) == pytest.approx(expected, rel=1e-9)
    assert signed_rank_p(np.zeros(4)) == 1.0


def test_the_bootstraps_interval_is_scipys():
    rng = np.random.default_rng(5)
    before = rng.uniform(1.0, 2.0, 20)
    after = before * rng.uniform(0.5, 1.1, 20)

    def reduction(b, a, axis=-1):
        return 1 - np.sqrt(np.mean(a**2, axis=axis) / np.mean(b**2, axis=axis))

    found = bootstrap(
        (before, after), reduction, paired=True, vectorized=True, n_resamples=999, method="percentile", rng=3
    ).confidence_interval
    assert bootstrap_interval((before, after), reduction, 999, 3) == pytest.approx((found.low, found.high))

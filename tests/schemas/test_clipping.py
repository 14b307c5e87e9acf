"""The clipped variance tracker against the normal distribution's own numbers."""

import math

import numpy as np
import pytest

from wmr_schemas.clipping import CLIPPED_MEAN, clipped_update


def test_the_mean_of_a_clipped_square_is_its_closed_form() -> None:
    """E[min(z², 9)] = E[z²; |z| < 3] + 9 P(|z| ≥ 3) = (1 − 2 Q − 6 φ) + 18 Q."""
    tail, density = math.erfc(3 / math.sqrt(2)) / 2, math.exp(-4.5) / math.sqrt(2 * math.pi)
    assert pytest.approx(1 + 16 * tail - 6 * density, abs=1e-15) == CLIPPED_MEAN


def test_white_noise_keeps_its_variance_and_outliers_hardly_raise_it() -> None:
    rng = np.random.default_rng(1)
    clean = 0.3 * rng.standard_normal(20_000)
    spoilt = np.where(rng.random(20_000) < 0.01, 100.0, clean)
    found = []
    for signal in (clean, spoilt):
        variance, total = 0.09, 0.0
        for value in signal:
            variance = clipped_update(variance, float(value) ** 2, 0.01)
            total += variance
        found.append(total / len(signal))
    assert found[0] == pytest.approx(0.09, rel=0.02)
    assert 0.09 < found[1] < 0.09 * 1.15


def test_a_gain_of_one_takes_the_new_square_alone() -> None:
    assert clipped_update(4.0, 9.0, 1.0) == pytest.approx(9.0 / CLIPPED_MEAN)
    assert clipped_update(4.0, 1e9, 1.0) == pytest.approx(36.0 / CLIPPED_MEAN)
    assert clipped_update(4.0, 1e9, 0.0) == 4.0

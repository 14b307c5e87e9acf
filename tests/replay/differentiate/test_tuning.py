"""``tune``: close to the best choice in hindsight, with honest expected errors; the baselines are correct."""

import numpy as np
import pytest
from scipy.signal import butter, fftconvolve, sosfilt

from wmr_replay.differentiate import KernelSpec, uniform_taps
from wmr_replay.differentiate.baselines import (
    butterworth_response,
    chain_of_integrators,
    delay_of,
    kalman_response,
)
from wmr_replay.differentiate.smoother import STENCIL, penalty_bands
from wmr_replay.differentiate.tuning import tune
from wmr_schemas.errors import InvalidSetting

STEP_S = 0.01
RADPS = 2 * np.pi * np.array([0.2, 0.5, 0.9])
AMPLITUDES = np.array([1.0, 0.5, 0.25])


def sines(t_s, order=0):
    """Three sines or their derivatives."""
    phase = RADPS[:, None] * t_s + order * np.pi / 2
    return (AMPLITUDES * RADPS**order) @ np.sin(phase)


def true_rmse(expectation, order, sigma):
    """Bias on a long noise-free stretch, noise from the taps: independent of what ``tune`` was shown."""
    taps = uniform_taps(expectation.spec, round(expectation.window_s / STEP_S) + 1, STEP_S)[order]
    t_s = 500 + np.arange(5000) * STEP_S
    error = fftconvolve(sines(t_s), taps, "valid") - sines(t_s[len(taps) - 1 :] - expectation.delay_s, order)
    return np.hypot(np.sqrt(np.mean(error**2)), sigma * np.sqrt(np.sum(taps**2)))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("sigma", [0.001, 0.01, 0.1])
def test_the_choice_is_near_the_best_in_hindsight_and_its_expectation_holds(order, sigma):
    t_s = np.arange(1000) * STEP_S
    noisy = 50 + 2 * t_s + sines(t_s) + sigma * np.random.default_rng(1).normal(size=1000)
    result = tune(noisy, sigma, 0.14, step_s=STEP_S, order=order)
    got = true_rmse(result.choice, order, sigma)
    best = min(true_rmse(candidate, order, sigma) for candidate in result.candidates)
    assert result.choice.delay_s <= 0.14 + 1e-9
    assert got <= 1.1 * best
    assert result.choice.rmse == pytest.approx(got, rel=0.1)


def test_recursive_rivals_are_judged_by_the_same_rule():
    t_s = np.arange(1000) * STEP_S
    noisy = sines(t_s) + 0.1 * np.random.default_rng(2).normal(size=1000)
    result = tune(noisy, 0.1, 0.14, step_s=STEP_S)
    assert result.butterworth is not None
    assert result.kalman is not None
    assert result.butterworth.delay_s <= 0.14
    assert 0.5 < result.kalman.rmse / result.choice.rmse < 2
    assert [e.rmse for e in result.candidates] == sorted(e.rmse for e in result.candidates)


def test_a_stretch_too_short_for_any_kernel_says_so():
    with pytest.raises(InvalidSetting, match="23 samples are too few"):
        tune(np.arange(23.0), 0.1, 0.1, step_s=STEP_S)


def test_penalty_is_the_product_of_the_difference_matrix_with_itself():
    for n in (6, 9, 30):
        differences = np.zeros((n - 4, n))
        for i in range(n - 4):
            differences[i, i : i + 5] = STENCIL
        bands = penalty_bands(n)
        for lag in range(5):
            expected = np.diagonal(differences.T @ differences, lag)
            np.testing.assert_allclose(bands[4 - lag, lag:], expected, atol=1e-12)


def test_butterworth_response_is_that_of_the_filter():
    response = butterworth_response(1, 2, 3.0, STEP_S, 2000)
    x = np.random.default_rng(0).normal(size=500)
    smooth = sosfilt(butter(2, 6.0 * STEP_S, output="sos"), x)
    expected = np.diff(smooth, prepend=0.0) / STEP_S
    np.testing.assert_allclose(np.convolve(x, response)[:500], expected, atol=1e-3)
    assert butterworth_response(1, 2, 49.0, STEP_S, 2000) is None
    assert delay_of(uniform_taps(KernelSpec(2), 51, STEP_S)[1], 1, STEP_S) == pytest.approx(0.25)


def test_kalman_response_is_that_of_the_fixed_lag_smoother():
    """A textbook forward filter on the state augmented by its own past, run sample by sample."""
    order, lag, sigma, intensity = 1, 5, 0.1, 2.0
    transition, process = chain_of_integrators(3, STEP_S)
    size = 3 * (lag + 1)
    big, noise = np.eye(size, k=-3), np.zeros((size, size))
    big[:3, :3], big[:3, 3:] = transition, 0.0
    noise[:3, :3] = intensity * process
    observe = np.eye(size)[:1]
    x = np.random.default_rng(0).normal(size=3000)
    state, covariance, out = np.zeros(size), np.eye(size), []
    for sample in x:
        state, covariance = big @ state, big @ covariance @ big.T + noise
        gain = covariance @ observe.T / (observe @ covariance @ observe.T + sigma**2)
        state = state + gain[:, 0] * (sample - state[0])
        covariance = covariance - gain @ observe @ covariance
        out.append(state[3 * lag + order])
    response = kalman_response(order, intensity, sigma, lag, STEP_S, 3000)
    ours = np.convolve(x, response)[:3000]
    np.testing.assert_allclose(ours[-500:], out[-500:], atol=2e-3 * np.std(out))

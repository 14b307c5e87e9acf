"""Colour of noise: made-up noise of known parts is told apart; a kernel errs by as much as foretold."""

import numpy as np
import pytest

from wmr_replay.differentiate import KernelSpec, uniform_taps
from wmr_replay.differentiate.colour import EVIDENCE, Scales, colour_of, explanations, kernel_noise, shapes_of

STEP_S, N = 0.01, 12_000


def wobble(n, time_s, rng):
    """A first-order process of unit variance."""
    kept, out = np.exp(-STEP_S / time_s), rng.normal(0, 1, n)
    for k in range(1, n):
        out[k] = kept * out[k - 1] + np.sqrt(1 - kept**2) * out[k]
    return out


def rows(position, yaw=None, t_s=None):
    """Columns as the stage takes them; y and yaw like x where they are not given."""
    t_s = np.arange(len(position)) * STEP_S if t_s is None else t_s
    return np.stack([t_s, position, position, position if yaw is None else yaw, np.zeros(len(position))])


def found(columns, pieces=1):
    scales = Scales(STEP_S)
    for part in np.array_split(columns, pieces, axis=1):
        scales.push(part)
    n, squares = scales.levels()
    shapes = shapes_of([scale.b for scale in scales.scales], STEP_S)
    return colour_of(explanations(n, squares[0], shapes))


def motion(n):
    """A metre a second that changes by .5 m/s² now and then."""
    acceleration = np.repeat(np.resize([0.5, -0.5, 0.0, -0.5, 0.5, 0.0], n // 200 + 1), 200)[:n]
    return np.cumsum(1.0 + np.cumsum(acceleration) * STEP_S) * STEP_S


def test_white_noise_on_motion_is_white():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        colour = found(rows(motion(N) + 0.003 * rng.normal(0, 1, N)))
        assert colour.evidence < EVIDENCE
        assert colour.white == pytest.approx(0.003**2, rel=0.1)


@pytest.mark.parametrize("time_s", [0.02, 0.1, 0.5])
def test_a_wobble_is_found_with_its_rate_and_no_shorter_time(time_s):
    """Of a time beyond what motion lets one see, the rate of the drift, size²/time, is all that shows."""
    rng = np.random.default_rng(1)
    noise = 0.01 * (0.5 * rng.normal(0, 1, N) + wobble(N, time_s, rng))
    colour = found(rows(motion(N) + noise))
    assert colour.evidence > 2 * EVIDENCE
    assert colour.time_s >= time_s / 2.6
    assert colour.wobble / colour.time_s == pytest.approx(0.01**2 / time_s, rel=0.4)


def test_batches_change_no_bit_and_the_means_of_blocks_are_those_of_all_rows():
    rng = np.random.default_rng(2)
    columns = rows(rng.normal(0, 1, 3001), rng.normal(0, 1, 3001))
    whole = Scales(STEP_S)
    whole.push(columns)
    for pieces in (7, 600):
        parts = Scales(STEP_S)
        for part in np.array_split(columns, pieces, axis=1):
            parts.push(part)
        assert [scale.level for scale in parts.scales] == [scale.level for scale in whole.scales]
    means = columns[1, : 3001 // 8 * 8].reshape(-1, 8).mean(axis=1)
    third = np.diff(means, 3) / np.sqrt(20)
    assert whole.scales[3].level[1] == pytest.approx(np.mean(third**2))


def test_neither_a_jump_nor_a_hole_is_noise():
    rng = np.random.default_rng(3)
    noise = 0.003 * rng.normal(0, 1, N)
    jumps = rows(noise + 5.0 * (np.arange(N) > 6000))
    jumps[4] = np.arange(N) > 6000
    assert found(jumps).white == pytest.approx(0.003**2, rel=0.1)
    kept = (np.arange(N) < 5000) | (np.arange(N) > 6000)
    at = np.arange(N) * STEP_S
    holed = found(rows((at**2 + noise)[kept], t_s=at[kept]))
    assert holed.white == pytest.approx(0.003**2, rel=0.1)


def test_the_kernel_errs_by_as_much_as_is_foretold():
    spec, n_taps, rng = KernelSpec(2), 41, np.random.default_rng(4)
    taps = uniform_taps(spec, n_taps, STEP_S)
    noise = 0.01 * (0.5 * rng.normal(0, 1, 200_000) + wobble(200_000, 0.1, rng))
    foretold = kernel_noise(found(rows(noise[:N])), spec, n_taps, STEP_S)
    tracked = found(rows(noise[:N])).tracked
    for order, factor in ((1, foretold.factors[2]), (2, foretold.factors[3])):
        errors = np.convolve(noise, taps[order], "valid")
        assert tracked * (taps[order] @ taps[order]) * factor == pytest.approx(errors.var(), rel=0.25)

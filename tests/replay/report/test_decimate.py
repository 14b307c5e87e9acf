"""Fewer points for the same picture, against loops that look at every row."""

import numpy as np
import pytest

from wmr_replay.report.decimate import extremes, means, path_rows, shares


@pytest.mark.parametrize("holes", [False, True])
def test_the_extremes_of_every_column_stay(holes):
    rng = np.random.default_rng(5)
    t = np.sort(rng.uniform(0, 100, 20_000))
    value = rng.standard_normal(len(t)).cumsum()
    if holes:
        value[rng.random(len(t)) < 0.02] = np.nan
        value[3000:5000] = np.nan
    columns = 150
    rows = extremes(t, value, columns)
    assert len(rows) <= 2 * columns + 4
    column = np.minimum((columns * (t - t[0]) / (t[-1] - t[0])).astype(int), columns - 1)
    for k in range(columns):
        inside = value[column == k]
        if np.isfinite(inside).any():
            kept = value[rows[column[rows] == k]]
            assert np.nanmin(kept) == np.nanmin(inside)
            assert np.nanmax(kept) == np.nanmax(inside)
    if holes:
        assert 3000 in rows
        assert np.isnan(value[rows]).sum() == 1


def test_few_rows_stay_as_they_are():
    t = np.arange(50.0)
    assert extremes(t, np.full(50, np.nan)).tolist() == list(range(50))
    nothing = np.full(5000, np.nan)
    assert len(extremes(np.arange(5000.0), nothing, 100)) <= 3


def test_a_path_keeps_its_shape_and_its_switches():
    angle = np.linspace(0, 40 * np.pi, 200_000)
    x, y = angle * np.cos(angle), angle * np.sin(angle)
    keep = np.zeros(len(x), bool)
    keep[[17, 90_001]] = True
    rows = path_rows(x, y, keep)
    assert len(rows) <= 3002
    assert {0, 17, 90_001, len(x) - 1} <= set(rows.tolist())
    between = np.array([np.interp(np.arange(len(x)), rows, c[rows]) for c in (x, y)])
    assert np.hypot(*(between - [x, y])).max() < np.ptp(x) / 100


def test_noise_does_not_eat_the_points_of_a_path():
    rng = np.random.default_rng(1)
    angle = np.linspace(0, 2 * np.pi, 300_000)
    x, y = 10 * np.cos(angle), 10 * np.sin(angle)
    noisy = [c + 0.05 * rng.standard_normal(len(x)) for c in (x, y)]
    rows = path_rows(*noisy, np.zeros(len(x), bool))
    assert 100 < len(rows) <= 3001
    between = np.array([np.interp(np.arange(len(x)), rows, c[rows]) for c in noisy])
    assert np.hypot(*(between - [x, y])).max() < 0.5


def test_times_need_not_ascend():
    t = np.array([0.0, 2.0, 1.0, 3.0] * 500) + np.repeat(np.arange(500.0), 4)
    value = np.arange(2000.0)[::-1].copy()
    value[777] = 1e6
    assert 777 in extremes(t, value, 20)


def test_shares_count_the_rows_of_each_column():
    t = np.arange(1000.0)
    code = np.repeat([0, 1, 0, 2], 250)
    edges, found = shares(t, code, [0, 1, 2], columns=10)
    assert len(edges) == 11
    np.testing.assert_allclose(found.sum(axis=1), 1)
    np.testing.assert_allclose(found[2], [0.5, 0.5, 0], atol=0.01)


def test_means_leave_out_what_is_unknown():
    t = np.arange(1000.0)
    value = np.stack([np.ones(1000), np.where(t % 2 == 0, 3.0, np.nan)], axis=1)
    at, mean = means(t, value, columns=10)
    assert np.all(np.diff(at) > 0)
    np.testing.assert_allclose(mean, [[1.0, 3.0]] * 10)

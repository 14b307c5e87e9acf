"""The offset between pose and wheel signals: found where it is, not found where there is none."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.api.run import replay
from wmr_replay.identify import Motion
from wmr_replay.pipeline.settings import Settings
from wmr_replay.quality.clock_offset import ClockOffset, HeldSamples
from wmr_replay.quality.even_grid import EvenGrid
from wmr_replay.quality.interface import Observed
from wmr_replay.quality.lagged_fit import LaggedSums
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.robot import RobotParameters
from wmr_synth import Sensors, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=100.0, noise_xy_sd_m=0.002, noise_yaw_sd_rad=0.002)


def wandering(t_s, seed, n=25):
    """A sum of sines up to .5 Hz: aperiodic over a minute, and its derivative."""
    rng = np.random.default_rng(seed)
    frequency, phase = 2 * np.pi * rng.uniform(0.05, 0.5, n), rng.uniform(0, 2 * np.pi, n)
    angle = frequency[:, None] * t_s + phase[:, None]
    return np.sin(angle).mean(axis=0) * 4, (frequency[:, None] * np.cos(angle)).mean(axis=0) * 4


def observed(offset_s=0.0, *, speeds=True, length_s=60.0, rate_hz=40.0, seed=0, noise=0.02):
    """Motion as a formula, and wheel signals that are stamped ``offset_s`` too early."""
    t_s = np.arange(0, length_s, 1 / rate_hz)
    rng = np.random.default_rng(seed)
    (v, a), (rate, turn) = wandering(t_s, seed), wandering(t_s, seed + 1000)
    (v_w, a_w), (rate_w, turn_w) = wandering(t_s + offset_s, seed), wandering(t_s + offset_s, seed + 1000)
    v_w, rate_w = (x + noise * rng.normal(size=len(t_s)) for x in (v_w, rate_w))
    wheels = np.stack([v_w - 0.2 * rate_w, v_w + 0.2 * rate_w]) / 0.1
    effort, twist = 20 * a_w + 5 * v_w + 2 * np.sign(v_w), 3 * turn_w + rate_w
    efforts = np.stack([effort - twist, effort + twist]) / 2
    inputs = np.concatenate([efforts, wheels if speeds else np.full_like(wheels, np.nan)])
    none, sd = np.zeros(len(t_s)), np.full(len(t_s), 0.01)
    motion = Motion(v, none, rate, a, turn, sd, sd, sd, sd, sd)
    pose, variances = np.zeros((3, len(t_s))), np.ones((2, len(t_s)))
    t_ns = np.rint(t_s * 1e9).astype(np.int64)
    known = RobotParameters()
    return Observed(t_ns, t_s, pose, inputs, inputs, motion, variances, known, pose, pose)


def part(rows, index):
    """Rows of a slice."""
    return rows._replace(
        **{
            name: column[..., index]
            for name, column in rows._asdict().items()
            if isinstance(column, np.ndarray)
        },
        motion=Motion(*(column[index] for column in rows.motion)),
    )


def monitored(rows, cuts=()):
    monitor = ClockOffset()
    for begin, end in pairwise([0, *sorted(cuts), len(rows.t_s)]):
        assert not monitor.push(part(rows, slice(begin, end))).any()
    return monitor


@pytest.mark.parametrize("speeds", [True, False])
@pytest.mark.parametrize("offset_s", [-2.0, -0.37, -0.1, 0.0, 0.13, 0.9, 2.0])
def test_the_offset_is_found_with_its_sign(offset_s, speeds):
    found = monitored(observed(offset_s, speeds=speeds)).estimate()
    assert found.offset_s == pytest.approx(offset_s, abs=0.02)
    assert found.sd_s < 0.02
    assert found.signal == ("wheel speeds" if speeds else "torques")


def test_small_offsets_are_notes_that_name_gap_and_larger_ones_warnings():
    assert not monitored(observed(0.0)).findings()
    [small], [large] = monitored(observed(0.2)).findings(), monitored(observed(-1.2)).findings()
    assert (small.severity, large.severity) == ("note", "warning")
    assert "`gap` names so small an offset as a delay" in small.advice
    assert "--clock-offset -1.2" in large.advice


@pytest.mark.parametrize(
    "rows",
    [
        observed(1.0, length_s=20.0),
        observed(1.0, speeds=False)._replace(smoothed=np.full((4, 2400), np.nan)),
        observed(1.0)._replace(smoothed=np.random.default_rng(0).normal(size=(4, 2400))),
        observed(1.0)._replace(smoothed=np.ones((4, 2400))),
    ],
    ids=["too short", "nothing known", "noise", "constant"],
)
def test_without_a_relation_there_is_no_estimate(rows):
    assert monitored(rows).estimate() is None


def slipping(rows, shares, seed=7):
    """The rows with a share of the efforts that reaches the ground, another every 5 s, and the rest of it
    anything: wheels that slip.
    """
    share = np.repeat(shares, 200)[: len(rows.t_s)]
    lost = 10 * np.stack([wandering(rows.t_s, seed + k)[0] for k in range(2)])
    efforts = rows.smoothed[:2] + np.where(share < 1, lost, 0.0)
    smoothed = np.concatenate([share * efforts, rows.smoothed[2:]])
    return rows._replace(smoothed=smoothed, inputs=smoothed)


def test_blocks_that_slip_do_not_blur_the_others():
    shares = np.tile([1.0, 0.04, 1.0, 0.5], 9)
    found = monitored(slipping(observed(0.4, speeds=False, length_s=180.0), shares)).estimate()
    assert found.offset_s == pytest.approx(0.4, abs=0.05)


@pytest.mark.parametrize("seed", range(6))
def test_efforts_of_another_drive_have_no_best_lag(seed):
    rows, other = (observed(speeds=False, length_s=180.0, seed=k) for k in (seed, seed + 50))
    assert not monitored(rows._replace(smoothed=other.smoothed, inputs=other.inputs)).findings()


def test_drag_and_dry_friction_are_no_offset():
    rows = observed(speeds=False, length_s=180.0)
    v, rate = rows.motion.v_long_mps, rows.motion.yaw_rate_radps
    drag = 20 * v + 15 * np.sign(v) + np.array([[-4.0], [4.0]]) * (rate + np.sign(rate))
    smoothed = np.concatenate([rows.smoothed[:2] + drag, rows.smoothed[2:]])
    monitor = monitored(rows._replace(smoothed=smoothed, inputs=smoothed))
    assert not monitor.findings()
    assert monitor.estimate().offset_s == pytest.approx(0.0, abs=0.02)


def test_periodic_motion_has_no_best_lag():
    t_s = np.arange(0, 60, 0.025)
    v = np.sin(2 * np.pi * t_s)
    rows = observed()
    noisy = v + 0.3 * np.random.default_rng(0).normal(size=len(v))
    rows = rows._replace(
        motion=rows.motion._replace(v_long_mps=v, yaw_rate_radps=0 * v), smoothed=np.stack([noisy] * 4)
    )
    found = monitored(rows).findings()
    assert not found


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 2400), max_size=10))
def test_batches_change_no_bit(cuts):
    rows = observed(0.4)
    assert monitored(rows, cuts).estimate() == monitored(rows).estimate()


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 200), max_size=8), st.integers(0, 10**6))
def test_the_grid_is_linear_between_rows_and_holes_stay_unknown(cuts, seed):
    rng = np.random.default_rng(seed)
    t_s = np.cumsum(rng.choice([0.01, 0.03, 0.8], 200, p=[0.5, 0.45, 0.05]))
    grid = EvenGrid(0.05, 1, 0.5)
    points = [
        grid.push(t_s[a:b], lambda at, a=a: 3.0 * t_s[None, a + at])
        for a, b in pairwise([0, *sorted(cuts), 200])
    ]
    points = np.concatenate(points, axis=1)[0]
    expected = 3.0 * 0.05 * np.arange(np.floor(t_s[0] / 0.05) + 1, np.floor(t_s[-1] / 0.05) + 1)
    known = np.isfinite(points)
    assert len(points) == len(expected)
    np.testing.assert_allclose(points[known], expected[known], atol=1e-9)
    holes = np.flatnonzero(np.diff(t_s) > 0.5)
    at_s = expected / 3
    inside = ((at_s > t_s[holes, None] + 1e-9) & (at_s < t_s[holes + 1, None] - 1e-9)).any(axis=0)
    assert not (known & inside).any()


def test_signals_are_asked_for_beside_points_alone():
    t_s, asked = np.arange(10_000) * 1e-3, []
    grid = EvenGrid(0.05, 1, 0.5)

    def squares(at):
        asked.append(len(at))
        return np.square(t_s[None, at])

    points = grid.push(t_s, squares)[0]
    np.testing.assert_allclose(points, np.square(0.05 * np.arange(1, 200)), atol=1e-6)
    assert sum(asked) <= 2 * len(points) + 1


@pytest.mark.parametrize("cut", [0, 1, 2, 50])
def test_holes_of_years_are_filled_with_a_few_points_only(cut):
    t_s = np.concatenate([np.arange(40) * 0.05, 3e9 + np.arange(40) * 0.05, 6e9 + np.arange(40) * 0.05])
    grid = EvenGrid(0.05, 1, 0.5)
    parts = [grid.push(part, lambda at: np.ones((1, len(at)))) for part in (t_s[: 40 + cut], t_s[40 + cut :])]
    points = np.concatenate(parts, axis=1)[0]
    assert len(points) == pytest.approx(120 + 2 * 6 * 20, abs=4)
    assert np.isfinite(points).sum() == pytest.approx(120, abs=6)


def test_a_fit_at_every_lag_is_numpys():
    rng = np.random.default_rng(4)
    x, y = rng.normal(size=(2, 160)), rng.normal(size=160)
    y[7], x[0, 30] = np.nan, np.nan
    fit = LaggedSums(2, 3, 50)
    n, share = fit.fits(sum(sums for _, sums in fit.push(x, y)))
    padded = np.concatenate([np.full((2, 3), np.nan), x, np.full((2, 3), np.nan)], axis=1)
    for k, lag in enumerate(range(-3, 4)):
        shifted = padded[:, 3 + lag : 3 + lag + 150]
        known = np.isfinite(y[:150]) & np.isfinite(shifted).all(axis=0)
        design = np.vstack([np.ones(known.sum()), shifted[:, known]]).T
        residual = np.linalg.lstsq(design, y[:150][known])[1][0]
        assert n[k] == known.sum()
        assert share[k] == pytest.approx(1 - residual / (known.sum() * y[:150][known].var()), abs=1e-9)


def test_held_samples_are_late_by_half_of_what_they_are_held():
    held = HeldSamples()
    t_s = np.arange(0, 20, 0.01)
    held.push(t_s, np.floor(t_s / 0.1 + 1e-9))
    assert held.delay_s == pytest.approx(0.045, abs=1e-3)
    at_rest = HeldSamples()
    at_rest.push(t_s, np.zeros(len(t_s)))
    assert at_rest.delay_s == 0.0


@pytest.fixture(scope="module")
def drive():
    """40 s of random driving whose torques and wheel speeds are stamped .8 s too early."""
    log = synthesise("random", seed=2, duration_s=40, sensors=SENSORS).log
    return log, replace(log, torque=replace(log.torque, t_ns=log.torque.t_ns - 800_000_000))


def test_a_replay_reports_the_offset_and_clock_offset_takes_it_out(drive):
    clean, early = drive
    found = {finding["code"]: finding for finding in replay(early).findings}
    offset_s, sd_s = map(float, re.findall(r"[-+]?[0-9]\.[0-9]+", found["clock_offset"]["text"]))
    assert offset_s == pytest.approx(0.8, abs=0.01)
    assert 0 < sd_s < 0.01
    settled = replay(early, clock_offset_s=0.8)
    assert not settled.findings
    assert settled.settings["clock_offset_s"] == 0.8
    assert settled.samples.collect().equals(replay(clean).samples.collect())


def test_an_offset_does_not_make_poses_late(drive):
    clean, _ = drive
    late = replace(clean, torque=replace(clean.torque, t_ns=clean.torque.t_ns - 5_000_000_000))
    assert replay(late, clock_offset_s=5.0).samples.collect().equals(replay(clean).samples.collect())


@pytest.mark.parametrize("offset_s", [np.nan, np.inf, 1e10])
def test_an_offset_without_sense_is_refused(offset_s):
    with pytest.raises(InvalidSetting, match="clock"):
        Settings(clock_offset_s=offset_s)

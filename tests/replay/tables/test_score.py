"""Scores of hand-made rows: every figure of the summary that compares modes."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.tables import (
    CalibrationCollector,
    RunCollector,
    SegmentCollector,
    confusion_frame,
    samples_frame,
    score_runs,
)
from wmr_schemas.status import Status
from wmr_schemas.tables import CONFUSION, SAMPLES, SEGMENTS, polars_schema

OK, WARMING_UP = 0, 1


def samples(true, mode, *, step_s=0.1, status=None, p=None):
    n = len(mode)
    columns = {
        "t_ns": (np.arange(n) * step_s * 1e9).astype(np.int64),
        "mode_true": np.array(true, np.int8),
        "mode": np.array(mode, np.int8),
        "status": np.array(status if status is not None else [Status.OK] * n, np.int8),
    }
    if p is not None:
        columns["p_ideal"] = np.array(p, float)
    return samples_frame(columns)


def score(frame):
    collector = RunCollector()
    collector.push(frame)
    return score_runs(collector.finish())


def test_undecided_rows_count_as_wrong_and_warm_up_not_at_all():
    result = score(
        samples([0] * 10, [1, 1, -1, -1, 0, 0, 0, 0, 0, 1], status=[Status.WARMING_UP] * 2 + [Status.OK] * 8)
    )
    assert result.accuracy == pytest.approx(5 / 8)
    assert result.decided_share == pytest.approx(6 / 8)
    assert result.accuracy_decided == pytest.approx(5 / 6)
    assert result.recall_ideal == pytest.approx(5 / 8)
    assert result.recall_skidding is None


def test_recall_is_by_true_mode():
    result = score(samples([0, 0, 1, 1, 2, 2, 3, 3], [0, 0, 1, 0, 2, 1, 3, 0]))
    assert (result.recall_ideal, result.recall_skidding, result.recall_slipping) == (1.0, 0.5, 0.5)
    assert result.recall_skidding_slipping == 0.5


def test_a_switch_counts_as_detected_by_the_first_estimate_that_holds():
    true = [0] * 10 + [1] * 10 + [2] * 10
    mode = [0] * 12 + [1] + [0] + [1] * 6 + [1] * 5 + [2] * 5  # a flicker of .1 s at 1.2 s does not hold .2 s
    result = score(samples(true, mode))
    assert result.median_detection_delay_s == pytest.approx((0.4 + 0.5) / 2)
    assert result.p95_detection_delay_s == pytest.approx(0.4 + 0.95 * 0.1)
    assert result.missed_switches == 0


def test_a_switch_that_is_not_seen_before_the_next_is_missed():
    result = score(samples([0] * 10 + [1] * 5 + [0] * 10, [0] * 25))
    assert result.missed_switches == 1
    assert result.median_detection_delay_s == 0.0


def test_false_alarms_are_switches_without_a_true_one_in_the_two_seconds_before():
    true = [0] * 40 + [1] * 60
    mode = (
        [0] * 20 + [2] * 5 + [0] * 20 + [1] * 55
    )  # two false switches at 2.0 and 2.5 s, a right one at 4.5 s
    result = score(samples(true, mode))
    hours = 9.9 / 3600
    assert result.false_alarms_per_hour == pytest.approx(2 / hours)


def test_undecided_stretches_are_no_switches():
    result = score(samples([0] * 60, [0] * 20 + [-1] * 20 + [0] * 20))
    assert result.false_alarms_per_hour == 0.0


def test_without_truth_there_is_no_score():
    result = score(samples([-1] * 10, [0] * 10))
    assert all(value is None for value in vars(result).values())


def test_confusion_adds_up_to_the_time_after_warm_up():
    collector = RunCollector()
    collector.push(
        samples([0, 0, 0, 1, 1, 1], [0, 0, 1, 1, -1, 1], status=[Status.WARMING_UP] + [Status.OK] * 5)
    )
    table = confusion_frame(collector.finish())
    assert table.schema == polars_schema(CONFUSION)
    assert table.rows() == [
        (0, 0, pytest.approx(0.1)),
        (0, 1, pytest.approx(0.1)),
        (1, -1, pytest.approx(0.1)),
        (1, 1, pytest.approx(0.1)),
    ]


def test_segments_are_maximal_and_carry_the_mean_posterior():
    frame = samples([0] * 6, [0, 0, 0, 1, 1, 0], p=[1.0, 0.5, 0.6, 0.1, 0.1, 0.9])
    collector = SegmentCollector()
    for part in (frame[:2], frame[2:5], frame[5:]):
        collector.push(part)
    segments = collector.finish()
    assert segments.schema == polars_schema(SEGMENTS)
    assert segments["mode"].to_list() == [0, 1, 0]
    assert segments["n_samples"].to_list() == [3, 2, 1]
    assert segments["start_ns"].to_list() == [0, 300_000_000, 500_000_000]
    assert segments["end_ns"].to_list() == [300_000_000, 500_000_000, 500_000_000]
    assert segments["mean_p"].to_list() == [pytest.approx(0.7), None, pytest.approx(0.9)]


@pytest.mark.parametrize("cut", [0, 1, 2, 3, 4])
def test_rows_without_a_probability_do_not_count_in_the_mean_however_they_are_cut(cut):
    frame = samples([0] * 5, [0] * 5, p=[1.0, 0.5, 0.5, 0.8, 0.5])
    unknown = pl.Series([False, True, True, False, False])
    frame = frame.with_columns(p_ideal=pl.when(unknown).then(None).otherwise(pl.col("p_ideal")))
    collector = SegmentCollector()
    for part in (frame[:cut], frame[cut:]):
        collector.push(part)
    assert collector.finish()["mean_p"].to_list() == [pytest.approx((1.0 + 0.8 + 0.5) / 3)]
    assert collector.finish()["n_samples"].to_list() == [5]


modes = st.lists(st.tuples(st.integers(-1, 3), st.integers(-1, 2)), min_size=1, max_size=40)


@given(rows=modes, cut=st.integers(0, 40))
def test_batches_change_no_run_and_no_segment(rows, cut):
    frame = samples([r[0] for r in rows], [r[1] for r in rows])
    whole, parts = RunCollector(), RunCollector()
    whole_segments, part_segments = SegmentCollector(), SegmentCollector()
    whole.push(frame)
    whole_segments.push(frame)
    for part in (frame[:cut], frame[cut:]):
        parts.push(part)
        part_segments.push(part)
    assert score_runs(whole.finish()) == score_runs(parts.finish())
    assert whole_segments.finish().equals(part_segments.finish())


def test_unknown_values_become_null_in_the_samples_table():
    frame = samples_frame(
        {
            "t_ns": np.array([1, 2], np.int64),
            "v_long_mps": np.array([np.nan, 1.5]),
            "mode": np.array([-1, 0], np.int8),
            "mode_true": np.array([-1, 2], np.int8),
            "status": np.array([1, 0], np.int8),
        }
    )
    assert frame.schema == polars_schema(SAMPLES)
    assert frame["v_long_mps"].to_list() == [None, 1.5]
    assert frame["mode"].to_list() == [-1, 0]
    assert frame["mode_true"].to_list() == [None, 2]
    assert frame["status"].to_list() == ["warming_up", "ok"]
    assert frame["p_ideal"].dtype == pl.Float64
    assert frame["p_ideal"].null_count() == 2


def test_brier_score_and_calibration_by_hand():
    columns = {
        "t_ns": np.arange(4),
        "mode_true": np.array([0, 0, 1, -1], np.int8),
        "mode": np.zeros(4, np.int8),
        "status": np.zeros(4, np.int8),
        "p_ideal": np.array([0.95, 0.75, 0.75, 0.1]),
        "p_skidding": np.array([0.05, 0.05, 0.15, 0.9]),
        "p_slipping": np.array([0.0, 0.2, 0.1, 0.0]),
    }
    collector = CalibrationCollector()
    frame = samples_frame(columns)
    collector.push(frame[:2])
    collector.push(frame[2:])
    squares = 0.05**2 * 2 + (0.25**2 + 0.05**2 + 0.2**2) + (0.75**2 + 0.85**2 + 0.1**2)
    assert collector.brier == pytest.approx(squares / 3)
    assert collector.ece == pytest.approx((abs(1 - 0.95) * 1 + abs(0.5 - 0.75) * 2) / 3)


def test_without_a_posterior_there_is_no_calibration():
    collector = CalibrationCollector()
    collector.push(samples([0, 0], [0, 0]))
    assert collector.brier is None
    assert collector.ece is None

"""A lasting change of the pose's rate: noticed from the rows before, the design chosen again from there."""

import json
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import wmr_replay as wr
from wmr_replay.pipeline.columns import Columns
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.rate_watch import RateWatch
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import I64, Bool
from wmr_schemas.batches import RawBatch
from wmr_schemas.signals import Log, PoseTrack


def thinned(log: Log, kept: Bool) -> Log:
    p = log.pose
    return replace(log, pose=PoseTrack(p.t_ns[kept], p.x_m[kept], p.y_m[kept], p.yaw_rad[kept]))


def changing(seed: int, first: int, second: int, at_s: float, duration_s: float = 20.0) -> Log:
    """A log at 100/``first`` Hz, from ``at_s`` on at 100/``second`` Hz."""
    log = wr.synthesise("patrol", seed=seed, duration_s=duration_s).log
    k, early = np.arange(len(log.pose)), (log.pose.t_ns - log.pose.t_ns[0]) < at_s * 1e9
    return thinned(log, np.where(early, k % first == 0, k % second == 0))


def replayed(log: Log) -> tuple[dict[str, Any], list[dict[str, Any]], Any]:
    result = wr.replay(log)
    row = result.summary.row(0, named=True)
    return row, json.loads(row["findings"]), result.samples.collect()


@pytest.mark.parametrize(("first", "second"), [(100, 6), (1, 5), (5, 1), (2, 10)])
def test_the_window_follows_the_rate(first: int, second: int) -> None:
    at_s = 24.0 if first == 100 else 8.0
    row, findings, samples = replayed(changing(3, first, second, at_s, at_s + 16))
    (found,) = [f for f in findings if f["code"] == "rate_changed"]
    assert at_s < found["where"][0][0] < at_s + 45 * second / 100
    tuning = json.loads(row["settings"])["tuning"]
    assert tuning["rate_hz"] == pytest.approx(100 / second, rel=0.01)
    assert tuning["window_s"] <= max(0.1, 50 * second / 100)
    late = samples.filter(samples["t_s"] > at_s + 9)
    assert (late["status"] == "gap").mean() < 0.05
    assert late["v_long_mps"].is_finite().all()


@pytest.mark.parametrize("seed", range(4))
def test_lost_messages_are_no_change_of_the_rate(seed: int) -> None:
    log = wr.synthesise("patrol", seed=seed, duration_s=30).log
    kept = np.random.default_rng(seed).random(len(log.pose)) > 0.3
    kept[1000:1100] = False
    assert not [f for f in replayed(thinned(log, kept))[1] if f["code"] == "rate_changed"]


def first_change(t_ns: I64, step_s: float) -> int:
    """The row at which 30 of the last 40 steps are of another rate, one row after another."""
    for i in range(40, len(t_ns)):
        steps = np.diff(t_ns[i - 40 : i + 1]) / 1e9
        if (steps > 1.5 * step_s).sum() >= 30 or (steps < step_s / 1.5).sum() >= 30:
            return i
    return len(t_ns)


@given(st.integers(0, 1000), st.lists(st.integers(1, 300), max_size=5))
def test_the_row_of_the_change_does_not_depend_on_the_batches(seed: int, cuts: list[int]) -> None:
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.choice([0.01, 0.012, 0.02, 0.005], 6), 50) * rng.uniform(0.9, 1.1, 300)
    t_ns = np.rint(np.cumsum(steps) * 1e9).astype(np.int64)
    watch, edges = RateWatch(0.01), [0, *sorted(cuts), 300]
    for a, b in pairwise(edges):
        left = watch.rows_left(t_ns[a:b], np.ones(b - a, bool))
        if left < b - a:
            assert a + left == first_change(t_ns, 0.01)
            return
        watch.push(t_ns[a:b])
    assert first_change(t_ns, 0.01) == 300


def pushed(log: Log, cuts: list[int]) -> Columns:
    """The samples of a log whose raw rows come in batches."""
    engine, whole, parts = Engine(Settings(), ReplayModel(log.robot)), as_batch(log), []
    n = len(whole.pose) + len(whole.torque)
    for a, b in pairwise([0, *sorted(cuts), n]):
        signals = (whole.pose, whole.torque, whole.mode)
        some = [type(s)(*(v[..., (s.order >= a) & (s.order < b)] for v in vars_of(s))) for s in signals]
        parts += engine.push(RawBatch(*some))
    parts += engine.finish()
    names = ("t_ns", "status", "mode")
    return {name: np.concatenate([c[name] for c in parts]) for name in names}


def vars_of(rows: Any) -> tuple[Any, ...]:
    return rows.t_ns, rows.order, rows.values


@settings(max_examples=5, deadline=None)
@given(st.lists(st.integers(1, 2000), max_size=4))
def test_a_replay_across_a_change_does_not_depend_on_the_batches(cuts: list[int]) -> None:
    log = changing(3, 1, 5, 8.0)
    log = replace(log, mode=None)
    whole, parts = pushed(log, []), pushed(log, cuts)
    for name, column in whole.items():
        assert np.array_equal(column, parts[name]), name


@pytest.mark.parametrize(("rate_hz", "barred"), [(1.0, True), (2.0, True), (5.0, False), (10.0, False)])
def test_nothing_is_told_of_poses_too_rare_for_a_skid(rate_hz: float, barred: bool) -> None:
    log = wr.synthesise("patrol", seed=2, duration_s=60, rate_hz=rate_hz).log
    row, findings, samples = replayed(log)
    found = [f for f in findings if f["code"] == "rate_too_low"]
    assert len(found) == barred
    warm = samples.filter(samples["status"] != "warming_up")
    assert ((warm["status"] == "rate_too_low").mean() > 0.9) == barred
    assert (row["share_skidding"] == 0.0) or not barred

"""Alignment: reordering, holds, counts, unwrapping, causality and chunking."""

import itertools
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.align import Aligner, Reorder, SampleBatch, concatenate
from wmr_replay.align.hold import hold_mean
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.status import Status

MS = 1_000_000


def rows(t_ms, values, order=None):
    values = np.atleast_2d(np.asarray(values, float))
    t_ns = (np.asarray(t_ms, float) * MS).astype(np.int64)
    return Rows(t_ns, np.arange(len(t_ns)) if order is None else np.asarray(order, np.int64), values)


def batch(pose=None, torque=None, mode=None):
    return RawBatch(pose or Rows.empty(3), torque or Rows.empty(4), mode or Rows.empty(1))


def align(batches, **options):
    aligner = Aligner(**options)
    parts = [aligner.push(b) for b in batches] + [aligner.finish()]
    columns = {
        name: np.concatenate([getattr(p, name) for p in parts], axis=-1)
        for name in ("t_ns", "pose", "inputs", "mode_true")
    }
    return columns, aligner.counts


def pose_rows(t_ms, order=None):
    t = np.asarray(t_ms, float)
    return rows(t, np.stack([t, 2 * t, np.zeros_like(t)]), order)


def torque_rows(t_ms, effort, order=None):
    return rows(
        t_ms,
        np.stack([effort, np.asarray(effort) + 1, np.full(len(effort), np.nan), np.zeros(len(effort))]),
        order,
    )


def test_a_torque_holds_from_its_stamp_on_and_never_before():
    out, _ = align([batch(pose_rows([0, 10, 20, 30]), torque_rows([5, 10, 27], [1.0, 2.0, 4.0]))])
    left = out["inputs"][0]
    assert np.isnan(left[:2]).all()  # unknown for part of the interval (0, 10]
    assert left[2] == pytest.approx(2.0)
    assert left[3] == pytest.approx((7 * 2.0 + 3 * 4.0) / 10)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_interval_means_are_those_of_a_fine_grid(seed):
    rng = np.random.default_rng(seed)
    pose_ns = np.unique(rng.integers(0, 200, 20)).astype(np.int64)
    t_ns = np.unique(rng.integers(0, 200, 15)).astype(np.int64)
    values = rng.normal(size=(1, len(t_ns)))
    held = np.array([7.0])
    means, _, used = hold_mean(pose_ns, int(pose_ns[0]), t_ns, values, -50, held.copy(), 10**9)
    grid = np.array(
        [values[0, np.searchsorted(t_ns, s, side="right") - 1] if s >= t_ns[0] else 7.0 for s in range(201)]
    )
    for i in range(1, len(pose_ns)):
        assert means[0, i] == pytest.approx(grid[pose_ns[i - 1] : pose_ns[i]].mean(), abs=1e-12)
    assert used == np.count_nonzero(t_ns <= pose_ns[-1])


def test_a_torque_that_stopped_coming_is_unknown_after_the_longest_hold():
    out, _ = align([batch(pose_rows(np.arange(0, 2000, 100)), torque_rows([0], [3.0]))], max_hold_s=1.0)
    left = out["inputs"][0]
    assert (left[:11] == 3.0).all()
    assert np.isnan(left[11:]).all()


def test_late_rows_are_put_in_order_within_the_window_and_counted_beyond_it():
    pose = pose_rows([0, 20, 10, 1000, 5000, 2999, 3000], order=range(7))
    out, counts = align([batch(pose)], reorder_window_s=2.0)
    assert list(out["t_ns"] // MS) == [0, 10, 20, 1000, 3000, 5000]
    assert counts.n_pose_backward == 1
    assert counts.n_pose == 6


def test_duplicates_and_rows_that_are_not_finite_are_counted_and_left_out():
    pose = pose_rows([0, 10, 10, 20, 30])
    pose.values[0, 3] = np.nan
    out, counts = align([batch(pose, torque_rows([0, 0], [1.0, 2.0]))])
    assert list(out["t_ns"] // MS) == [0, 10, 30]
    assert (counts.n_pose_duplicate, counts.n_pose_not_finite, counts.n_torque_duplicate) == (1, 1, 1)
    assert (counts.n_pose, counts.n_torque) == (3, 1)
    assert out["inputs"][0, 0] == 1.0


def test_yaw_is_unwrapped_over_many_turns():
    yaw = np.linspace(0, -40, 500)
    wrapped = np.angle(np.exp(1j * yaw))
    pose = rows(np.arange(500), np.stack([yaw, yaw, wrapped]))
    out, _ = align([batch(pose)])
    np.testing.assert_allclose(out["pose"][2], yaw, atol=1e-12)


def test_truth_holds_from_its_stamp_on():
    mode = rows([5, 25], [[1.0, 2.0]])
    out, _ = align([batch(pose_rows([0, 10, 20, 25, 30]), None, mode)])
    assert list(out["mode_true"]) == [-1, 1, 1, 2, 2]


def random_log(seed):
    """Signals interleaved with delays; some rows come too late, some twice."""
    rng = np.random.default_rng(seed)
    n = 120
    kind = rng.choice(3, n, p=[0.6, 0.3, 0.1])
    t_ms = np.round(np.arange(n) * 5 - rng.exponential(12, n))
    order = np.arange(n)
    values = rng.normal(size=(4, n))
    values[:, rng.random(n) < 0.03] = np.nan
    sizes = (3, 4, 1)

    def cut(a, b):
        index = [np.flatnonzero((kind == k) & (order >= a) & (order < b)) for k in range(3)]
        return RawBatch(
            *(
                Rows((t_ms[i] * MS).astype(np.int64), order[i], np.abs(values[:k, i]) % 4)
                for i, k in zip(index, sizes, strict=True)
            )
        )

    return n, cut, t_ms


@given(seed=st.integers(0, 2**32 - 1), cuts=st.lists(st.integers(0, 120), max_size=10))
@settings(max_examples=60, deadline=None)
def test_chunks_change_no_bit(seed, cuts):
    n, cut, _ = random_log(seed)
    edges = [0, *sorted(cuts), n]
    whole, counts = align([cut(0, n)], reorder_window_s=0.03)
    parts, part_counts = align([cut(a, b) for a, b in itertools.pairwise(edges)], reorder_window_s=0.03)
    assert counts == part_counts
    for name, column in whole.items():
        assert np.array_equal(column, parts[name], equal_nan=True), name


@given(seed=st.integers(0, 2**32 - 1), stop=st.integers(0, 500))
@settings(max_examples=60, deadline=None)
def test_a_row_depends_on_nothing_stamped_after_it(seed, stop):
    n, cut, _t_ms = random_log(seed)
    everything = cut(0, n)

    def until(r):
        early = r.t_ns <= stop * MS
        return Rows(r.t_ns[early], r.order[early], r.values[:, early])

    whole, _ = align([everything], reorder_window_s=1.0)
    prefix, _ = align(
        [RawBatch(until(everything.pose), until(everything.torque), until(everything.mode))],
        reorder_window_s=1.0,
    )
    k = len(prefix["t_ns"])
    assert k == np.count_nonzero(whole["t_ns"] <= stop * MS)
    for name, column in whole.items():
        assert np.array_equal(column[..., :k], prefix[name], equal_nan=True), name


def test_reorder_gives_rows_back_once_they_can_have_no_predecessor():
    reorder = Reorder(10 * MS)
    first = reorder.push(batch(pose_rows([0, 5, 12], order=[0, 1, 2])))
    assert list(first.pose.t_ns // MS) == [0]
    assert list(reorder.finish().pose.t_ns // MS) == [5, 12]


def test_a_batch_without_outliers_and_its_parts_keep_rows_together():
    t_ns = np.arange(6, dtype=np.int64)
    pose, inputs = np.arange(18.0).reshape(3, 6), np.arange(24.0).reshape(4, 6)
    raw = SampleBatch.measured(t_ns, pose, inputs, np.zeros(6, np.int8))
    assert raw.kept.all()
    assert not raw.restarts.any()
    assert raw.without_outliers() is raw
    status = np.array([Status.OK, Status.OUTLIER, Status.POSE_JUMP, Status.OK, Status.OUTLIER, Status.OK])
    repaired = replace(raw, pose=pose + 100, repair=status.astype(np.int8))
    good = repaired.without_outliers()
    assert good.t_ns.tolist() == [0, 2, 3, 5]
    assert good.restarts.tolist() == [False, True, False, False]
    assert np.array_equal(good.pose, good.pose_raw + 100)
    assert np.array_equal(good.inputs, inputs[:, [0, 2, 3, 5]])
    again = concatenate([repaired.part(slice(2)), repaired.part(slice(2, None))])
    for name in ("t_ns", "pose_raw", "pose", "inputs", "mode_true", "repair"):
        assert np.array_equal(getattr(again, name), getattr(repaired, name)), name


def test_alignment_is_light():
    """It needs signals and batches: no message, no table, no file, no other room of the replay."""
    listed = "import sys, wmr_replay.align; print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", listed], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    heavy = {"google.protobuf", "mcap", "rosbags", "polars", "pyarrow", "rerun", "click", "msgspec"}
    assert not heavy & loaded
    rooms = {name.split(".")[1] for name in loaded if name.startswith("wmr_replay.")}
    assert rooms == {"align"}
    assert not {name for name in loaded if name.startswith(("wmr_schemas.messages", "wmr_schemas.tables"))}

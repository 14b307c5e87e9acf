"""Repeated poses: which are frozen, and which a live tracker sends of a robot that rests or creeps."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.align import FrozenPose, SampleBatch
from wmr_replay.align.carried import CarriedInputs
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.status import Status

UNKNOWN = np.nan
RADIUS_M = 0.1


def stamps(n: int, rate_hz: float) -> I64:
    return np.asarray(np.rint(np.arange(n) * 1e9 / rate_hz), np.int64)


def curve(t_ns: I64, speed_mps: F64, turning_radps: float = 0.4) -> F64:
    """Pose (3, n) along a circle at a speed (n,), by the trapezoidal rule."""
    dt = np.diff(t_ns, prepend=t_ns[0]) / 1e9
    yaw = np.cumsum(np.where(speed_mps > 0, turning_radps, 0.0) * dt)
    return np.stack([np.cumsum(speed_mps * np.cos(yaw) * dt), np.cumsum(speed_mps * np.sin(yaw) * dt), yaw])


def noisy(pose: F64, sd: float, seed: int) -> F64:
    return pose + sd * np.random.default_rng(seed).normal(size=pose.shape)


def wheels(speed_mps: F64) -> F64:
    return np.stack([speed_mps, speed_mps]) / RADIUS_M


def unknown(n: int) -> F64:
    return np.full((2, n), UNKNOWN)


def freeze(pose: F64, rows: slice | Bool) -> F64:
    """The pose with the rows in question repeating the last one before them."""
    frozen = np.zeros(pose.shape[1], bool)
    frozen[rows] = True
    return pose[:, np.maximum.accumulate(np.where(frozen, 0, np.arange(pose.shape[1])))]


def braking(t_ns: I64, speed_mps: float, at_s: float, mps2: float) -> F64:
    return np.clip(speed_mps - mps2 * (t_ns / 1e9 - at_s), 0.0, speed_mps)


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 1000.0])
@pytest.mark.parametrize("sd", [0.0, 0.002])
@pytest.mark.parametrize("known", [True, False])
def test_every_repeat_of_a_moving_robots_pose_is_frozen_from_the_first_on(
    rate_hz: float, sd: float, known: bool
) -> None:
    n = int(6 * rate_hz)
    t_ns, speed = stamps(n, rate_hz), np.full(n, 1.0)
    speed[: n // 6] = np.linspace(0.0, 1.0, n // 6)
    at = slice(n // 2, n // 2 + n // 6)
    pose = freeze(noisy(curve(t_ns, speed), sd, 1), at)
    frozen = FrozenPose().frozen(t_ns, pose, wheels(speed) if known else unknown(n))
    assert frozen[at].all()
    assert frozen.sum() == at.stop - at.start


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 1000.0])
@pytest.mark.parametrize("grid", [0.0, 0.001, 2.0**-20])
@pytest.mark.parametrize("known", [True, False])
def test_a_robot_that_brakes_and_rests_is_not_frozen(rate_hz: float, grid: float, known: bool) -> None:
    n = int(5 * rate_hz)
    t_ns = stamps(n, rate_hz)
    speed = braking(t_ns, 0.8, 2.0, 4.0)
    pose = curve(t_ns, speed, turning_radps=0.0)
    pose = np.round(pose / grid) * grid if grid else pose
    assert not FrozenPose().frozen(t_ns, pose, wheels(speed) if known else unknown(n)).any()


def test_a_simulated_robot_that_stops_at_once_is_at_rest_when_its_wheels_are() -> None:
    t_ns = stamps(500, 100.0)
    speed = np.where(t_ns < 2e9, 0.5, 0.0)
    pose = curve(t_ns, speed)
    assert not FrozenPose().frozen(t_ns, pose, wheels(speed)).any()
    assert FrozenPose().frozen(t_ns, pose, wheels(np.full(500, 0.5)))[202:].all()


@pytest.mark.parametrize("speed_mps", [0.003, 0.01, 0.04, 0.09, 0.11, 0.3])
def test_a_creeping_robot_repeats_rounded_poses_and_is_not_frozen(speed_mps: float) -> None:
    t_ns = stamps(3000, 100.0)
    pose = np.round(curve(t_ns, np.full(3000, speed_mps), 0.05), 3)
    repeats = (np.diff(pose) == 0).all(axis=0).sum()
    assert repeats > 500 or speed_mps > 0.05
    for known in (wheels(np.full(3000, speed_mps)), unknown(3000)):
        assert not FrozenPose().frozen(t_ns, pose, known).any()


def test_wheels_that_spin_on_the_spot_leave_a_rounded_pose_where_it_is() -> None:
    t_ns = stamps(1000, 100.0)
    speed = braking(t_ns, 0.4, 2.0, 2.0)
    pose = np.round(curve(t_ns, speed, 0.0), 3)
    assert not FrozenPose().frozen(t_ns, pose, wheels(np.full(1000, 0.4))).any()


def test_a_pose_that_freezes_at_rest_is_found_when_the_wheels_drive_off() -> None:
    n = 1000
    t_ns = stamps(n, 100.0)
    speed = np.where(t_ns < 5e9, 0.0, 0.5)
    pose = freeze(noisy(curve(t_ns, speed), 0.001, 2), slice(450, 700))
    frozen = FrozenPose().frozen(t_ns, pose, wheels(speed))
    assert frozen[503:700].all()


@pytest.mark.parametrize("times", [2, 3, 10])
@pytest.mark.parametrize("speed_mps", [0.1, 1.0])
def test_a_tracker_that_sends_every_pose_several_times_is_seen_at_its_own_rate(
    times: int, speed_mps: float
) -> None:
    n = 2000
    t_ns = stamps(n, 100.0)
    repeats = np.arange(n) % times > 0
    pose = freeze(noisy(curve(t_ns, np.full(n, speed_mps)), 0.001, 3), repeats)
    frozen = FrozenPose().frozen(t_ns, pose, unknown(n))
    assert not frozen[~repeats].any()
    settled = np.arange(n) > 30 * times
    assert frozen[repeats & settled].mean() > 0.95


@pytest.mark.parametrize(("part", "count"), [(slice(0, 2), "n_position"), (slice(2, 3), "n_yaw")])
def test_position_or_yaw_alone_may_be_frozen(part: slice, count: str) -> None:
    n, at = 2000, slice(900, 1100)
    t_ns = stamps(n, 100.0)
    pose = noisy(curve(t_ns, np.full(n, 1.0)), 0.003, 4)
    pose[part] = freeze(pose, at)[part]
    stage = FrozenPose()
    frozen = stage.frozen(t_ns, pose, unknown(n))
    assert frozen[at].all()
    assert frozen.sum() == getattr(stage, count) == 200


def test_a_yaw_that_was_never_filled_in_is_not_frozen() -> None:
    t_ns = stamps(1000, 100.0)
    pose = noisy(curve(t_ns, np.full(1000, 1.0)), 0.003, 5)
    pose[2] = 0.0
    assert not FrozenPose().frozen(t_ns, pose, unknown(1000)).any()


def drawn(seed: int) -> tuple[I64, F64, F64]:
    """Stamps, pose and wheel speeds with stops, bursts, losses and rounding."""
    rng = np.random.default_rng(seed)
    n = 300
    t_ns = np.cumsum(rng.integers(8_000_000, 12_000_000, n))
    speed = np.repeat(rng.choice([0.0, 0.05, 0.5, 1.5], 10), 30)
    pose = noisy(curve(t_ns, speed), rng.choice([0.0, 0.002]), seed)
    pose = np.round(pose, 3) if rng.random() < 0.3 else pose
    known = wheels(speed)
    known[:, rng.random(n) < 0.1] = UNKNOWN
    return t_ns, freeze(pose, np.repeat(rng.random(60) < 0.4, 5)), known


@given(st.integers(0, 10_000), st.lists(st.integers(0, 300), max_size=6))
def test_batches_and_later_rows_change_nothing(seed: int, cuts: list[int]) -> None:
    t_ns, pose, known = drawn(seed)
    whole = FrozenPose().frozen(t_ns, pose, known)
    stage = FrozenPose()
    edges = [0, *sorted(cuts), len(t_ns)]
    parts = [stage.frozen(t_ns[a:b], pose[:, a:b], known[:, a:b]) for a, b in pairwise(edges)]
    assert np.array_equal(np.concatenate(parts), whole)
    k = edges[1] if cuts else 150
    assert np.array_equal(FrozenPose().frozen(t_ns[:k], pose[:, :k], known[:, :k]), whole[:k])


def rows_of(t_ns: I64, frozen: Bool, inputs: F64) -> SampleBatch:
    n = len(t_ns)
    rows = SampleBatch.measured(t_ns, np.zeros((3, n)), inputs, np.zeros(n, np.int8))
    return replace(rows, repair=np.where(frozen, Status.GAP, Status.OK).astype(np.int8))


@pytest.mark.parametrize("known", [True, False])
def test_batches_without_a_repeat_are_remembered_as_row_by_row(known: bool) -> None:
    t_ns = stamps(3000, 100.0)
    speed = np.full(len(t_ns), 0.5)
    pose = freeze(noisy(curve(t_ns, speed), 0.003, 5), slice(2200, 2320))
    pose = freeze(pose, slice(2900, 2903))
    turned = wheels(speed) if known else unknown(len(t_ns))
    found = []
    for length in (1, 90, 700):
        stage, parts = FrozenPose(), range(0, len(t_ns), length)
        rows = [slice(k, k + length) for k in parts]
        frozen = [stage.frozen(t_ns[r], pose[:, r], turned[:, r]) for r in rows]
        found.append((np.concatenate(frozen), stage.n, stage.n_position, stage.n_yaw))
    assert found[0][0][2200:2320].all()
    for one in found[1:]:
        assert np.array_equal(one[0], found[0][0])
        assert one[1:] == found[0][1:]


@given(st.integers(0, 10_000), st.lists(st.integers(0, 60), max_size=5))
def test_inputs_of_frozen_rows_go_to_the_next_measured_one(seed: int, cuts: list[int]) -> None:
    rng = np.random.default_rng(seed)
    t_ns = np.cumsum(rng.integers(1_000_000, 9_000_000, 60))
    frozen, inputs = rng.random(60) < 0.5, rng.normal(size=(4, 60))
    frozen[0] = False
    stage, parts = CarriedInputs(), []
    for a, b in pairwise([0, *sorted(cuts), 60]):
        parts.append(stage.push(rows_of(t_ns[a:b], frozen[a:b], inputs[:, a:b])))
    found = np.concatenate(parts, axis=1)
    assert np.array_equal(found, CarriedInputs().push(rows_of(t_ns, frozen, inputs)))
    step_s = np.diff(t_ns, prepend=t_ns[0]) / 1e9
    kept = np.flatnonzero(~frozen)
    for before, row in pairwise(kept):
        part = slice(before + 1, row + 1)
        assert found[:, row] == pytest.approx(np.average(inputs[:, part], axis=1, weights=step_s[part]))

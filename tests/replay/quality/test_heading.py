"""A pose without the robot's heading bars every claim about sideslip; drifts and reversing robots do not."""

import dataclasses
import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import wmr_replay as wr
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth import write_mcap

RATE_HZ = 50.0


def log_of(v, w, rate, *, yaw=None, sd=(0.002, 0.003), seed=0):
    """A log of body velocities (n,), integrated; ``yaw`` replaces the measured one."""
    rng, step_s = np.random.default_rng(seed), 1 / RATE_HZ
    heading = 0.4 + np.cumsum(rate) * step_s
    x = np.cumsum(v * np.cos(heading) - w * np.sin(heading)) * step_s
    y = np.cumsum(v * np.sin(heading) + w * np.cos(heading)) * step_s
    n = len(x)
    noise = rng.standard_normal((3, n)) * np.array([sd[0], sd[0], sd[1]])[:, None]
    measured = heading + noise[2] if yaw is None else yaw(heading, noise[2])
    t_ns = (np.arange(n) * round(step_s * 1e9)).astype(np.int64)
    return Log(PoseTrack(t_ns, x + noise[0], y + noise[1], measured), None, None)


def winding(seconds=40.0, **wishes):
    """A robot at .8 m/s that winds left and right, and reverses now and then."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    v = 0.8 * np.where(np.sin(0.25 * t) > -0.6, 1.0, -1.0)
    return log_of(v, 0 * t, 0.7 * np.sin(0.5 * t), **wishes)


def codes(result):
    return {f["code"] for f in result.findings if f["severity"] == "bars"}


def statuses(result):
    return result.samples.collect()["status"].to_list()


BARRED = {
    "identity": (lambda yaw, noise: 0 * yaw, "no_heading"),
    "one direction with noise": (lambda yaw, noise: 1.0 + noise, "no_heading"),
    "another robot's": (
        lambda yaw, noise: 2.5 * np.sin(np.arange(len(yaw)) / 70) + noise,
        "heading_not_along_path",
    ),
    "mirrored": (lambda yaw, noise: noise - yaw, "yaw_unit"),
    "turned by 90": (lambda yaw, noise: yaw + np.pi / 2 + noise, "heading_not_along_path"),
    "turned by -40": (lambda yaw, noise: yaw - 0.7 + noise, "heading_not_along_path"),
}


@pytest.mark.parametrize("name", BARRED)
def test_a_heading_that_is_not_the_robots_bars_the_rows(name):
    yaw, code = BARRED[name]
    result = wr.replay(winding(yaw=yaw))
    assert codes(result) == {code}
    said = statuses(result)
    assert said[-1] == "no_heading"
    assert said.count("no_heading") > 0.5 * len(said)


@pytest.mark.parametrize(("offset_deg", "said"), [(90, "-90"), (-35, "+35"), (20, "-20")])
def test_a_constant_angle_is_said(offset_deg, said):
    result = wr.replay(winding(yaw=lambda yaw, noise: yaw + np.radians(offset_deg) + noise))
    text = next(f["text"] for f in result.findings if f["code"] == "heading_not_along_path")
    angles = [int(angle) for angle in re.findall(r"([+-]\d+)°", text)]
    assert min(abs(angle - int(said)) for angle in angles) <= 2


def test_an_identity_orientation_gets_hardly_a_claim():
    result = wr.replay(winding(yaw=lambda yaw, noise: 0 * yaw))
    row = result.summary.row(0, named=True)
    assert (row["share_skidding"] or 0.0) < 0.03
    assert "no usable heading" in result.verdict


def test_a_heading_that_freezes_bars_from_then_until_it_moves_again():
    def yaw(true, noise):
        measured = true + noise
        measured[1100:1500] = measured[1100]
        return measured

    said = np.array(statuses(wr.replay(winding(yaw=yaw))))
    assert not (said[:1100] == "no_heading").any()
    assert np.isin(said[1210:1500], ["no_heading", "pose_jump", "outlier"]).all()
    assert (said[1210:1500] == "no_heading").any()
    assert not (said[1510:] == "no_heading").any()


def test_reversing_winding_and_small_offsets_are_not_barred():
    for log in (winding(), winding(yaw=lambda yaw, noise: yaw + 0.08 + noise)):
        assert codes(wr.replay(log)) == set()


@pytest.mark.parametrize("depth_deg", [15, 40, 65])
@pytest.mark.parametrize("seed", [1, 2])
def test_drifts_of_seconds_are_not_barred(depth_deg, seed):
    """A car drifts left, then right, for 3 s each: course and yaw turn together."""
    t = np.arange(int(60 * RATE_HZ)) / RATE_HZ
    side = np.tanh(3 * np.sin(2 * np.pi * t / 6.0 + seed))
    slip = -np.radians(depth_deg) * side
    v, w = 2.5 * np.cos(slip), 2.5 * np.sin(slip)
    log = log_of(v, w, 1.2 * side - np.gradient(slip, t), seed=seed)
    assert codes(wr.replay(log)) == set()


def test_wheels_that_turn_against_the_heading_are_said():
    log = winding(yaw=lambda yaw, noise: yaw + np.pi + noise)
    speed = np.where(np.sin(0.25 * np.arange(len(log.pose)) / RATE_HZ) > -0.6, 8.0, -8.0)
    none = np.zeros(len(speed))
    log = dataclasses.replace(log, torque=wr.TorqueTrack(log.pose.t_ns, none, none, speed, speed))
    (found,) = wr.replay(log).findings
    assert (found["code"], found["severity"]) == ("heading_not_along_path", "warning")
    assert "180°, or the wheels count backwards" in found["text"]


def legs(seed, kinds):
    """Drives of 3 s from rest to rest, one kind of body velocity after the other."""
    rng = np.random.default_rng(seed)
    body = []
    for _ in range(16):
        kind = kinds[rng.integers(len(kinds))]
        shape = np.sin(np.linspace(0, np.pi, int(3 * RATE_HZ))) ** 0.5 * rng.choice([-1, 1])
        body += [np.outer(kind, shape), np.zeros((3, int(0.6 * RATE_HZ)))]
    return np.concatenate(body, axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_a_base_that_starts_sideways_from_rest_is_no_skid(seed):
    v, w, rate = legs(seed, [(0.5, 0, 0), (0, 0.5, 0), (0.4, 0, 0.3)])
    result = wr.replay(log_of(v, w, rate, seed=seed))
    assert "drives_sideways" in codes(result)
    assert statuses(result)[-1] == "other_drive"


@pytest.mark.parametrize("seed", range(3))
def test_turning_on_the_spot_about_a_point_beside_the_marker_is_not_sideways(seed):
    v, w, rate = legs(seed, [(0.5, 0, 0), (0.5, 0, 0.4), (0, 0, 0.8)])
    assert codes(wr.replay(log_of(v, w + 0.25 * rate, rate, seed=seed))) == set()


@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_batches_and_prefixes_change_nothing(data):
    from wmr_replay.pipeline import engine as engines
    from wmr_replay.pipeline.memory import as_batch
    from wmr_replay.pipeline.model_effects import ReplayModel
    from wmr_replay.pipeline.settings import Settings
    from wmr_schemas.batches import RawBatch, Rows

    name = data.draw(st.sampled_from(sorted(BARRED)))
    whole = as_batch(winding(20.0, yaw=BARRED[name][0]))
    n = len(whole.pose)
    cuts = sorted(data.draw(st.lists(st.integers(0, n), max_size=5)))
    last = data.draw(st.sampled_from([n, n - 137]))

    def run(edges):
        engine = engines.Engine(Settings(), ReplayModel(wr.RobotParameters()))
        done = []
        for a, b in pairwise(edges):
            rows = Rows(whole.pose.t_ns[a:b], whole.pose.order[a:b], whole.pose.values[:, a:b])
            done += engine.push(RawBatch(rows, Rows.empty(4), Rows.empty(1)))
        done += engine.finish()
        return np.concatenate([c["status"] for c in done]), engine.findings

    at_once, found = run([0, n])
    in_parts, found_in_parts = run([0, *[c for c in cuts if c <= last], last])
    assert in_parts.tolist() == at_once[: len(in_parts)].tolist()
    if last == n:
        assert found == found_in_parts


def test_run_says_so_on_the_terminal(tmp_path, capsys):
    from wmr_replay.cli.printing.run import print_result

    write_mcap(winding(yaw=lambda yaw, noise: 0 * yaw), tmp_path / "identity.mcap")
    print_result(wr.run(tmp_path / "identity.mcap", out=tmp_path / "out"), as_json=False)
    said = capsys.readouterr().out
    assert "bars      no_heading: the yaw stays at exactly 0° while the robot moves across it" in said
    assert "no usable heading" in said

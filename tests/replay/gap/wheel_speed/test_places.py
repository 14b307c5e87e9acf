"""Losses of traction in a time or a place: what is found, and what only looks like one."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.made_up_wheels import ROBOT, drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.evidence import matters
from wmr_replay.gap.wheel_speed.held_out import averaged, pose_noise
from wmr_replay.gap.wheel_speed.modes import ideal_only
from wmr_replay.gap.wheel_speed.places import Rates, discs, inside_of, intervals, slopes
from wmr_replay.gap.wheel_speed.select import base_fit, fitted_with, is_needless
from wmr_replay.gap.wheel_speed.windows import gaps_of, windows_of

RTK, NOISY = (0.01, 0.005), (0.05, 0.02)
OPTIONS = GapOptions()
INTERVAL = {"start_s": 22.0, "end_s": 29.0, "loss": 0.4}
PLACE = {"x_m": 1.0, "y_m": 2.0, "radius_m": 0.8}


def problem(log):
    """The log's problem without slip."""
    return ideal_only(problem_of([log], base_of(ROBOT, None), OPTIONS, "wheel_speed"), {})


def test_the_first_guess_of_an_interval_is_close_in_the_worst_noise():
    one = problem(drive({"slip_interval": INTERVAL}, noise=NOISY, seed=3))
    found = intervals(one, Rates(one, {}).gains())[0]

    assert found["start_s"] == pytest.approx(22.0, abs=0.6)
    assert found["end_s"] == pytest.approx(29.0, abs=0.6)
    assert found["loss"] == pytest.approx(0.4, abs=0.06)


def test_the_first_guess_of_a_disc_lies_where_traction_is_lost():
    one = problem(drive({"slip_interval": INTERVAL}, noise=RTK, seed=3))
    found = discs(one, Rates(one, {}).gains())[0]
    record = one.record
    lost = (record.pose_s > INTERVAL["start_s"]) & (record.pose_s < INTERVAL["end_s"])
    away_m = np.hypot(record.pose[0, lost] - found["x_m"], record.pose[1, lost] - found["y_m"])

    assert away_m.min() < 0.3
    assert found["loss"] == pytest.approx(0.4, abs=0.06)


@pytest.mark.parametrize("noise", [RTK, NOISY])
def test_a_constant_loss_is_steady(noise):
    own = OPTIONS.gates.wheel_speed.gates
    one = problem(drive({"slip_interval": INTERVAL}, noise=noise, seed=3))
    rates, inside = Rates(one, {}), inside_of(one.with_slip, INTERVAL, "slip_interval")

    assert rates.steady(inside, 0.4, own)
    assert not rates.steady(inside, 0.9, own)
    assert not rates.steady(inside_of(one, {"start_s": 40.0, "end_s": 47.0}, "slip_interval"), 0.4, own)


def test_a_growing_loss_is_not_steady():
    own = OPTIONS.gates.wheel_speed.gates
    one = problem(drive({}, noise=RTK, seed=3))
    rates, inside = Rates(one, {}), inside_of(one.with_slip, INTERVAL, "slip_interval")
    rates.measured[:, inside] = np.linspace(1.0, 0.1, int(inside.sum())) * rates.predicted[:, inside]

    assert not rates.steady(inside, 0.45, own)


@pytest.mark.parametrize(("loss", "needless"), [(0.08, True), (0.4, False)])
def test_a_loss_that_others_leave_little_of_is_needless(loss, needless):
    """Beside what was found after it, however surely it is not 0: uneven ground takes as much."""
    settings = SimpleNamespace(settings=OPTIONS.gates.wheel_speed)
    current = SimpleNamespace(values={"low_grip_patch": {**PLACE, "loss": loss}})
    assert is_needless(settings, current, "low_grip_patch", 1e4, 0.0) is needless


def test_slopes_reach_across_blocks():
    one = problem(drive({}, seed=3, seconds=20.0)).with_slip
    slope = slopes(one.bins, np.stack([2.0 * one.bins.t_s, -one.bins.t_s, 0.0 * one.bins.t_s]))

    assert np.isfinite(slope[:, 1:-1]).all()
    assert slope[:2, 1:-1] == pytest.approx(np.array([[2.0], [-1.0]]) * np.ones(slope.shape[1] - 2))


def test_a_lever_arm_takes_the_place_of_an_offset_of_its_class():
    one = problem(drive({"pose_lever_arm": {"x_m": -0.1, "y_m": 0.08}}, noise=RTK, seed=4))
    offset = fitted_with(one, base_fit(one), "icr_offset", {"offset_m": 0.1})
    lever = fitted_with(one, offset, "pose_lever_arm", {"x_m": 0.0, "y_m": 0.05})

    assert set(lever.values) == {"pose_lever_arm"}
    assert lever.values["pose_lever_arm"]["x_m"] == pytest.approx(-0.1, abs=0.02)
    assert lever.minus_two_log < offset.minus_two_log


def test_what_is_too_small_of_an_offset_is_too_small_of_a_lever_arm():
    one = problem(drive({}, noise=RTK, seed=4))
    same = ("pose_lever_arm", "icr_offset")
    for x_m, expected in ((0.004, False), (0.05, True)):
        fit = fitted_with(one, base_fit(one), "pose_lever_arm", {"x_m": x_m}, noise_too=False)
        fit = type(fit)(**{**fit.__dict__, "values": {"pose_lever_arm": {"x_m": x_m, "y_m": 0.0}}})
        assert matters(fit, "pose_lever_arm", same, 0.2) is expected


def test_averaged_poses_show_the_gap_beside_the_noise():
    one = problem(drive({}, noise=NOISY, seed=5))
    sd, windows = pose_noise(one), windows_of(one, 4.0)
    single = gaps_of(one, windows, {}, sd)
    mean = averaged(one, windows, single, sd)
    size = np.median(one.bins.count)

    assert np.median(single.errors.position_m) == pytest.approx(np.sqrt(2) * NOISY[0], rel=0.1)
    assert np.median(mean.position_m) == pytest.approx(np.sqrt(2 / size) * NOISY[0], rel=0.3)
    assert np.median(mean.floor_m) == pytest.approx(np.sqrt(2 / size) * NOISY[0], rel=0.2)

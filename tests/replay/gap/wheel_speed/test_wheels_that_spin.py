"""Wheels that spin are a finding of a calibrated robot that rolled on its calibration log."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.made_up_wheels import LEAD_S, ROBOT, drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed import seen_slipping
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds, problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.calibrate import calibrate_wheel_speeds
from wmr_replay.gap.wheel_speed.modes import ideal_only
from wmr_replay.gap.wheel_speed.places import Rates
from wmr_replay.gap.wheel_speed.seen_slipping import (
    Slip,
    apart_from,
    as_effect,
    is_found,
    seen_slips,
    stays_behind,
)
from wmr_replay.gap.wheel_speed.select import select
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.effects.declaration import Domain

NOISE = (0.002, 0.003)
SPINS_S = (25.0, 27.0)
STARTED_NS = round(LEAD_S * NS_PER_S)


def spinning(log, times=8.0, span_s=SPINS_S, sides=("left", "right")):
    """The log with wheels that turn up to so many times as fast in a span: the loss grows and fades."""
    since_s = (log.wheels.t_ns - STARTED_NS) / NS_PER_S - span_s[0]
    share = np.clip(since_s / (span_s[1] - span_s[0]), 0.0, 1.0)
    faster = 1 + (times - 1) * np.sin(np.pi * share) ** 2
    spun = {f"{side}_radps": faster * getattr(log.wheels, f"{side}_radps") for side in sides}
    return replace(log, wheels=replace(log.wheels, **spun))


def held_by_its_tracker(log, span_s=SPINS_S):
    """The log with poses that stand, with their noise, in a span; then they catch up."""
    at_s, pose = (log.pose.t_ns - STARTED_NS) / NS_PER_S, log.pose
    inside = (at_s > span_s[0]) & (at_s < span_s[1])
    first = int(np.flatnonzero(inside)[0])
    rng = np.random.default_rng(0)
    stands = {
        key: np.where(inside, getattr(pose, key)[first] + sd * rng.normal(size=len(at_s)), getattr(pose, key))
        for key, sd in (("x_m", NOISE[0]), ("y_m", NOISE[0]), ("yaw_rad", NOISE[1]))
    }
    return replace(log, pose=replace(pose, **stands))


@pytest.fixture(scope="module")
def rolled():
    """Calibrated on a log on which the robot rolls."""
    return calibrate_wheel_speeds([drive({}, noise=NOISE, seed=4)], ROBOT).model


@pytest.fixture(scope="module")
def log():
    return drive({}, noise=NOISE, seed=3)


def test_wheels_that_spin_are_a_slip_in_their_time(rolled, log):
    found = analyse_wheel_speeds([spinning(log)], rolled)
    (slip,) = found.effects
    assert (found.verdict, slip.name) == ("named", "slip_interval")
    start, end, loss = (slip.parameters[key] for key in ("start_s", "end_s", "loss"))
    assert start.value == pytest.approx(SPINS_S[0], abs=0.5)
    assert end.value == pytest.approx(SPINS_S[1], abs=0.5)
    assert 0.6 < loss.value < 1 - 1 / 8
    assert 0 <= loss.ci95[0] < loss.value < loss.ci95[1] <= 1
    assert start.ci95[1] - start.ci95[0] < 1.5
    assert slip.p_value < 1e-6


@pytest.mark.parametrize(("side", "sign"), [("left", -1.0), ("right", 1.0)])
def test_one_wheel_that_spins_is_a_slip_of_its_own(rolled, log, side, sign):
    found = analyse_wheel_speeds([spinning(log, times=3.0, sides=(side,))], rolled)
    (slip,) = found.effects
    assert (found.verdict, slip.name) == ("named", "slip_interval")
    assert slip.parameters["start_s"].value == pytest.approx(SPINS_S[0], abs=0.5)
    loss, apart = slip.parameters["loss"].value, slip.parameters["loss_apart"].value
    assert 0.3 < 2 * loss < 1 - 1 / 3
    assert apart == pytest.approx(sign * loss)
    (said,) = (note for note in found.notes if "wheels slip" in note)
    assert f"the {side} from 25." in said
    assert found.position.held_out.after < found.position.held_out.before


def test_a_short_slip_is_none(rolled, log):
    found = analyse_wheel_speeds([spinning(log, times=3.0, span_s=(25.0, 25.2), sides=("left",))], rolled)
    assert (found.verdict, found.effects) == ("nothing_missing", ())


def test_a_robot_that_rolls_has_none(rolled, log):
    assert analyse_wheel_speeds([log], rolled).effects == ()


def test_without_a_calibration_it_is_a_contact_mode(log):
    found = analyse_wheel_speeds([spinning(log)])
    assert (found.verdict, found.effects) == ("nothing_missing", ())


def test_where_no_modes_are_identified_none_is(rolled, log):
    for modes, slips_to in (("identified", 0.0), ("ideal", 1.0)):
        options = GapOptions(modes=modes)
        problem = problem_of([spinning(log)], base_of(ROBOT, rolled), options, "wheel_speed")
        assert problem.slips_to == slips_to
        assert bool(seen_slips(select(problem, 0))) is (slips_to == 0)


def test_a_robot_that_slipped_on_its_calibration_log_slips(log):
    slipped = calibrate_wheel_speeds([spinning(drive({}, noise=NOISE, seed=4))], ROBOT).model
    assert 0.6 < slipped.misfit["slip_interval"] < 0.9
    found = analyse_wheel_speeds([spinning(log)], slipped)
    assert (found.verdict, found.effects) == ("nothing_missing", ())


def test_a_pose_that_stands_and_catches_up_is_no_slip(rolled, log):
    assert not any(
        one.name == "slip_interval"
        for one in analyse_wheel_speeds([held_by_its_tracker(log)], rolled).effects
    )


def test_slips_in_one_place_are_a_patch_there(rolled, log):
    """The second one follows before the robot has left."""
    twice = spinning(spinning(log, span_s=(25.0, 26.6)), span_s=(27.0, 28.6))
    (patch,) = analyse_wheel_speeds([twice], rolled).effects
    at_s = (log.pose.t_ns - STARTED_NS) / NS_PER_S
    inside = (at_s > 25.5) & (at_s < 28.0)
    assert patch.name == "low_grip_patch"
    size = {key: one.value for key, one in patch.parameters.items()}
    away_m = np.hypot(log.pose.x_m[inside] - size["x_m"], log.pose.y_m[inside] - size["y_m"])
    assert away_m.max() < size["radius_m"] + 0.3


def test_a_robot_that_rolls_back_while_its_wheels_drive_on_loses_no_more_than_a_model_file_holds():
    measured, predicted, sd = (np.full((3, 4), value) for value in (-0.2, 3.0, 0.05))
    rates = Rates.__new__(Rates)
    rates.measured, rates.predicted, rates.sd, rates.half_track_m = measured, predicted, sd, 0.25
    assert Domain.SHARE.holds(rates.lost_share(np.ones(4, bool), "both"))
    rates.measured = 0.25 * predicted
    assert rates.lost_share(np.ones(4, bool), "both") == pytest.approx(0.75)
    left = (predicted[0] - 0.25 * predicted[2]) / 2  # half of what the left wheel rolls
    rates.measured = predicted - 0.4 * np.stack([left, 0 * left, -left / 0.25])
    assert rates.lost_share(np.ones(4, bool), "left") == pytest.approx(0.4)
    assert rates.gains("left").max() > rates.gains("right").max()


@pytest.mark.parametrize(("wider", "gain", "found"), [(0.1, 61, True), (0.3, 149, False), (0.3, 151, True)])
def test_the_wheels_of_a_robot_that_scrubs_must_spin_more(monkeypatch, wider, gain, found):
    monkeypatch.setattr(seen_slipping, "stays_behind", lambda *_: True)
    settings, bins = GapOptions().gates.wheel_speed, SimpleNamespace(step_s=0.2)
    base = {"effective_track": {"ratio": wider}}
    problem = SimpleNamespace(settings=settings, base=base, bins=bins, slips_to=0.0)
    assert is_found(problem, None, Slip(np.ones(4, bool), gain, 0.7, 0.1)) is found
    assert not is_found(problem, None, Slip(np.ones(3, bool), gain, 0.7, 0.1))  # .6 s
    problem.slips_to = 0.4
    assert not is_found(problem, None, Slip(np.ones(4, bool), gain, 0.7, 0.1))  # less than twice as much


@pytest.mark.parametrize(
    ("channel", "share", "stays"), [(0, 0.2, True), (2, 0.2, True), (0, 1.0, False), (2, 1.0, False)]
)
def test_a_robot_stays_behind_ahead_or_where_it_turns_on_the_spot(monkeypatch, channel, share, stays):
    """Wheels that roll 6 m or rad in 10 bins, of which the robot makes a share by the end."""
    way = np.zeros((3, 20))
    way[channel] = np.clip(np.arange(20.0) - 5, 0, 10) * 0.6
    whole = SimpleNamespace(predicted=lambda _: way, measured=share * way)
    problem = SimpleNamespace(with_slip=whole, settings=GapOptions().gates.wheel_speed)
    monkeypatch.setattr(seen_slipping, "Rates", lambda *_: SimpleNamespace(half_track_m=0.25))
    slip = Slip((np.arange(20) > 4) & (np.arange(20) < 15), 100.0, 0.8, 0.1)
    assert stays_behind(problem, SimpleNamespace(values={}), slip) is stays


def test_beside_a_slip_terms_are_looked_for_without_the_moments_of_slip(rolled, log):
    """Those would explain it: they are made of the speeds of the wheels that spin."""
    problem = ideal_only(problem_of([spinning(log)], base_of(ROBOT, rolled), GapOptions(), "wheel_speed"), {})
    begun = select(problem, 0)
    slips = seen_slips(begun)
    assert len(slips) == 1
    assert begun.problem.whole is not None
    assert apart_from(begun, slips).problem.whole is None
    assert apart_from(begun, []) is begun


@pytest.mark.parametrize(("rolls", "name"), [(3, "low_grip_patch"), (8, "slip_interval")])
def test_a_place_through_which_the_robot_rolls_as_often_is_no_patch(monkeypatch, rolls, name):
    """Two slips of three bins about the origin, and so many bins there in which it rolls."""
    inside = np.arange(40) < 6
    x_m = np.where(np.arange(40) < 6 + rolls, 0.0, 5.0)
    bins = SimpleNamespace(mean=lambda path: path, t_s=0.2 * np.arange(40), step_s=0.2)
    whole = SimpleNamespace(
        bins=bins,
        record=SimpleNamespace(pose=np.stack([x_m, 0 * x_m, 0 * x_m])),
        predicted=lambda _: None,
        chassis=SimpleNamespace(half_track_m=0.25),
        settings=GapOptions().gates.wheel_speed,
    )
    whole.with_slip = whole
    monkeypatch.setattr(seen_slipping, "slopes", lambda *_: np.ones((3, 40)))
    slips = [Slip(inside & (np.arange(40) // 3 == k), 100.0, 0.5, 0.1) for k in (0, 1)]
    assert as_effect(whole, slips)[0] == name

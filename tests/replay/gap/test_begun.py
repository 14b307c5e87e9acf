"""A long log begins with what its first minutes show; what is long is 60 s here, and the beginning 30 s."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions, analyse
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.path_error import window_errors, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.binned_log import bin_log, lasts_long
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search import modes_and_effects
from wmr_replay.gap.search.begun import (
    Begun,
    beginning_of,
    begun_with,
    fitted_again,
    fitted_on_the_whole,
)
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import base_fit, forward_selection
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.errors import InvalidSignal
from wmr_synth import hidden_log

USUAL = GateSettings()
BEGUN, WORK = (
    replace(USUAL.begun, lasts_s=30.0, long_s=60.0),
    replace(USUAL.work, most=1e9, most_at_first=1e9),
)
SHORT = replace(USUAL, begun=BEGUN, work=WORK)
GIVEN = GapOptions(modes="given")


@pytest.fixture(scope="module")
def log():
    """90 s with a viscous drag."""
    return hidden_log("patrol", seed=90_131, hide=["viscous_drag:c1_per_s=.25"], noise="rtk")[0]


@pytest.fixture(scope="module")
def drive(log):
    """The log in bins with its modes; its base model; and what a selection on its beginning shows."""
    extension = base_model(log, None, GIVEN).extension
    early = Problem.of(bin_log(beginning_of(log, SHORT), SHORT, log.mode)).all_fitted()
    whole = Problem.of(bin_log(log, SHORT, log.mode)).all_fitted()
    return whole, extension, forward_selection(early, extension, GIVEN)


def begun_of(selection):
    return begun_with(selection.found, selection.stages, selection.fit.extension, SHORT)


def candidate(name, score, failed=""):
    return FittedCandidate(SimpleNamespace(name=name), None, score, score, 0.0, failed=failed)


def test_the_beginning_is_every_signal_up_to_its_end(log):
    end_ns = int(log.pose.t_ns[0]) + 30 * 10**9
    whole = replace(log, breaks_ns=(end_ns - 1, end_ns))
    early = beginning_of(whole, SHORT)
    for name in ("pose", "torque", "mode"):
        track, part = getattr(whole, name), getattr(early, name)
        n = int(np.searchsorted(track.t_ns, end_ns))
        assert 0 < n < len(track)
        for field in fields(track):
            np.testing.assert_array_equal(getattr(part, field.name), getattr(track, field.name)[:n])
    assert early.breaks_ns == (end_ns - 1,)
    assert early.robot == log.robot
    assert early.wheels is log.wheels is None


@pytest.mark.parametrize(("seconds", "long"), [(59.9, False), (60.1, True)])
def test_a_log_is_long_by_its_length(log, seconds, long):
    part = beginning_of(log, replace(USUAL, begun=replace(USUAL.begun, lasts_s=seconds)))
    assert lasts_long(part.pose, SHORT) == long
    assert not lasts_long(part.pose, USUAL)


def test_only_what_acts_throughout_is_begun_with():
    loss, drag = candidate("slip_interval", 50.0), candidate("viscous_drag", 400.0)
    stages = (
        (loss, candidate("payload", 40.0)),
        (
            drag,
            candidate("payload", 350.0),
            candidate("slope", 380.0, failed="for a reason"),
            candidate("low_friction_patch", 390.0),
            candidate("scrub_torque", 310.0),
            candidate("rolling_resistance", 305.0),
            candidate("drive_gain", 299.0),
        ),
    )
    begun = begun_with((loss, drag), stages, None, USUAL)
    assert [[one.name for one in stage] for stage in begun.stages] == [
        ["viscous_drag", "payload", "scrub_torque"]
    ]
    assert begun_with((loss,), stages[:1], None, USUAL) is None
    assert begun_with((), (), None, USUAL) is None


@pytest.mark.parametrize("name", ["unnamed:longitudinal:v*v", "undeclared_skid"])
def test_nothing_is_begun_with_a_formula_or_a_skid(name):
    found = candidate("viscous_drag", 400.0), candidate(name, 100.0)
    assert begun_with(found, tuple((one,) for one in found), None, USUAL) is None


def test_what_is_begun_is_fitted_again_on_the_whole(drive):
    problem, extension, selection = drive
    begun = begun_of(selection)
    assert list(begun.effects) == ["viscous_drag"]
    base = base_fit(problem, extension)
    (stage,) = fitted_on_the_whole(problem, base, begun)
    best = stage[0]
    assert best.fit.problem is problem
    assert best.gain == base.deviance - best.fit.deviance > selection.found[0].gain > 0
    assert best.fit.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(0.25, rel=0.1)
    assert best.alternatives == tuple(
        (one.name, best.score - one.score) for one in stage[1:] if one.score > 0
    )
    whole = forward_selection(problem, extension, GIVEN, begun=begun)
    assert [one.name for one in whole.found] == ["viscous_drag"]


def test_what_the_whole_does_not_show_is_not_begun_with(drive):
    problem, extension, selection = drive
    base = base_fit(problem, extension)
    drag = selection.found[0]
    wrong = replace(
        drag,
        scored=replace(drag.scored, name="scrub_torque", parameters={"d0_mps2": 0.01}),
        fit=replace(drag.fit, extension=extension.with_effect("scrub_torque", {"d0_mps2": 0.01})),
    )
    assert fitted_again(problem, base, wrong, base.noise).score < 0
    assert fitted_on_the_whole(problem, base, Begun(((wrong,), (drag,)), wrong.fit.extension)) == []
    (stage,) = fitted_on_the_whole(problem, base, Begun(((drag, wrong),), drag.fit.extension))
    assert stage[0].name == "viscous_drag"


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [False, True])
def test_a_long_log_gets_the_answer_of_the_whole(monkeypatch, log, wrong):
    """Also where its beginning shows something else."""
    if wrong:
        angle = {"angle_rad": 0.05}
        turned = base_model(log, None, GIVEN).extension.with_effect("heading_misalignment", angle)
        scored = ScoredCandidate("heading_misalignment", angle, 99.0, 1)
        false = FittedCandidate(scored, SimpleNamespace(extension=turned, noise=None), 99.0, 99.0, 0.0)
        monkeypatch.setattr(modes_and_effects, "begun_with", lambda *_: Begun(((false,),), turned))
    result = analyse(log, None, GapOptions(gates=SHORT))
    plain = analyse(log, None, GapOptions())
    assert [effect.name for effect in result.effects] == [effect.name for effect in plain.effects]
    assert [effect.name for effect in result.effects] == ["viscous_drag"]
    assert result.verdict == plain.verdict == "named"


def cut(track, rows):
    return type(track)(**{field.name: getattr(track, field.name)[rows] for field in fields(track)})


@pytest.mark.slow
@pytest.mark.parametrize("lacks", ["torques", "known torques", "poses"])
def test_a_long_log_whose_beginning_tells_nothing_is_analysed_as_a_whole(log, lacks):
    """As where the torques' driver starts late, or the tracker is lost at first. Modes are given: with
    identified ones, several effects are about as likely on the rest of the log.
    """
    pose, torque = log.pose, log.torque
    torque_s, pose_s = ((track.t_ns - pose.t_ns[0]) / 1e9 for track in (torque, pose))
    if lacks == "torques":
        torque = cut(torque, torque_s > 35)
    elif lacks == "known torques":
        torque = replace(torque, left_nm=np.where(torque_s > 35, torque.left_nm, np.nan))
    else:
        pose = cut(pose, (pose_s < 0.5) | (pose_s > 35))
    late = replace(log, pose=pose, torque=torque)
    result, plain = (analyse(late, None, GapOptions(modes="given", gates=gates)) for gates in (SHORT, USUAL))
    assert result.verdict == plain.verdict
    assert [effect.name for effect in result.effects] == [effect.name for effect in plain.effects]


@pytest.mark.parametrize("known", [slice(0, 0), slice(None)])
def test_a_log_without_a_known_torque_is_refused(log, known):
    torque = cut(log.torque, known)
    nothing = replace(log, torque=replace(torque, left_nm=np.full(len(torque), np.nan)))
    with pytest.raises(InvalidSignal, match="the log has none"):
        analyse(nothing)


def test_a_log_whose_first_pose_stands_alone_is_refused(log):
    pose_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    alone = replace(log, pose=cut(log.pose, (pose_s < 0.001) | (pose_s > 35)))
    with pytest.raises(InvalidSignal, match="a hole of 35 s follows"):
        analyse(alone)


def test_a_window_begins_on_the_side_that_the_model_turns_the_yaw_to():
    """A drift of 4.5 rad: from the measured yaw, simulations would start backwards and stay there."""
    log, _ = hidden_log("patrol", seed=90_132, hide=["yaw_drift:rate_radps=.05"], noise="mocap")
    binned = bin_log(log, USUAL, log.mode)
    extension = base_model(log, None, GIVEN).extension.with_effect("yaw_drift", {"rate_radps": 0.05})
    errors = window_errors(binned, extension, windows_of(binned, np.ones(len(binned), bool)))
    assert len(errors.yaw_rad) > 15
    assert errors.yaw_rad.max() < 0.1

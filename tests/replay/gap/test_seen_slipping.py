"""Slipping of a calibrated robot of unknown masses: a loss of traction that its contact modes show."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.result.verdict import less_than_slipping_note
from wmr_replay.gap.search.seen_slipping import (
    LESS,
    disc_of,
    is_near,
    loss_in,
    seen_slips,
    slipping_left,
    with_seen_slipping,
)
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.slip_test import may_be_slipping
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log
from wmr_synth import hidden_log

MISFIT = {"slope": 0.01}
GATES = GapOptions().gates


def of_unknown_masses(log: Log) -> Log:
    return replace(log, robot=replace(log.robot, wheel_inertia_kgm2=None))


def seen_by_base(log: Log, misfit=MISFIT):
    """The problem with the base model's modes, and a selection that found nothing."""
    extension = replace(base_model(log, None, GapOptions()).extension, misfit=misfit)
    track = likely_modes(log, extension, GATES)
    problem = Problem.of(bin_identified(log, track, GATES)).all_fitted()
    base = fit_model(problem, extension)
    return problem, Selection(base, base, (), ())


@pytest.fixture(scope="module")
def slipping():
    """A log that skids by itself, and loses nine tenths of its traction from 30 to 40 s."""
    hide = ["slip_interval:start_s=30,end_s=40,loss=0.9"]
    return of_unknown_masses(hidden_log("patrol", seed=90_106, hide=hide, noise="rtk")[0])


def test_slips_that_are_far_likelier_than_rolling_are_true(slipping):
    problem, selection = seen_by_base(slipping)
    slips = seen_slips(problem, selection.base.extension, selection.base.noise)
    first, last, gain = max(slips, key=lambda slip: slip[2])
    assert all(slip[2] > GATES.slip.seen_gain for slip in slips)
    assert gain > 2000
    assert problem.binned.t_s[first] == pytest.approx(30.0, abs=3.0)
    assert problem.binned.t_s[last - 1] == pytest.approx(40.0, abs=3.0)


@pytest.mark.parametrize(("times", "seen"), [(0.9, True), (1.1, False)])
def test_on_a_longer_log_a_slip_must_be_likelier(slipping, times, seen):
    """By √n where the log is n times as long."""
    problem, selection = seen_by_base(slipping)
    extension, noise = selection.base.extension, selection.base.noise
    gain = max(slip[2] for slip in seen_slips(problem, extension, noise))
    lasts_s, least = problem.binned.t_s[-1] - problem.binned.t_s[0], GATES.slip.seen_gain
    own = replace(GATES.slip, seen_in_s=lasts_s * (least / (times * gain)) ** 2)
    assert bool(seen_slips(problem.under(replace(GATES, slip=own)), extension, noise)) is seen


def test_skids_that_lose_nothing_ahead_are_none():
    log = of_unknown_masses(hidden_log("stop-and-go", seed=4, noise="rtk")[0])
    problem, selection = seen_by_base(log)
    slips = seen_slips(problem, selection.base.extension, selection.base.noise)
    first, last, _ = max(slips, key=lambda slip: slip[2])
    assert not np.any(problem.binned.slips[first:last])
    assert loss_in(problem, selection.base, (first, last, 1e4), slips) is None
    assert slipping_left(problem, selection.base) == {}


def test_the_likeliest_one_is_a_loss_of_traction(slipping):
    problem, selection = seen_by_base(slipping)
    slips = seen_slips(problem, selection.base.extension, selection.base.noise)
    first, last, gain = max(slips, key=lambda slip: slip[2])
    rest, said = with_seen_slipping(problem, selection)
    (found,) = said.found
    assert found.name in ("slip_interval", "low_friction_patch")
    assert found.gain >= gain
    assert said.fit.extension.effects[found.name]["loss"] >= GATES.slip.least_of_unknown
    assert said.fit.deviance < said.base.deviance
    assert not rest.binned.slips[first:last].any()


@pytest.mark.parametrize(
    ("misfit", "known"), [({}, False), (MISFIT, True), (MISFIT | {"slip_interval": 0.5}, False)]
)
def test_it_is_none_of_a_robot_that_is_not_calibrated_or_known_or_slips_anyway(misfit, known, slipping):
    log = hidden_log("patrol", seed=90_106, noise="rtk")[0] if known else slipping
    assert (log.robot.slip_shares is not None) is known
    assert with_seen_slipping(*seen_by_base(log, misfit)) is None


def test_slips_at_one_place_are_a_patch():
    """Two slips near each other, and one far away."""
    binned = SimpleNamespace(pose=np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [9, 9], [9, 8]]))
    slips = [(0, 2, 300.0), (1, 4, 400.0), (4, 6, 500.0)]
    assert [is_near(binned, one, slips[1]) for one in slips] == [True, True, False]
    disc = disc_of(binned, slips[:2])
    assert disc == pytest.approx({"x_m": 0.5, "y_m": 0.5, "radius_m": np.sqrt(0.5)})


def test_an_effect_that_explains_more_stands(slipping):
    problem, selection = seen_by_base(slipping)
    _, said = with_seen_slipping(problem, selection)
    (slip,) = said.found
    drag = replace(slip, scored=replace(slip.scored, name="viscous_drag"))
    more, less = (replace(drag, gain=times * slip.gain) for times in (10, 0.1))
    assert with_seen_slipping(problem, replace(selection, found=(more,))) is None
    _, said = with_seen_slipping(problem, replace(selection, found=(less,), stages=((less,),)))
    assert [one.name for one in said.found] == [slip.name]
    assert [(one.name, one.failed) for one in said.stages[0]] == [(slip.name, ""), ("viscous_drag", LESS)]
    (note,) = less_than_slipping_note(said)
    assert note.startswith("viscous_drag would explain some of it")
    assert not less_than_slipping_note(selection)


def test_a_log_that_rolls_has_none():
    log = of_unknown_masses(hidden_log("cruise", seed=4, noise="rtk")[0])
    assert not np.any(log.mode.mode & ContactMode.SLIPPING)
    problem, selection = seen_by_base(log)
    assert not seen_slips(problem, selection.base.extension, selection.base.noise)
    assert with_seen_slipping(problem, selection) is None


def test_fit_writes_that_its_log_slips(slipping):
    problem, selection = seen_by_base(slipping)
    (_, size), *others = slipping_left(problem, selection.base).items()
    assert (size > GATES.slip.least_of_unknown, others) == (True, [])
    rolling = problem.relabelled(replace(slipping.mode, mode=np.zeros_like(slipping.mode.mode)))
    assert slipping_left(rolling, selection.base) == {}


@pytest.mark.parametrize("loss", [0.2, 0.5])
def test_no_loss_of_a_calibrated_robot_is_named_by_its_size(loss, slipping):
    problem, selection = seen_by_base(slipping)
    lost = {"start_s": 30.0, "end_s": 35.0, "loss": loss}
    fit = replace(selection.base, extension=selection.base.extension.with_effect("slip_interval", lost))
    assert may_be_slipping(problem, fit, "slip_interval")

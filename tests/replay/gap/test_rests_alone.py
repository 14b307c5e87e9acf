"""What a base model holds: a rest by what makes it an effect, and as many as the library has names for."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_log

from wmr_replay.gap import GapOptions
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import gauss_newton
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search import rests
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import as_rest_alone, base_fit, with_rests_alone

NAME = "aerodynamic_drag"
OWN = SETTINGS.misfit


@pytest.fixture(scope="module")
def medium():
    """The problem, and a medium that hardly brakes the way ahead, with something of turns, fitted."""
    problem = Problem.of(bin_log(made_log(1, drag_per_s=0.02), SETTINGS)).all_fitted()
    bare = Extension(BASE, misfit={NAME: 0.05})
    current = base_fit(problem, bare)
    start = bare.with_effect(NAME, {"c2_per_m": 0.02, "e2_per_m": 0.15})
    fit = gauss_newton(problem, start, current.noise, 1)
    gain = current.deviance - fit.deviance
    return problem, FittedCandidate(ScoredCandidate(NAME, {}, 0.0, 1), fit, gain, 10.0, 1e-9)


def test_a_medium_that_hardly_brakes_the_way_ahead_is_a_rest_by_that_alone(medium):
    problem, found = medium
    assert found.fit.extension.effects[NAME]["e2_per_m"] > 0
    alone = as_rest_alone(problem, found)
    assert alone.fit.extension.effects[NAME]["e2_per_m"] == 0.0
    lost = alone.fit.deviance - found.fit.deviance
    assert lost > 0.1
    assert (alone.gain, alone.score) == pytest.approx((found.gain - lost, found.score - lost))
    assert as_rest_alone(problem, alone) is alone


def test_one_that_matters_and_one_of_a_base_that_was_not_calibrated_stay_whole(medium):
    problem, found = medium
    for misfit, size in (({NAME: 0.001}, 0.1), ({}, 0.001)):
        extension = replace(found.fit.extension, misfit=misfit)
        extension = extension.with_effect(NAME, {"c2_per_m": size, "e2_per_m": 0.1})
        whole = replace(found, fit=replace(found.fit, extension=extension))
        assert as_rest_alone(problem, whole) is whole


def test_behind_what_it_hid_it_comes_second(medium):
    problem, found = medium
    lost = as_rest_alone(problem, found).fit.deviance - found.fit.deviance
    scrub = found.fit.extension.without(NAME).with_effect("scrub_torque", {"d0_mps2": 0.1})
    other = replace(
        found,
        scored=ScoredCandidate("scrub_torque", {}, 0.0, 1),
        fit=replace(found.fit, extension=scrub),
        score=found.score - lost / 2,
    )
    assert [one.name for one in with_rests_alone(problem, (found, other))] == ["scrub_torque", NAME]
    assert with_rests_alone(problem, (other,)) == (other,)


@pytest.mark.parametrize(
    ("found", "asked"),
    [
        (["com_offset"], [(OWN.most_rests, True)]),
        (["com_offset", "unnamed:yaw:v", "scrub_torque"], [(OWN.most_rests, True)]),
        (
            ["com_offset", "wheel_viscous", "scrub_torque"],
            [(OWN.most_rests, True), (OWN.most_of_library, False)],
        ),
    ],
)
def test_a_calibration_takes_more_rests_where_the_library_has_a_name_for_each(found, asked, monkeypatch):
    calls = []

    def selected(_problem, _extension, options, *, terms):
        calls.append((options.max_effects, terms))
        return SimpleNamespace(found=[SimpleNamespace(name=name) for name in found])

    monkeypatch.setattr(rests, "forward_selection", selected)
    made = rests.all_rests(SimpleNamespace(settings=SETTINGS), Extension(BASE), GapOptions())
    assert calls == asked
    assert len(made) == len(asked)
    assert OWN.most_of_library > OWN.most_rests

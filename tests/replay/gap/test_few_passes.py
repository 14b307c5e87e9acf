"""Fits and searches that ask for no more passes of the filter than the answer needs."""

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation import problem as filtered_logs
from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model, gauss_newton, newton_step, sensitivities
from wmr_replay.gap.estimation.relabel import with_slipping
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import LIBRARY
from wmr_replay.gap.model.work import Work
from wmr_replay.gap.search import modes_and_effects
from wmr_replay.gap.search.selections import Selections
from wmr_replay.gap.settings import GateSettings
from wmr_synth import hidden_log

SETTINGS = GateSettings()
GIVEN = GapOptions(modes="given")


@pytest.fixture(scope="module")
def dragged():
    """A log with a viscous drag, its base model, and the disturbance that is left beside the drag."""
    log, _ = hidden_log("patrol", seed=90_120, hide=["viscous_drag:c1_per_s=.15"], noise="rtk")
    problem = Problem.of(bin_log(log, SETTINGS, log.mode))
    extension = base_model(log, None, GIVEN).extension.with_effect("viscous_drag", {"c1_per_s": 0.0})
    return problem, extension, fit_model(problem, extension).noise


@pytest.fixture
def passes(monkeypatch):
    """The passes of the filter that are computed while a test runs."""
    computed, filter_pass = [], filtered_logs.filter_pass
    monkeypatch.setattr(
        filtered_logs, "filter_pass", lambda *args: computed.append(args) or filter_pass(*args)
    )
    return computed


def promised(problem, fit):
    """By how much a step with fresh sensitivities would lower the deviance."""
    psi = sensitivities(problem, fit.extension, fit.noise, fit.keys, fit.innovations)[problem.train]
    step = newton_step(psi, fit.innovations[problem.train], SETTINGS.refit)
    return float(np.sum((psi @ step) ** 2))


def test_a_linear_fit_has_one_set_of_sensitivities_and_ends_at_the_optimum(dragged, passes):
    problem, extension, noise = dragged
    fit = gauss_newton(problem, extension, noise, 4)
    assert len(passes) <= 4  # the start, its slope, a step, and one more with the same slope
    assert fit.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(0.15, abs=0.05)
    assert promised(problem, fit) < SETTINGS.refit.enough / 10


def test_a_fit_that_starts_at_its_optimum_takes_no_step(dragged, passes):
    problem, extension, noise = dragged
    there = gauss_newton(problem, extension, noise, 4)
    n_before = len(passes)
    fresh = replace(problem, binned=problem.binned.part(slice(0, len(problem.binned))))
    again = gauss_newton(fresh, there.extension, noise, 4)
    assert len(passes) - n_before == 2  # the start and its slope
    assert again.extension == there.extension


def test_what_was_fitted_is_known_on_the_same_rows_alone(dragged, passes):
    problem, extension, noise = dragged
    fit, found = gauss_newton(problem, extension, noise, 3), fit_diffusion(problem, extension, noise, 3)
    n_before = len(passes)
    assert gauss_newton(replace(problem), replace(extension), noise, 3) is fit
    assert fit_diffusion(replace(problem), replace(extension), noise, 3) is found
    assert len(passes) == n_before
    whole, keys = problem.all_fitted(), (("viscous_drag", "c1_per_s"),)
    calmer = noise._replace(yaw_sd_mps2=noise.yaw_sd_mps2 / 2)
    started = extension.with_effect("viscous_drag", {"c1_per_s": 0.1})
    assert gauss_newton(whole, extension, noise, 3).deviance != fit.deviance
    assert gauss_newton(problem, extension, calmer, 3).deviance != fit.deviance
    assert gauss_newton(problem, extension, noise, 0).extension == extension
    assert gauss_newton(problem, extension, noise, 3, keys=()).extension == extension
    assert gauss_newton(problem, started, noise, 3, keys=keys).extension != started
    assert fit_diffusion(whole, extension, noise, 3) != found
    assert fit_diffusion(problem, started, noise, 3) != found


def test_a_curved_fit_ends_at_its_optimum(dragged):
    problem, extension, noise = dragged
    curved = extension.with_effect("payload", {"mass_ratio": 1.0}).with_effect("yaw_inertia", {"ratio": 1.5})
    fit = gauss_newton(problem, curved, noise, 12)
    assert promised(problem, fit) < SETTINGS.refit.enough


def test_other_labels_leave_the_bins_as_they_are(dragged):
    binned = dragged[0].binned
    track = with_slipping(binned, np.arange(len(binned)) % 400 < 100)
    margin_s = binned.margin * SETTINGS.bins.bin_s
    whole = bin_log(binned.log, SETTINGS, track, margin_s=margin_s, names_skid=binned.names_skid)
    again = binned.relabelled(track)
    for name in ("t_s", "pose", "count", "mode", "noise_sd", "variances", "scatter"):
        np.testing.assert_array_equal(getattr(again, name), getattr(whole, name), err_msg=name)
    assert (again.track, again.margin, again.names_skid) == (whole.track, whole.margin, whole.names_skid)
    assert np.any(again.mode != binned.mode)


@pytest.mark.parametrize("misfit", [{}, {"viscous_drag": 0.02}])
def test_the_base_of_a_selection_is_known_without_it(dragged, misfit):
    problem, extension, _ = dragged
    base = replace(extension, effects={}, misfit=misfit)
    alone = Selections(base, GIVEN).base(problem)
    selection = Selections(base, GIVEN).of(problem)
    assert alone.noise == selection.base.noise
    assert alone.extension == selection.base.extension


def test_a_selection_that_is_far_behind_is_made_again_only_where_no_other_holds(monkeypatch):
    def costing(cost):
        return SimpleNamespace(cost=cost)

    made, far = [], SETTINGS.modes.far_behind
    monkeypatch.setattr(
        modes_and_effects, "with_missed_slipping", lambda seen, _: made.append(seen) or costing(seen.cost - 5)
    )
    monkeypatch.setattr(modes_and_effects, "cost_as_seen", lambda seen: seen.cost)
    monkeypatch.setattr(modes_and_effects, "made_on_the_whole", lambda seen, _: seen)
    solutions, selections = [costing(200.0), costing(1.0), costing(2.0)], SimpleNamespace(options=GIVEN)
    likely = modes_and_effects.with_seen(solutions, costing(2.0 + far), 150.0, selections, Work())
    assert next(likely).cost == 1.0
    assert not made
    assert [one.cost for one in likely] == [2.0, far - 3.0]
    assert len(made) == 1
    spent = Work(0.0)
    likely = modes_and_effects.with_seen(solutions, costing(2.0 + far), 150.0, selections, spent)
    assert [one.cost for one in likely] == [1.0, 2.0]
    assert len(made) == 1
    assert spent.left_out


@pytest.mark.parametrize("candidate", LIBRARY, ids=lambda candidate: candidate.name)
def test_models_share_the_inputs_of_a_pass_only_where_these_are_the_same(dragged, candidate):
    problem, extension, _ = dragged
    middle = {key: float(np.clip(1.0, *candidate.bounds[key])) for key in candidate.free}
    models = [extension, extension.with_effect(candidate.name, middle)]
    for key in candidate.free:
        high = candidate.bounds[key][1]
        moved = middle[key] + candidate.steps[key]
        other = {**middle, key: moved if moved <= high else middle[key] - candidate.steps[key]}
        models.append(extension.with_effect(candidate.name, other))
    for a, b in combinations(models, 2):
        same = np.array_equal(a.rows(problem.binned), b.rows(problem.binned))
        assert same or a.of_rows != b.of_rows

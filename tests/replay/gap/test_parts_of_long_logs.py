"""What long logs spare: selections on a part, stretches that are left out, and models that are far behind."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.estimation.relabel import with_mode_at
from wmr_replay.gap.formula import search
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import SKID
from wmr_replay.gap.search.labellings import Labelling
from wmr_replay.gap.search.modes_and_effects import FarBehind
from wmr_replay.gap.search.preliminary import part_of_interest
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.selections import Selections
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode
from wmr_synth import hidden_log

OPTIONS = GapOptions(modes="given")
SHORT = replace(GateSettings(), modes=replace(GateSettings().modes, part_rows=400))


@pytest.fixture(scope="module")
def drive():
    """A log with a viscous drag, all rolling, of which 400 rows are a part; and its base model."""
    log, _ = hidden_log("patrol", seed=90_121, hide=["viscous_drag:c1_per_s=.2"], noise="rtk")
    return Problem.of(bin_log(log, SHORT)).all_fitted(), base_model(log, None, OPTIONS).extension


def slipping(problem, first, last):
    """The problem with slipping in rows."""
    rows = np.zeros(len(problem.binned), bool)
    rows[first:last] = True
    return problem.relabelled(with_mode_at(problem.binned, rows, ContactMode.SLIPPING))


def test_a_part_in_finer_bins_is_that_part_of_the_whole_in_finer_bins(drive):
    problem, _ = drive
    whole, part = problem.finer().binned, problem.part(slice(300, 700)).finer().binned
    half_s = SHORT.bins.bin_s / 2
    edges = problem.binned.t_s[300] - half_s, problem.binned.t_s[699] + half_s
    within = (whole.t_s > edges[0]) & (whole.t_s < edges[1])
    np.testing.assert_array_equal(part.t_s, whole.t_s[within])
    np.testing.assert_array_equal(part.pose, whole.pose[within])
    assert len(part) == pytest.approx(800, abs=2)


def test_parts_with_the_same_labels_are_two(drive):
    problem, extension = drive
    selections = Selections(extension, OPTIONS)
    one, other = (problem.part(slice(first, first + 400)) for first in (0, 500))
    assert selections.known(one) is one
    assert selections.known(other) is other
    assert selections.known(problem.part(slice(500, 900))) is other


@pytest.mark.parametrize(("rows", "first"), [((600, 640), 419), ((0, 10), 0), ((2200, 2240), None)])
def test_of_a_long_log_the_part_about_what_differs_is_looked_at(drive, rows, first):
    problem, _ = drive
    part = part_of_interest(Labelling(slipping(problem, *rows)), problem).binned
    begin = first if first is not None else len(problem.binned) - 400
    np.testing.assert_allclose(part.t_s, problem.binned.t_s[begin : begin + 400], atol=0.1)
    assert np.any(part.mode == ContactMode.SLIPPING)


def test_a_short_log_is_looked_at_as_a_whole(drive):
    problem, _ = drive
    short = problem.part(slice(0, 799))
    labelled = slipping(short, 100, 120)
    assert part_of_interest(Labelling(labelled), short) is labelled


def test_a_model_is_far_behind_where_it_explains_far_less_and_has_other_effects(drive):
    problem, extension = drive
    settings = replace(SHORT, modes=replace(SHORT.modes, out_of_reach=100.0))
    behind = FarBehind(problem.under(settings), Selections(extension, OPTIONS))
    true = extension.with_effect("viscous_drag", {"c1_per_s": 0.2})
    assert behind.is_far(extension.with_effect("payload", {"mass_ratio": 0.5}), true)
    assert not behind.is_far(extension.with_effect("viscous_drag", {"c1_per_s": 0.8}), true)
    assert not behind.is_far(true, extension.with_effect("payload", {"mass_ratio": 0.5}))
    skids = SimpleNamespace(effects={SKID: {}})
    assert not behind.is_far(skids, true)


@pytest.mark.parametrize(("seconds", "asked"), [(15.0, False), (60.0, True)])
def test_beside_what_is_named_a_part_of_a_long_log_must_show_a_formula(monkeypatch, drive, seconds, asked):
    problem, extension = drive
    problem = problem.part(slice(0, round(seconds / SHORT.bins.bin_s)))
    fit = fit_model(problem, extension.with_effect("viscous_drag", {"c1_per_s": 0.2}))
    nothing = Selection(fit_model(problem, extension), fit, (), ())
    rows = []

    def best_formula(part, seen, *_):
        rows.append((len(part.binned), len(seen.fit.innovations), len(seen.base.innovations)))

    monkeypatch.setattr(search, "points_outside", lambda *_: True)
    monkeypatch.setattr(search, "best_formula", best_formula)
    library = (SimpleNamespace(name="viscous_drag"),)
    ways = search.ways_to_look(problem, nothing, library, OPTIONS)
    assert ways == (() if asked else tuple(search.Way))
    assert search.ways_to_look(problem, nothing, (), OPTIONS) == (search.Way.BESIDE,)
    assert rows == [(400, 400, 400)] * asked


@pytest.mark.parametrize("effects", [{}, {"viscous_drag": {"c1_per_s": 0.2}}])
def test_a_formula_stands_where_the_part_shows_it(monkeypatch, drive, effects):
    """Beside the library's effects, or in their place: the other one is not looked for on the whole."""
    problem, extension = drive
    fit = fit_model(problem, extension.with_effect("viscous_drag", {"c1_per_s": 0.2}))
    selection = Selection(fit_model(problem, extension), fit, (), ())
    rest = SimpleNamespace(extension=SimpleNamespace(effects=effects))
    found = SimpleNamespace(formula=SimpleNamespace(rest=rest))
    monkeypatch.setattr(search, "points_outside", lambda *_: True)
    monkeypatch.setattr(search, "best_formula", lambda *_: found)
    way = search.Way.BESIDE if effects else search.Way.IN_PLACE
    assert search.ways_to_look(problem, selection, (SimpleNamespace(name="viscous_drag"),), OPTIONS) == (way,)

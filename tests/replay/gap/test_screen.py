"""The screen against the filter itself, and the grids that it scores."""

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.grids import Grid
from wmr_replay.gap.formula.groups import Group, groups_of, twins_of, without_terms
from wmr_replay.gap.formula.scores import scored_groups
from wmr_replay.gap.formula.screen import Columns, answers_of, fitted_innovations, screen_of, some_of
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.settings import GateSettings

BENCH = Path(__file__).parents[3] / "bench"
SETTINGS = GateSettings()


@pytest.fixture(scope="module")
def problem():
    """A log on which a gust blows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        case = importlib.import_module("worlds.case").Case(2, "patrol", "mocap", "", 4, 60.0)
        log = importlib.import_module("formulas.plants").hidden_world("squall", case).world.log
    return Problem.of(bin_log(log, SETTINGS, log.mode)).fold(0), BaseModel(log.robot, (), "test").extension


def test_the_screen_scores_as_the_filter_does(problem):
    problem, extension = problem
    fit = fit_model(problem, extension)
    calm = calmed(fit.noise, SETTINGS.diffusion)
    at = evaluate(problem, extension, calm)
    tried = groups_of(problem.binned, SETTINGS.formula)
    screen = screen_of(problem, at, fitted_innovations(problem, at.innovations)[:, :, None], at.psi)
    grids = [grid for grid in tried.grids if len(grid) > 1][::7]
    ours = {tried.group(grid, 1).names: screen.gains(grid)[1, 0] for grid in grids}
    theirs = scored_groups(problem, at, [tried.group(grid, 1) for grid in grids])
    most = max(one.gain for one in theirs)
    large = [one for one in theirs if one.gain > most / 4]
    assert most > 100
    assert len(large) > 3
    for one in large:
        assert ours[one.group.names] == pytest.approx(one.gain, rel=0.15)


def test_no_group_of_the_grids_is_an_effect_of_the_library(problem):
    tried = groups_of(problem[0].binned, SETTINGS.formula)
    twins = twins_of(["slope", "viscous_drag", "rolling_resistance", "drive_gain", "yaw_damping"])
    shaped = {
        name
        for grid in tried.grids
        for family, numbers in grid.pieces
        for name in tried.group(Grid(((family, numbers),)), 0).names
        if name not in {term.name for term in family.plain_terms}
    }
    assert not shaped & twins


def test_a_family_goes_on_without_terms_that_a_model_has():
    family = Family("fall", "longitudinal", "v", (("effort_sum",),), plain=True)
    tried = Group(family, family.terms((0.3,)), (0.3,))
    (bare,) = without_terms([tried], {"unnamed:longitudinal:effort_sum"})
    assert bare.names == ("unnamed:longitudinal:effort_sum*fall(v,0.3)",)
    assert bare.moved(np.array([0.4])).names == ("unnamed:longitudinal:effort_sum*fall(v,0.4)",)
    assert without_terms([tried], set(bare.names)) == ()
    assert [part.names for part in tried.parts] == [bare.names, ("unnamed:longitudinal:effort_sum",)]


@pytest.mark.parametrize("n", [7, 12, 47])
def test_some_stretches_are_spread_all_along(n):
    own = SETTINGS.formula
    chosen = some_of(n, own)
    assert chosen[0]
    assert chosen.all() == (n < 2 * own.most_stretches)
    assert chosen.sum() <= 2 * own.most_stretches
    starts = np.flatnonzero(np.diff(chosen, prepend=False) & chosen)
    assert len(starts) == 1 or np.ptp(np.diff(starts)) == 0


@pytest.mark.parametrize("chosen", [[1, 1, 1, 1, 1], [0, 1, 1, 0, 1], [1, 0, 0, 1, 0]])
def test_the_equations_are_those_of_the_answers_in_the_chosen_stretches(chosen):
    """Against answers that are added up push by push."""
    own = replace(SETTINGS.formula, push_rows=2, pushes=3)
    rng, chosen, rows, B = np.random.default_rng(5), np.array(chosen, bool), 6, 3
    n = rows * len(chosen)
    psi, e = rng.normal(size=(n, 3, B)), rng.normal(size=(n, 3, 1))
    answers = answers_of(psi, e, np.zeros((n, 3, 0)), chosen, own)
    shaped, plain = rng.normal(size=(len(chosen), B, 2, 4)), rng.normal(size=(len(chosen), B, 1))
    read = answers.stretches
    s, G = answers.equations(Columns(*(one[read].astype(np.float32) for one in (shaped, plain))))
    for k in range(4):
        pushed = np.concatenate([shaped[:, :, :, k], plain], axis=2)
        effect = np.zeros((n, 3, 3))
        for row in range(n):
            stretch, push = row // rows, row % rows // own.push_rows
            for b in range(B):
                source = stretch if b <= push else stretch - 1
                if source >= 0:
                    effect[row] += psi[row, :, b, None] * pushed[source, b]
        seen = np.repeat(chosen, rows)
        np.testing.assert_allclose(G[k], np.einsum("nia,nib->ab", effect[seen], effect[seen]), rtol=1e-4)
        np.testing.assert_allclose(
            s[k], np.einsum("nia,niq->aq", effect[seen], e[seen]), rtol=1e-3, atol=1e-4
        )

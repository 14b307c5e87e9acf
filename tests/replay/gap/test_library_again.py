"""A formula of library effects' own terms: the library is asked again, and held against the base's misfit."""

import importlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize
from tests.replay.gap.plain_loop import BASE, made_log, problem_of

from wmr_replay.gap import GapOptions
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.gates import too_small
from wmr_replay.gap.formula.groups import PRODUCT, Group
from wmr_replay.gap.formula.library_again import effects_meant, library_again, why_not_named
from wmr_replay.gap.formula.proven import Proven
from wmr_replay.gap.formula.rests import shares_of, units_of
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.dynamics import N_STATE, Row, V, W, step
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.sentence import sentence_of
from wmr_replay.gap.result.verdict import forms_note
from wmr_replay.gap.settings.result import ReportSettings
from wmr_schemas.terms import parse_term

OPTIONS = GapOptions(modes="given")
DRAG_PER_S = 0.1


def formula_of(problem, base, *products):
    """A formula of terms ahead, fitted on top of a base model."""
    groups = tuple(Group(PRODUCT, (parse_term(f"unnamed:longitudinal:{one}"),)) for one in products)
    extension = base.extension
    for group in groups:
        extension = extension.with_effect(*group.names, {"coefficient": -DRAG_PER_S})
    return Formula(base, fit_model(problem, extension, base.noise), groups)


@pytest.fixture(scope="module")
def dragged():
    """The problem of a log with a hidden drag, its base fit, and the drag as a formula."""
    problem = problem_of(made_log(1, drag_per_s=DRAG_PER_S))
    base = fit_model(problem, Extension(BASE))
    return problem, base, formula_of(problem, base, "v")


def test_a_formula_of_a_drags_own_term_is_named_by_the_library(dragged):
    problem, base, formula = dragged
    asked, selection = library_again(Proven(problem, base, formula, None), OPTIONS)
    assert asked.train.all()
    assert [effect.name for effect in selection.found] == ["viscous_drag"]
    assert selection.found[0].fit.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(
        DRAG_PER_S, rel=0.1
    )


def test_effects_that_promise_nothing_are_not_asked_for(dragged, monkeypatch):
    problem, base, formula = dragged
    found = Proven(problem, base, formula, None)
    module = importlib.import_module("wmr_replay.gap.formula.library_again")
    monkeypatch.setattr(module, "scan", lambda *_: SimpleNamespace(scored=()))
    asked, selection = library_again(found, OPTIONS)
    assert asked.train.all()
    assert selection.found == ()
    assert why_not_named(found, selection) == (("viscous_drag", "others explain more"),)


def test_what_a_gate_refuses_is_not_named_and_the_sentence_says_the_gate(dragged):
    problem, base, formula = dragged
    refusing = replace(OPTIONS, tolerance_m=1e3)
    found = Proven(problem, base, formula, None)
    _, selection = library_again(found, refusing)
    assert not selection.found
    reasons = why_not_named(found, selection)
    assert reasons == (("viscous_drag", "moves the path by less than the tolerance"),)
    notes = forms_note(replace(selection, not_named=reasons))
    said = sentence_of("unnamed", (), notes, ReportSettings())
    assert "viscous_drag" in said
    assert "moves the path by less than the tolerance" in said


def test_a_term_that_no_effect_has_means_none(dragged):
    problem, base, _ = dragged
    names = ("unnamed:longitudinal:v*t", "unnamed:yaw:v*yaw_rate", "unnamed:longitudinal:cos(yaw)")
    formula = SimpleNamespace(names=names)
    assert {*effects_meant(Proven(problem, base, formula, None))} == {"com_offset", "slope"}


@pytest.mark.parametrize("length", [0.5, 3.0])
def test_shares_come_as_near_as_one_misfit_allows(length):
    """Against a general solver."""
    rng = np.random.default_rng(7)
    columns = rng.normal(size=(200, 4)) * [1.0, 0.3, 2.0, 0.1]
    value = columns @ (length * np.array([0.5, -0.5, 0.5, 0.5])) + 0.1 * rng.normal(size=200)
    inside = {"type": "ineq", "fun": lambda z: 1.0 - z @ z}
    oracle = minimize(
        lambda z: float(np.sum((value - columns @ z) ** 2)), np.zeros(4), constraints=[inside], tol=1e-12
    )
    assert shares_of(columns, value) == pytest.approx(oracle.x, abs=2e-3)


@pytest.mark.parametrize(("drag_per_s", "why"), [(0.1, "no more than the base model leaves"), (0.4, "")])
def test_a_formula_within_the_misfit_is_no_finding(dragged, drag_per_s, why):
    problem, base, formula = dragged
    calibrated = replace(base, extension=replace(base.extension, misfit={"viscous_drag": 0.15}))
    (name,) = formula.names
    fit = replace(formula.fit, extension=base.extension.with_effect(name, {"coefficient": -drag_per_s}))
    assert too_small(problem, replace(formula, fit=fit, rest=calibrated)) == why
    assert too_small(problem, replace(formula, fit=fit)) == ""


@pytest.mark.parametrize("name", ["viscous_drag", "yaw_damping", "torque_imbalance", "wheel_viscous"])
def test_units_are_the_accelerations_of_the_filters_model(dragged, name):
    """Against the change of the next state by a small size, speeds as they are on the row."""
    problem = dragged[0]
    extension, size = Extension(BASE, wheel_radius_m=0.1), 1e-4
    columns, k = columns_of(problem.binned), 400
    (parameter,) = {
        "viscous_drag": ["c1_per_s"],
        "yaw_damping": ["d1_per_s"],
        "torque_imbalance": ["ratio"],
        "wheel_viscous": ["nm_per_radps"],
    }[name]
    moved = [
        next_speeds(one, problem, columns, k)
        for one in (extension, extension.with_effect(name, {parameter: size}))
    ]
    change = np.abs(moved[1] - moved[0]) / size
    units = {on: abs(unit[k]) for one, on, unit in units_of(extension, problem.binned) if one == name}
    expected = [units.get("longitudinal", 0.0), units.get("yaw", 0.0)]
    assert change == pytest.approx(expected, rel=0.05, abs=1e-4)


def next_speeds(extension, problem, columns, k):
    """Accelerations ahead and in turning over a step from the speeds on row ``k``."""
    rows, state, out = extension.rows(problem.binned), np.zeros(N_STATE), np.zeros(N_STATE)
    state[V], state[W] = columns["v"][k], BASE.half_track_m * columns["yaw_rate"][k]
    state[2] = columns["yaw"][k]
    step(state, rows[k], extension.theta(), extension.base, out)
    return np.array([out[V] - state[V], out[W] - state[W]]) / rows[k][Row.DT]

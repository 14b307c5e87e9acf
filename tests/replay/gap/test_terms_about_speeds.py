"""A term acts on the speeds of the model, by its slope about the measured ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, NOISE, made_log, problem_of, with_drag

from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.dynamics import N_STATE, Row, V, W, step
from wmr_replay.gap.model.extension import Extension, term_about_speeds
from wmr_schemas.effects import EffectDeclaration, OwnEffect, Parameter, own
from wmr_schemas.modes import ContactMode
from wmr_schemas.terms import parse_term

HALF_TRACK_M = BASE.half_track_m
TWINS = {
    "viscous_drag": ({"c1_per_s": 0.3}, "unnamed:longitudinal:v", -0.3),
    "yaw_damping": ({"d1_per_s": 1.2}, "unnamed:yaw:yaw_rate", -1.2 * HALF_TRACK_M),
}


@pytest.mark.parametrize("name", TWINS)
def test_a_linear_term_is_the_library_s_effect(name):
    parameters, term, coefficient = TWINS[name]
    problem = problem_of(made_log(3))
    named = evaluate(problem, Extension(BASE, {name: parameters}), NOISE)
    unnamed = evaluate(problem, Extension(BASE, {term: {"coefficient": coefficient}}), NOISE)
    assert unnamed.deviance == pytest.approx(named.deviance, rel=1e-9)
    assert np.max(np.abs(unnamed.innovations - named.innovations)) < 1e-6


class OwnDrag(OwnEffect):
    """A user's drag of the catalogue's own form."""

    declaration = EffectDeclaration(
        "own_drag", "longitudinal", "−c·v", {"c_per_s": Parameter("1/s", 1e-4)}, acts_on="acceleration"
    )

    def acceleration(self, at, values):
        """−c·v."""
        return -values["c_per_s"] * at["v_mps"]


@pytest.fixture
def installed(monkeypatch):
    """A package that brings the drag."""
    entry = SimpleNamespace(name="own_drag", value="own_drag", module="none", load=lambda: OwnDrag)
    monkeypatch.setattr(own, "entry_points", lambda group: [entry])
    monkeypatch.setattr(own, "register_sources", lambda package: None)
    own.own_effects.cache_clear()
    yield
    own.own_effects.cache_clear()


@pytest.mark.usefixtures("installed")
def test_a_users_drag_is_that_of_the_library():
    problem = problem_of(made_log(3))
    named = evaluate(problem, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.3}}), NOISE)
    base = evaluate(problem, Extension(BASE), NOISE)
    users = evaluate(problem, Extension(BASE, {"own_drag": {"c_per_s": 0.3}}), NOISE)
    assert np.max(np.abs(users.innovations - named.innovations)) < 1e-6
    assert np.max(np.abs(users.innovations - base.innovations)) > 0.1


def test_its_size_is_that_of_the_drag():
    """Measured speeds have noise, so what reads them alone is found too small."""
    problem, _, with_it = with_drag()
    term = "unnamed:longitudinal:v"
    fit = fit_model(problem, Extension(BASE, {term: {"coefficient": 0.0}}))
    found = with_it.extension.effects["viscous_drag"]["c1_per_s"]
    assert fit.extension.effects[term]["coefficient"] == pytest.approx(-found, rel=0.02)


@pytest.mark.parametrize("product", ["v*abs(v)", "effort_diff*abs(v)", "v*yaw_rate", "sin(0.5x)*sgn(v)", "t"])
def test_about_the_measured_speeds_it_is_what_it_was(product):
    problem = problem_of(made_log(4))
    term, columns = parse_term(f"unnamed:yaw:{product}"), columns_of(problem.binned)
    constant, by_v, by_w = term_about_speeds(term, problem.binned, HALF_TRACK_M).T
    here = constant + by_v * columns["v"] + by_w * HALF_TRACK_M * columns["yaw_rate"]
    np.testing.assert_allclose(here, term.evaluate(columns), rtol=1e-9, atol=1e-12)
    for name, slope in (("v", by_v), ("yaw_rate", by_w * HALF_TRACK_M)):
        ends = [term.evaluate({**columns, name: columns[name] + change}) for change in (-1e-6, 1e-6)]
        steep = np.abs(columns["v"]) < 0.2  # where a sign changes, the slope is that of a chord
        np.testing.assert_allclose(slope[~steep], ((ends[1] - ends[0]) / 2e-6)[~steep], rtol=1e-3, atol=1e-3)


def test_slipping_wheels_pass_on_a_share_of_its_slope():
    problem = problem_of(made_log(4))
    extension = Extension(BASE, {"unnamed:longitudinal:effort_sum*abs(v)": {"coefficient": 0.1}})
    grips, slips = (
        extension.rows(problem.binned, np.full(len(problem.binned), float(mode)))
        for mode in (ContactMode.IDEAL, ContactMode.SLIPPING)
    )
    for column in (Row.EXTRA_LONG, Row.LONG_BY_V):
        np.testing.assert_allclose(slips[:, column], BASE.slip_share * grips[:, column])
    assert np.ptp(grips[:, Row.LONG_BY_V]) > 0


def test_a_step_has_the_slopes_in_its_row():
    theta, row, z = (
        Extension(BASE, {"unnamed:yaw:1": {"coefficient": 0.0}}).theta(),
        np.zeros(len(Row)),
        np.zeros(N_STATE),
    )
    row[[Row.DT, Row.LONG_BY_V, Row.YAW_BY_V, Row.YAW_BY_W]] = 0.01, -0.5, 0.2, -2.0
    z[V], z[W], moved = 1.0, 0.3, np.zeros(N_STATE)
    step(z, row, theta, BASE, moved)
    assert moved[V] == pytest.approx(1.0 - 0.005, abs=2e-5)
    assert moved[W] == pytest.approx(0.3 + 0.01 * (0.2 - 0.6), abs=5e-5)

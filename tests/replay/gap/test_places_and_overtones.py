"""Flat places, harmonics of waves that are found, and formulas beside a library that is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import SETTINGS, made_log, problem_of

from wmr_replay.gap.formula import answers, other_modes, search
from wmr_replay.gap.formula.families import Family, values
from wmr_replay.gap.formula.grids import swings_of
from wmr_replay.gap.formula.groups import PRODUCT, Group, Tried, groups_of
from wmr_replay.gap.formula.shapes import allowed
from wmr_replay.gap.formula.winners import rivals_of
from wmr_schemas.terms import parse_term


def group(family: Family, *shape: float) -> Group:
    """A group of a family."""
    return Group(family, family.terms(shape), shape)


def test_a_disc_s_text_says_what_is_screened():
    rng = np.random.default_rng(3)
    columns = {"x": rng.uniform(-4, 4, 80), "y": rng.uniform(-4, 4, 80), "effort_sum": rng.normal(size=80)}
    family = Family("disc", carriers=(("effort_sum",),))
    (term,) = family.terms((0.5, -1.0, 2.0))
    apart = np.hypot(columns["x"] - 0.5, columns["y"] + 1.0) / 2
    screened = values(family, np.array([(0.5, -1.0, 2.0)]), columns)[:, 0, 0]
    np.testing.assert_allclose(screened, 1 / (1 + apart**8))
    np.testing.assert_allclose(term.evaluate(columns), screened * columns["effort_sum"])
    assert np.all(screened[apart < 0.7] > 0.94)
    assert np.all(screened[apart > 1.4] < 0.07)


@pytest.mark.parametrize(
    ("channel", "carriers"),
    [
        ("longitudinal", {("effort_sum",), ("v",), ("soft(v,0.08)",)}),
        ("yaw", {("effort_diff",), ("yaw_rate",), ("soft(yaw_rate,0.08)",)}),
    ],
)
def test_discs_carry_traction_and_frictions(channel, carriers):
    log = made_log(2)
    tried = groups_of(problem_of(log).binned, SETTINGS.formula)
    discs = [g.first for g in tried.grids if g.first.kind == "disc" and g.first.channel == channel]
    assert discs
    assert carriers <= {carrier for family in discs for carrier in family.carriers}


def test_harmonics_of_a_wave_are_tried_with_its_carriers_and_without_its_constant():
    wave = group(Family("wave", along="xy", carriers=(("cos(yaw)",), ("sin(yaw)",)), plain=True), 0.4, -0.3)
    tried = Tried(()).with_overtones((wave,), SETTINGS.formula)
    assert [one.shape for one in tried.groups] == [(0.8, -0.6), pytest.approx((1.2, -0.9))]
    assert {term.factors for term in tried.groups[0].terms} == {
        (f"{of}(0.8x-0.6y)", carrier) for of in ("sin", "cos") for carrier in ("cos(yaw)", "sin(yaw)")
    }


@pytest.mark.parametrize("kind", ["product", "heading"])
def test_what_is_no_wave_over_place_or_time_has_no_harmonics(kind):
    product = Group(PRODUCT, (parse_term("unnamed:longitudinal:v*abs(v)"),))
    other = {"product": product, "heading": group(Family("wave", along="yaw"), 2.0)}[kind]
    assert Tried((product,)).with_overtones((other,), SETTINGS.formula).groups == (product,)


@pytest.mark.parametrize(
    ("term", "gained", "vetoed"),
    [
        ("longitudinal:effort_sum*abs(v)", 60.0, False),
        ("longitudinal:effort_sum*abs(v)", 1.0, True),
        ("yaw:effort_sum", -5.0, False),
        ("longitudinal:v*abs(v)", -5.0, False),
    ],
)
def test_beside_a_refused_library_only_answers_have_to_show_in_manoeuvres(monkeypatch, term, gained, vetoed):
    """What turns a robot by the torques ahead answers nothing."""
    one = Group(PRODUCT, (parse_term(f"unnamed:{term}"),))
    problem = problem_of(made_log(1))
    before, after = SimpleNamespace(deviance=900.0), SimpleNamespace(deviance=0.0)
    found = SimpleNamespace(problem=problem, base=before, formula=SimpleNamespace(groups=(one,), fit=after))
    monkeypatch.setattr(answers, "manoeuvres", lambda problem, *_: problem.train)
    monkeypatch.setattr(answers, "gain_in_manoeuvres", lambda _before, _after: gained)
    assert answers.may_only_answer(found) is vetoed


@pytest.mark.parametrize(("again", "taken"), [(10.0, "again"), (90.0, "start")])
def test_a_formula_keeps_the_likelier_of_the_modes_that_it_begins_with_and_those_seen_with_it(
    monkeypatch, again, taken
):
    start, seen = (
        SimpleNamespace(cost=cost, problem=SimpleNamespace(name=name, settings=SETTINGS))
        for cost, name in ((50.0, "start"), (again, "again"))
    )
    monkeypatch.setattr(other_modes, "once_more", lambda *_: seen)
    monkeypatch.setattr(other_modes, "whole_cost", lambda one: one.cost)

    def fitted(problem, *_):
        raise RuntimeError(problem.name)

    monkeypatch.setattr(other_modes, "fit_model", fitted)
    with pytest.raises(RuntimeError, match=taken):
        other_modes.proven_with(None, start, None, None)


@pytest.mark.parametrize(
    ("gained", "unseen", "own", "takes"),
    [
        (100.0, 10.0, True, True),
        (100.0, -40.0, True, True),
        (100.0, -60.0, True, False),
        (60.0, -35.0, True, False),
        (35.0, 5.0, True, False),
        (35.0, 5.0, False, True),
        (20.0, 5.0, False, False),
    ],
)
def test_held_out_rows_may_lose_half_of_what_the_fitted_ones_gain(monkeypatch, gained, unseen, own, takes):
    """In the place of a named effect that gained 300: at least 45 units more in all, and no overfit; 30 where
    it reads something else than the effect does, and so is not its right form.
    """
    named = SimpleNamespace(name="payload", scored=None)
    fit = SimpleNamespace(deviance=-300.0, extension=SimpleNamespace(effects={}), keys=[("payload", "m")])
    selection = SimpleNamespace(found=(named,), fit=fit, base=SimpleNamespace(deviance=0.0))
    formula = SimpleNamespace(
        fit=SimpleNamespace(deviance=-300.0 - gained),
        rest=SimpleNamespace(extension=SimpleNamespace(effects={})),
        names=("unnamed:longitudinal:effort_sum*abs(v)",),
        price=lambda _problem: 0.0,
    )
    problem = SimpleNamespace(settings=SETTINGS)
    stubs = {
        "is_the_same": False,
        "keeps_its_effects": True,
        "gain_in_manoeuvres": 50.0,
        "asked_of_answers": 40.0,
        "price_of": 0.0,
        "library_price": 0.0,
        "library_of": (named,),
        "n_numbers": 9,
        "is_of_their_quantities": own,
    }
    for name, value in stubs.items():
        monkeypatch.setattr(search, name, lambda *_, value=value: value)
    monkeypatch.setattr(search, "unseen_between", lambda *_: unseen)
    assert search.explains_more(problem, selection, formula) is takes


def test_what_a_named_effect_shows_in_manoeuvres_its_better_form_need_not_show_again(monkeypatch):
    """All rows are manoeuvres, so that the whole price is asked for."""
    monkeypatch.setattr(answers, "manoeuvres", lambda problem, *_: problem.train)
    one = Group(PRODUCT, (parse_term("unnamed:yaw:disc(1,2,3)*effort_diff"),))
    other = Group(PRODUCT, (parse_term("unnamed:longitudinal:effort_sum*abs(v)"),))
    problem = problem_of(made_log(1))
    before, after = SimpleNamespace(deviance=900.0), SimpleNamespace(deviance=0.0)
    formula = SimpleNamespace(groups=(one, other), fit=after)
    whole = answers.asked_of_answers(problem, before, formula)
    assert whole == pytest.approx(answers.asked_of_answers(problem, before, formula, {"both"}))
    in_yaw = answers.asked_of_answers(problem, before, formula, {"longitudinal"})
    ahead = answers.asked_of_answers(problem, before, formula, {"yaw"})
    assert in_yaw > 0 < ahead
    assert whole == pytest.approx(in_yaw + ahead)
    assert answers.asked_of_answers(problem, before, formula, {"yaw", "longitudinal"}) == 0


def test_what_winds_up_with_all_turns_is_tried_and_is_no_rival_of_a_wave_over_the_heading():
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    turned = [g.first for g in tried.grids if g.first.kind == "edge" and g.first.along == "yaw"]
    assert {(family.channel, family.carriers) for family in turned} >= {
        ("yaw", ((),)),
        ("longitudinal", ((),)),
    }
    wave = group(Family("wave", "yaw", "yaw"), 1.0)
    assert rivals_of(group(turned[0], 0.5, 1.0)) != rivals_of(wave)


def test_pulses_carry_drags_and_no_efforts():
    tried = groups_of(problem_of(made_log(30)).binned, SETTINGS.formula)
    carriers = {
        factor
        for grid in tried.grids
        for family, _ in grid.pieces
        if family.kind == "pulse"
        for carrier in family.carriers
        for factor in carrier
    }
    assert {"v", "yaw_rate"} <= carriers
    assert not any("effort" in factor for factor in carriers)


def test_what_swings_quickly_is_a_function_of_the_time_alone():
    """A hung load goes on in step for the whole log; quick changes of a gain are the disturbance's."""
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    waves = [grid for grid in tried.grids if grid.first.kind == "wave" and grid.first.along == "t"]
    shortest_s = {True: [], False: []}
    for grid in waves:
        numbers = np.concatenate([numbers for _, numbers in grid.pieces])
        alone = grid.first.carriers == ((),)
        shortest_s[alone].append(2 * np.pi / numbers.max())
    assert len(shortest_s[True]) == 2
    assert shortest_s[True] == pytest.approx([SETTINGS.formula.least_swing_s] * 2, rel=0.01)
    assert shortest_s[False] == pytest.approx(
        [SETTINGS.formula.least_period_s] * len(shortest_s[False]), rel=0.01
    )


@pytest.mark.parametrize("span_s", [40.0, 90.0])
def test_quick_swings_leave_no_gap_between_their_octaves(span_s):
    """Neighbours differ by no more than half a turn over the log."""
    own = SETTINGS.formula
    numbers = np.sort(np.concatenate([*swings_of(span_s, own)]).ravel())
    assert numbers[0] == pytest.approx(2 * np.pi / own.least_period_s)
    assert numbers[-1] == pytest.approx(2 * np.pi / own.least_swing_s)
    assert np.diff(numbers).max() <= np.pi / span_s * 1.05


@pytest.mark.parametrize(("carriers", "shortest_s"), [(((),), 0.8), ((("v",),), 4.0)])
def test_a_wave_s_number_moves_as_far_as_its_grid_goes(carriers, shortest_s):
    wave = group(Family("wave", "longitudinal", "t", carriers=carriers), 2.2)
    moved = allowed(wave, np.array([9.0]), problem_of(made_log(2)))
    assert moved == pytest.approx([2 * np.pi / shortest_s])

"""The gap benchmark: its cases, its scores, and the error of the true model."""

import importlib
from pathlib import Path

import numpy as np
import pytest

BENCH = Path(__file__).parents[3] / "bench"


@pytest.fixture(scope="module")
def bench():
    """``bench(name)``: a module of bench/."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        yield importlib.import_module


def row(hidden, *named, verdict="named", alternatives=None):
    effects = [
        {"name": name, "class": [name], "alternatives": alternatives or {}, "parameters": {}}
        for name in named
    ]
    return {
        "set": "single",
        "noise": "rtk",
        "verdict": verdict if named else "nothing_missing",
        "hidden": [{"name": name, "parameters": {}} for name in hidden],
        "effects": effects,
    }


def test_every_set_is_as_large_as_asked_and_no_log_comes_twice(bench):
    cases = bench("gap_cases")
    n = {s.name: len(list(cases.cases_of(s, 500_000))) for s in cases.SETS}
    assert min(n["single"], n["single-identified"]) >= 240
    assert n["pair"] >= 120
    assert n["nothing"] + n["nothing-identified"] >= 1000
    assert sum(n[name] for name in n if name.startswith(("cruise", "strong"))) >= 300
    for case_set in cases.SETS:
        seeds = [case.seed for case in cases.cases_of(case_set, 500_000)]
        assert len(set(seeds)) == len(seeds)
        assert {case.noise for case in cases.cases_of(case_set, 0)} == {"mocap", "rtk", "poor"}
    given, identified = (list(cases.cases_of(s, 500_000)) for s in cases.SETS[:2])
    assert [case.seed for case in given] == [case.seed for case in identified]


def test_a_name_too_many_a_name_too_few_and_a_wrong_one_are_told_apart(bench):
    score = bench("gap_scores").score
    right, more, wrong, none = (
        score(row(["slope"], *named)) for named in (["slope"], ["slope", "payload"], ["payload"], [])
    )
    assert (right.first, right.exact, right.false) == (True, True, ())
    assert (more.first, more.exact, more.false) == (True, False, ("payload",))
    assert (wrong.first, wrong.exact, wrong.false) == (False, False, ("payload",))
    assert (none.first, none.exact, none.false, none.claims) == (False, False, (), False)
    assert score(row([])).exact
    assert score(row([], "slope")).false == ("slope",)


@pytest.mark.parametrize(("delta", "holds"), [(2.0, True), (40.0, False)])
def test_close_alternatives_count_for_themselves_only(bench, delta, holds):
    found = bench("gap_scores").score(
        row(["input_delay"], "actuator_lag", verdict="ambiguous", alternatives={"input_delay": delta})
    )
    assert not found.first
    assert not found.exact
    assert found.first_among is found.exact_among is holds
    assert bool(found.false) is not holds


def test_of_a_plane_any_two_stand_for_any_other_two(bench):
    score = bench("gap_scores").score
    assert score(row(["payload", "drive_gain"], "yaw_inertia", "payload")).exact
    assert not score(row(["payload", "drive_gain"], "yaw_inertia")).exact
    assert not score(row(["payload", "slope"], "yaw_inertia", "slope")).exact


@pytest.mark.parametrize("hide", ["actuator_lag", "undeclared_skid", "low_friction_patch", "pose_lever_arm"])
def test_the_true_model_without_a_disturbance_leaves_the_noise_alone(bench, hide):
    cases, truth = bench("gap_cases"), bench("gap_truth")
    quiet = cases.CaseSet("quiet", 0, ((hide,),), 1, disturbance=cases.Disturbance())
    simulated = cases.Case(quiet, 0, (hide,), "mocap", 60_001).simulated()
    starts = (20.0, 44.0, 68.0)
    errors = truth.true_errors(simulated, [(start - 0.005, start + 3.955) for start in starts], 0.04)
    floor = np.array([np.sqrt(2) * 0.001 / 2, 0.002 / 2])
    np.testing.assert_allclose(np.sqrt(np.mean(errors**2, axis=0)), floor, rtol=0.12)


def test_the_page_is_filled_from_rows_and_keeps_its_text(bench):
    report, scores = bench("gap_report"), bench("gap_scores")
    page = "before\n<!-- figures failures -->\nold\n<!-- end failures -->\nafter\n"
    wrong = {**row(["slope"], "payload"), "seed": 7, "key": "k"}
    filled = report.filled(page, [scores.score(wrong)], [])
    assert filled.startswith("before\n")
    assert filled.endswith("after\n")
    assert "| single | slope | rtk | 7 | named | payload |\n" in filled
    assert "old" not in filled


@pytest.mark.parametrize("modes", ["given", "identified"])
def test_a_row_holds_the_true_models_error_over_the_windows_of_the_result(bench, modes):
    cases, rows = bench("gap_cases"), bench("gap_rows")
    case_set = cases.CaseSet("any", 0, (("viscous_drag",),), 1, modes=modes)
    case = next(iter(cases.cases_of(case_set, 91_000)))
    row = rows.row_of(rows.Task(case, "state"))
    assert [effect["name"] for effect in row["effects"]] == ["viscous_drag"]
    position = row["position"]
    assert position["floor"] < position["true"] < 1.2 * position["after"] < position["before"]

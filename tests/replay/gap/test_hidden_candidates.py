"""Candidates that another one hid: of the other channel, and behind one that a gate refuses."""

from types import SimpleNamespace

import pytest
from tests.replay.gap.plain_loop import BASE, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search import fit_candidates, modes_and_effects, select
from wmr_replay.gap.search.eliminate import REST
from wmr_replay.gap.search.rests import is_behind_a_rest
from wmr_replay.gap.settings import GateSettings

DRAG_PER_S = 0.1


@pytest.fixture(scope="module")
def two():
    """A log with a drag, its base model, and two candidates fitted: the drag, and a better one in turning."""
    problem = problem_of(made_log(1, drag_per_s=DRAG_PER_S))
    base = fit_model(problem, Extension(BASE))
    drag = ScoredCandidate("viscous_drag", {"c1_per_s": DRAG_PER_S}, 50.0, 1)
    fit = fit_model(problem, base.extension.with_effect(drag.name, drag.parameters), base.noise)
    inertia = ScoredCandidate("yaw_inertia", {"ratio": 0.01}, 60.0, 1)
    other = fit_model(problem, base.extension.with_effect(inertia.name, inertia.parameters), base.noise)
    better = SimpleNamespace(**{**vars(other), "deviance": fit.deviance - 20.0, "noise": other.noise})
    return problem, base, (drag, fit), (inertia, better)


def test_the_candidates_that_are_worth_their_price_stay(two):
    problem, base, drag, inertia = two
    lost = SimpleNamespace(deviance=base.deviance + 5.0, extension=drag[1].extension)
    kept = fit_candidates.explaining(problem, base, [drag, (drag[0], lost)])
    assert [one.name for one in kept] == ["viscous_drag"]
    assert inertia[1].deviance < drag[1].deviance


def test_a_drag_is_a_candidate_beside_one_of_turning_that_is_tried_first(two, monkeypatch):
    problem, base, drag, _ = two
    calls = [drag[0], ScoredCandidate("yaw_damping", {"d1_per_s": 0.01}, 60.0, 1)]
    fits = {
        one.name: fit_model(problem, base.extension.with_effect(one.name, one.parameters), base.noise)
        for one in calls
    }
    monkeypatch.setattr(
        fit_candidates, "best_fitted", lambda *_, **__: [(one, fits[one.name]) for one in calls]
    )
    monkeypatch.setattr(fit_candidates, "rank_at", lambda *_, **__: calls[1:])
    stage = fit_candidates.ranked_and_fitted(problem, base, terms=False)
    assert "viscous_drag" in [one.name for one in stage]
    found = next(one for one in stage if one.name == "viscous_drag")
    assert found.fit.deviance <= fits["viscous_drag"].deviance + 1e-9
    assert found.fit.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(DRAG_PER_S, rel=0.1)


def solution(problem, *, dropped, stage, found=()):
    """A solution of a selection."""
    fit = SimpleNamespace(problem=problem)
    selection = SimpleNamespace(dropped=dropped, stages=(stage,), found=found, fit=fit)
    return modes_and_effects.Solution(problem, selection, Extension(BASE))


def candidate(name, p_value=0.0, score=20.0, failed=""):
    """A fitted candidate, as far as it is looked at."""
    return SimpleNamespace(name=name, p_value=p_value, score=score, failed=failed)


@pytest.mark.parametrize(
    ("second", "again", "names"),
    [
        (candidate("torque_bias_differential"), ("torque_bias_differential",), ["torque_bias_differential"]),
        (candidate("torque_bias_differential", 0.5), ("torque_bias_differential",), []),
        (candidate("torque_bias_differential"), (), []),
        (candidate("cornering_stiffness"), ("cornering_stiffness",), []),
        (candidate("slip_interval"), ("slip_interval",), []),
    ],
)
def test_behind_what_a_gate_refuses_something_else_is_looked_for(two, monkeypatch, second, again, names):
    problem, first = two[0], candidate("torque_saturation")
    asked = []

    class Made:
        options = None

        def of(self, _problem, *, without):
            asked.append(without)
            return SimpleNamespace(found=tuple(map(candidate, again)))

    monkeypatch.setattr(modes_and_effects, "confirm", lambda _problem, selection, _options: selection)
    begun = solution(problem, dropped=(first,), stage=(first, second))
    found = modes_and_effects.without_dropped(begun, Made())
    assert [effect.name for one in found for effect in one.selection.found] == names
    assert asked in ([], [("torque_saturation",)])
    assert modes_and_effects.without_dropped(solution(problem, dropped=(), stage=(second,)), Made()) == []


@pytest.mark.parametrize(
    ("failed", "score", "behind"),
    [(REST, 310.0, True), (REST, 290.0, False), ("needless beside the others", 310.0, False)],
)
def test_less_of_what_the_base_may_leave_is_not_named_in_another_form(failed, score, behind):
    damping = candidate("yaw_damping", score=score, failed=failed)
    dropped = SimpleNamespace(dropped=(candidate("viscous_drag", failed="small"), damping))
    settings = SimpleNamespace(problem=SimpleNamespace(settings=GateSettings()))
    scrub = SimpleNamespace(found=(candidate("scrub_torque", score=150.0),), fit=settings)
    assert is_behind_a_rest(scrub, dropped) is behind
    assert not is_behind_a_rest(scrub, SimpleNamespace(dropped=()))


@pytest.mark.parametrize(
    ("behind", "spent"),
    [(("actuator_lag",), ()), (("actuator_lag", "viscous_drag"), ("input_delay", "actuator_lag"))],
)
def test_a_lag_is_not_found_behind_a_delay_that_a_gate_refuses(two, behind, spent):
    stage = tuple(map(candidate, ("input_delay", *behind)))
    begun = solution(two[0], dropped=(candidate("input_delay"),), stage=stage)
    assert {*modes_and_effects.hiding(begun.selection)} == {*spent}


@pytest.mark.parametrize(
    ("name", "parameters", "best", "best_parameters", "its_own"),
    [
        ("viscous_drag", {"c1_per_s": DRAG_PER_S}, "yaw_damping", {"d1_per_s": 0.01}, True),
        ("rolling_resistance", {"c0_mps2": 0.03}, "viscous_drag", {"c1_per_s": DRAG_PER_S}, False),
    ],
)
def test_less_of_what_another_one_explains_is_no_reason_to_name_it(
    two, name, parameters, best, best_parameters, its_own
):
    problem, base, *_ = two

    def fitted(one, sizes, score):
        fit = fit_model(problem, base.extension.with_effect(one, sizes), base.noise)
        scored = ScoredCandidate(one, sizes, 0.0, 1)
        return SimpleNamespace(name=one, scored=scored, fit=fit, score=score, failed="")

    first, other = fitted(name, parameters, 50.0), fitted(best, best_parameters, 100.0)
    assert select.explains_its_own(problem, first, other) is its_own
    assert select.explains_its_own(problem, first, first)
    other.score = 55.0
    assert select.explains_its_own(problem, first, other)
    other.score, other.failed = 100.0, "no more than an answer to the disturbance makes"
    assert select.explains_its_own(problem, first, other)


def test_without_a_candidate_none_is_fitted():
    """A calibration looks for a lag and a delay alone at its end, and gates may rule out both."""
    problem = problem_of(made_log(1))
    current = fit_model(problem, Extension(BASE))
    assert fit_candidates.fit_candidates(problem, current, terms=False, without=select.all_but(())) == ()
    alone = fit_candidates.ranked_and_fitted(
        problem, current, terms=False, without=select.all_but(select.LATE)
    )
    assert {one.name for one in alone} <= {*select.LATE}

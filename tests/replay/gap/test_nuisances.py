"""What hides an effect and is none: efforts that answer the disturbance, a size that may be 0, slipping that
was missed.
"""

from importlib import import_module
from types import SimpleNamespace

import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.search.labellings import more_slip
from wmr_replay.gap.search.select import Selection, confirm

SELECT = import_module("wmr_replay.gap.search.select")
LABELLINGS = import_module("wmr_replay.gap.search.labellings")
HIDING = {"torque_deadzone", "pose_lever_arm"}


@pytest.fixture
def gates(monkeypatch):
    """Gates at which a dead zone is too calm, a lever arm may be none, and a load step is proven only without
    these.
    """
    proven = {"load_step"}

    def eliminate(problem, base, current, found, options, dropped):
        names = {f.name for f in found}
        return current, [f for f in found if f.name not in proven or not names & HIDING]

    monkeypatch.setattr(SELECT, "exchange_rivals", lambda problem, fit, found, stages: (fit, found))
    monkeypatch.setattr(SELECT, "eliminate", eliminate)
    monkeypatch.setattr(SELECT, "fit_without", lambda problem, base, current, name: f"{current} − {name}")
    calm = {"torque_deadzone": "only answers the disturbance"}
    monkeypatch.setattr(SELECT, "too_calm_for", lambda name, problem, fit: calm.get(name, ""))
    monkeypatch.setattr(SELECT, "is_sideways_one_way", lambda name, problem, fit: "")
    monkeypatch.setattr(SELECT, "may_be_nothing", lambda problem, fit, name: name == "pose_lever_arm")


def confirmed(*names: str) -> Selection:
    """The confirmed part of a selection of effects."""
    found = tuple(SimpleNamespace(name=name, alternatives=()) for name in names)
    return confirm(None, Selection("base", "all", found, ()), GapOptions())


@pytest.mark.usefixtures("gates")
@pytest.mark.parametrize("hiding", sorted(HIDING))
def test_an_effect_behind_one_that_may_be_none_is_tested_without_it(hiding):
    selection = confirmed(hiding, "load_step")
    assert [f.name for f in selection.found] == ["load_step"]
    assert (selection.fit, selection.refused) == (f"all − {hiding}", "")


@pytest.mark.usefixtures("gates")
def test_what_only_answers_the_disturbance_is_refused_with_the_reason():
    selection = confirmed("torque_deadzone")
    assert (selection.found, selection.fit) == ((), "base")
    assert selection.refused == "only answers the disturbance"


@pytest.mark.usefixtures("gates")
def test_what_may_be_nothing_is_refused_with_the_reason():
    selection = confirmed("pose_lever_arm")
    assert (selection.found, selection.fit) == ((), "base")
    assert "pose_lever_arm would explain part of it, but its size may be 0" in selection.refused


def test_missed_slipping_is_a_labelling_only_where_there_is_some(monkeypatch):
    seen, slipping = object(), object()
    selections = SimpleNamespace(of=lambda problem: SimpleNamespace(fit=None))
    monkeypatch.setattr(LABELLINGS, "missed_slipping", lambda problem, fit: slipping)
    (labelling,) = more_slip(seen, selections)
    assert labelling.problem is slipping
    monkeypatch.setattr(LABELLINGS, "missed_slipping", lambda problem, fit: problem)
    assert not list(more_slip(seen, selections))

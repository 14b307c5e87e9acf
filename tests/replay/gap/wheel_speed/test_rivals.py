"""Effects that a record cannot tell apart: which is said first, and which beside it."""

from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.wheel_speed import select
from wmr_replay.gap.wheel_speed.scan import Score
from wmr_schemas.effects import effects_of

PER_PARAMETER = 7.0
ORDER = ("heading_misalignment", "wheel_scale", "icr_offset", "lateral_slip", "slope_slip")


def pair(name, gain, n_parameters=1):
    """A candidate that was fitted in full, with its drop of −2 log likelihood."""
    start = {f"p{k}": 1.0 for k in range(n_parameters)}
    return Score(name, gain, start, np.eye(n_parameters)), SimpleNamespace(minus_two_log=-gain)


@pytest.fixture
def first(monkeypatch):
    """``first(pairs)``: the names in the order in which they are tried."""
    declared = effects_of("wheel_speed")
    monkeypatch.setattr(select, "price", lambda _problem, n: PER_PARAMETER * n)
    monkeypatch.setattr(select, "candidates_of", lambda _record: tuple(declared[name] for name in ORDER))
    monkeypatch.setattr(select, "same_in_any_motion", lambda _problem, name: (name,))
    problem = SimpleNamespace(record=None)
    return lambda pairs: [score.name for score, _ in select.simplest_first(problem, pairs)]


def test_of_effects_as_likely_a_length_comes_before_slip(first):
    assert first([pair("lateral_slip", 519.8), pair("icr_offset", 519.7)])[0] == "icr_offset"


def test_of_effects_as_likely_the_simpler_comes_first(first):
    names = first([pair("slope_slip", 94.6, 2), pair("heading_misalignment", 86.5)])
    assert names == ["heading_misalignment", "slope_slip"]


def test_what_is_clearly_likelier_comes_first(first):
    assert first([pair("lateral_slip", 540.0), pair("icr_offset", 519.7)])[0] == "lateral_slip"
    assert first([]) == []


def test_rivals_of_a_large_effect_are_held_against_its_score():
    """A score of 1368 where the likelihood falls by 4604: what scores as much is a rival of it."""
    scores = [pair(name, gain)[0] for name, gain in (("icr_offset", 1368.0), ("wheel_scale", 90.0))]
    own = pair("lateral_slip", 1370.0)[0]
    assert [one.name for one in select.nearly_as_good((*scores, own), "lateral_slip", 0.3)] == ["icr_offset"]

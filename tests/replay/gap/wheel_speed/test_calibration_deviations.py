"""A calibration's own deviation takes no place among the candidates that are fitted in full; what a slip
of the noise hides is looked for without it.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed import select
from wmr_replay.gap.wheel_speed.scan import Score

NAMES = (
    "effective_track",
    "pose_delay",
    "icr_offset",
    "lateral_slip",
    "wheel_scale_difference",
    "wheel_scale",
)
DEVIATIONS = NAMES[:4]


@pytest.fixture
def search(monkeypatch):
    """``search(why, hidden)``: the next effect and all tried, where the first four fail for a reason, and
    those ``hidden`` by the noise's slip have a score without it alone.
    """

    def searched(why, hidden=()):
        tried = []

        def failing(_self, _stage, _problem, _before, _after, name):
            tried.append(SimpleNamespace(name=name))
            return why if name in DEVIATIONS else ""

        def scan(_problem, fit, candidates):
            seen = [c.name for c in candidates if (c.name in hidden) == (fit == "no slip")]
            return tuple(Score(name, 100.0 - k, {"size": 1.0}, np.eye(1)) for k, name in enumerate(seen))

        monkeypatch.setattr(select, "scan", scan)
        monkeypatch.setattr(select, "without_slip", lambda *_: "no slip")
        monkeypatch.setattr(select, "price", lambda *_: 7.0)
        monkeypatch.setattr(select, "simplest_first", lambda _problem, fits: fits)
        monkeypatch.setattr(
            select, "fitted_with", lambda _p, _c, name, start, **_: SimpleNamespace(values={name: start})
        )
        monkeypatch.setattr(select.Search, "failing", failing)
        settings = GapOptions().gates.wheel_speed
        problem = SimpleNamespace(settings=settings, record=SimpleNamespace(driven_by="wheel_speed"))
        candidates = tuple(SimpleNamespace(name=name) for name in NAMES)
        following = select.Search(problem, SimpleNamespace(), candidates, tried).next_lasting(0)
        return following and following.found, tuple(one.name for one in tried)

    return searched


def test_deviations_of_the_calibration_hide_no_other_candidate(search):
    assert search("calibration") == (("wheel_scale_difference",), NAMES[:5])


def test_other_candidates_that_fail_end_the_search(search):
    assert search("significance") == (None, DEVIATIONS)


def test_what_a_slip_of_the_noise_hides_is_found_without_it(search):
    assert search("significance", ("wheel_scale",)) == (("wheel_scale",), (*DEVIATIONS, "wheel_scale"))
    assert search("significance", NAMES[3:]) == (("wheel_scale_difference",), NAMES[:5])
    assert search("significance", DEVIATIONS)[0] == ("wheel_scale_difference",)

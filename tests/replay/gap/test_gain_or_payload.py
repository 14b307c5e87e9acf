"""Of a robot whose calibration does not show how its torques turn it, a payload may be a drive gain."""

from types import SimpleNamespace

import pytest

from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.gain_or_payload import with_twin
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.settings.scan import MisfitSettings

OWN = MisfitSettings()
AHEAD = (("payload", 30.0), ("slope", 4.0))


def alternatives(name, size, misfit, **others):
    """What stands beside an effect that explains more than a payload by 30 and a slope by 4."""
    extension = Extension(SimpleNamespace(), {name: size, **others}, misfit=misfit)
    found = FittedCandidate(
        ScoredCandidate(name, size, 100.0, 1), None, 100.0, 90.0, 1e-9, alternatives=AHEAD
    )
    return with_twin(found, extension, OWN).alternatives


@pytest.mark.parametrize(
    ("name", "size", "twin"),
    [("drive_gain", {"ratio": -0.2}, "payload"), ("payload", {"mass_ratio": 0.25}, "drive_gain")],
)
def test_turning_tells_them_apart_where_it_is_known_to_the_yaw_inertia_between_them(name, size, twin):
    """A gain of .8 is a payload of .25 with .25 more yaw inertia; the payload a gain with .2 less."""
    between = {"payload": 0.25, "drive_gain": 0.2}[twin]
    assert alternatives(name, size, {"yaw_inertia": 0.99 * between}) == AHEAD
    said = alternatives(name, size, {"yaw_inertia": 1.01 * between})
    assert said[0] == (twin, 0.0)
    assert dict(said)["slope"] == 4.0


def test_a_small_one_is_told_where_turning_is_known():
    assert alternatives("drive_gain", {"ratio": -0.05}, {"yaw_inertia": 0.079}) == AHEAD
    assert alternatives("drive_gain", {"ratio": -0.05}, {}) == AHEAD
    assert alternatives("drive_gain", {"ratio": -0.05}, {"yaw_inertia": 0.081})[0] == ("payload", 0.0)


def test_both_at_once_and_other_effects_stay():
    open_to = {"yaw_inertia": 1.0}
    both = alternatives("drive_gain", {"ratio": -0.2}, open_to, payload={"mass_ratio": 0.3})
    assert both == AHEAD
    assert alternatives("viscous_drag", {"d_per_s": 0.3}, open_to) == AHEAD

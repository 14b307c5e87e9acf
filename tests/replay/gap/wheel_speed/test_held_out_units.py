"""Which units of a record say whether an effect holds on what was not fitted."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.gap.settings.wheel_speed import GateSettingsWheelSpeed
from wmr_replay.gap.wheel_speed.evidence import held_out_p, showing_units

OWN = GateSettingsWheelSpeed()
TUG = np.array([-1.4, 481.2, -2.1, -1.2, -1.6, -2.6, 123.2, 525.1, -1.7, 391.9, 12.7, -0.1])
"""Drops of the deviance by another track, where a robot tugs straight ahead and turns at times."""


def test_straight_driving_says_nothing_of_a_track() -> None:
    shown = showing_units(TUG, OWN)
    assert TUG[shown].tolist() == [481.2, 123.2, 525.1, 391.9, 12.7]


def test_by_heads_straight_driving_outvotes_the_turns() -> None:
    """Why a unit that hardly changes has no vote."""
    assert held_out_p(np.zeros(12), -TUG) > OWN.held_out_level


def test_a_unit_that_is_much_less_likely_still_counts() -> None:
    assert showing_units(np.array([100.0, -30.0, 0.9]), OWN).tolist() == [True, True, False]


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40))
def test_the_largest_change_shows_unless_it_is_noise(changes: list[float]) -> None:
    change = np.array(changes)
    shown, largest = showing_units(change, OWN), np.abs(change).argmax()
    assert shown[largest] == (abs(change[largest]) > OWN.least_unit_change)
    assert not shown[np.abs(change) <= OWN.least_unit_change].any()

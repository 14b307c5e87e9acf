"""Contact modes: the numbers on disk, their labels and their bits."""

import pytest

from wmr_schemas.modes import MODES, ContactMode, ModeSet


def test_numbers_and_labels_are_those_of_the_canonical_log() -> None:
    assert {int(mode): mode.label for mode in ContactMode} == {
        -1: "undecided",
        0: "ideal",
        1: "skidding",
        2: "slipping",
        3: "skidding_slipping",
    }


def test_bit_k_stands_for_mode_k() -> None:
    assert [mode.bit for mode in MODES] == [1, 2, 4, 8]


def test_an_undecided_mode_has_no_bit() -> None:
    with pytest.raises(ValueError, match="no bit"):
        _ = ContactMode.UNDECIDED.bit


def test_nothing_excluded_are_the_three_modes_of_the_paper() -> None:
    paper = (ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING)
    assert sum(mode.bit for mode in paper) == ModeSet.ALL_SINGLE

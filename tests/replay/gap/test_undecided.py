"""What the notes of an open verdict say."""

import pytest

from wmr_replay.gap.result.undecided import shown_share


@pytest.mark.parametrize(
    ("share", "text"), [(0.14, "14%"), (0.01, "1%"), (0.0042, "0.4%"), (0.00013, "0.01%"), (1.2, "120%")]
)
def test_no_share_is_shown_as_nothing(share, text):
    assert shown_share(share) == text

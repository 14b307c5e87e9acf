"""``wmr-replay synth`` in this process."""

from functools import partial

import pytest


@pytest.fixture(scope="session")
def synth(command_line):
    """``synth(*arguments) -> (code, stdout, stderr)``."""
    return partial(command_line, "synth")

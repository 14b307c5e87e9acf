"""What ``check`` prints: a short summary, and how to accept a change that is meant."""

from pathlib import Path
from typing import TYPE_CHECKING

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.plain import say

if TYPE_CHECKING:
    from wmr_replay.api.check import Check


def print_check(found: "Check", diff_file: Path | None, *, as_json: bool) -> None:
    """The outcome as text or JSON."""
    if as_json:
        echo_json(found.as_dict())
        return
    say(str(found))
    if found.accept is not None:
        if diff_file is not None:
            say(f"every difference: {diff_file}")
        say(f"if the change is meant, accept it:\n  {found.accept}")

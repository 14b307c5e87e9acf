"""What ``compare`` prints: the differences as tables of text, or as JSON."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.plain import say

if TYPE_CHECKING:
    from wmr_replay.api.compare import Comparison


def print_comparisons(
    comparisons: Sequence["Comparison"],
    lonely: Sequence[str],
    out: Path,
    *,
    as_json: bool,
) -> None:
    """Each comparison with its files; names that are on one side only go to standard error."""
    for stem in lonely:
        say(f"{stem}: only on one side", err=True)
    if as_json:
        echo_json([comparison.as_dict() for comparison in comparisons])
        return
    from wmr_replay.timeline.viewer import viewer_command

    for comparison in comparisons:
        written = comparison.files
        say(str(comparison))
        say(f"\nresults   {out}/")
        if "report" in written:
            say(f"report    {written['report']}")
        if "timeline" in written:
            say(f"viewer    {viewer_command(written['timeline'])}")

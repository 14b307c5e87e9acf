"""What ``synth`` prints: what was written, and the lists of scenarios and effects."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import say_labelled
from wmr_replay.cli.printing.plain import say

if TYPE_CHECKING:
    from wmr_replay.api.synthesise import Synthetic


def print_written(made: "Synthetic", paths: Sequence[Path], *, as_json: bool) -> None:
    """The files and what is in them."""
    facts = made.facts
    if as_json:
        echo_json({"files": [str(path) for path in paths], "messages": made.n_messages, **facts})
        return
    beside = f" (and {', '.join(path.name for path in paths[1:])})" if len(paths) > 1 else ""
    say(
        f"wrote {paths[0]}{beside}: {made.scenario}, seed {made.seed}, {facts['duration_s']:g} s, "
        f"{made.n_messages} messages"
    )
    say(f"next: wmr-replay run {paths[0]}")


def print_scenarios(*, as_json: bool) -> None:
    """Name, length and description of every scenario."""
    from wmr_replay.api.synthesise import scenarios

    rows = scenarios().to_dicts()
    if as_json:
        echo_json(rows)
        return
    width = max(len(row["name"]) for row in rows)
    for row in rows:
        say_labelled(row["name"], f"{row['duration_s']:4.0f} s  {row['description']}", width + 2)


def print_effects(*, as_json: bool) -> None:
    """Name, ranges and formula of every effect that can be hidden."""
    from wmr_replay.api.synthesise import hidden_effects

    rows = hidden_effects()
    if as_json:
        echo_json(rows)
        return
    width = max(len(row["name"]) for row in rows)
    for row in rows:
        drawn = ", ".join(f"{key} {text}" for key, text in row["ranges"].items())
        say_labelled(row["name"], drawn, width + 2)
        say_labelled("", f"{row['candidate']}; here: {row['hidden']}", width + 2)

"""What ``excite`` prints: the manoeuvres with their times, and what is expected of them."""

import shlex
from typing import TYPE_CHECKING, Any

from rich.table import Table

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import output_width, print_table, say_labelled
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_schemas.text import figure

if TYPE_CHECKING:
    from wmr_replay.api.excite import Excitation

MOST_PAIRS = 6
LABEL = 10


def print_excitation(found: "Excitation", *, as_json: bool) -> None:
    """The drive and what it separates, then what to do with it; or excite.json."""
    said = found.as_dict()
    if as_json:
        echo_json(said | {"files": {kind: str(file) for kind, file in found.files.items()}})
        return
    console = console_of(width=output_width())
    console.print(headline(said), soft_wrap=True)
    console.print()
    print_table(console, manoeuvre_table(said), n_titles=2)
    console.print()
    print_table(console, pair_table(said["separations"][:MOST_PAIRS]))
    console.print()
    for label, line in closing(found, said):
        say_labelled(label, line, LABEL)


def headline(said: dict[str, Any]) -> Any:
    """The effects and how well they are expected to be told apart."""
    names = " or ".join(said["separate"]) or "any effect of the library"
    weakest = said["separations"][0]
    bic = figure(weakest["expected_bic"], 3)
    style = "bold green" if said["resolves"] else "bold yellow"
    mark = "●" if said["resolves"] else "◐"
    ending = f"expected ΔBIC {bic} or more; {said['wanted_bic']:g} are wanted"
    return styled((mark, style), " ", (names, "bold"), f"  {said['duration_s']:.0f} s, {ending}")


def manoeuvre_table(said: dict[str, Any]) -> Table:
    """A line for each manoeuvre: when, what, and the pair to which it contributes the largest share."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in ("from", "for"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("manoeuvre")
    table.add_column("share", justify="right", no_wrap=True)
    table.add_column("of what tells")
    totals = [sum(drops) for drops in zip(*map(drops_of, said["manoeuvres"]), strict=True)]
    for row in said["manoeuvres"]:
        shares = [drop / max(total, 1e-12) for drop, total in zip(drops_of(row), totals, strict=True)]
        best = max(range(len(shares)), key=shares.__getitem__)
        pair = row["contribution"][best]
        table.add_row(
            f"{row['start_s']:.1f} s",
            f"{row['duration_s']:.1f} s",
            row["words"],
            f"{shares[best]:.0%}",
            f"{pair['missing']} from {pair['rival'] or 'nothing'}",
        )
    return table


def drops_of(row: dict[str, Any]) -> list[float]:
    """What a manoeuvre contributes to each pair."""
    return [float(pair["deviance"]) for pair in row["contribution"]]


def pair_table(pairs: list[dict[str, Any]]) -> Table:
    """What is expected of each pair, the weakest first."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in ("if it is", "and not"):
        table.add_column(name, no_wrap=True)
    for name in ("expected ΔBIC", "wanted after"):
        table.add_column(name, justify="right", no_wrap=True)
    for pair in pairs:
        after = f"{pair['seconds_needed']:.0f} s"
        table.add_row(pair["missing"], pair["rival"] or "nothing", figure(pair["expected_bic"], 3), after)
    return table


def closing(found: "Excitation", said: dict[str, Any]) -> list[tuple[str, str]]:
    """What else resembles the effects, and the commands and files."""
    lines = []
    near = [p for p in said["rest_of_library"] if p["expected_bic"] < said["wanted_bic"]][:3]
    if near and not said["library"]:
        words = (f"{p['missing']} and {p['rival']} (ΔBIC {figure(p['expected_bic'], 2)})" for p in near)
        lines.append(("note", f"less well told apart: {', '.join(words)}"))
    if not said["resolves"]:
        lines.append(("note", "allow more time, speed, torque or area, or measure more precise poses"))
    scenario, commands = found.files["scenario"], found.files["commands"]
    lines.append(("simulate", f"wmr-replay synth {shlex.quote(str(scenario))} --out designed.mcap"))
    lines.append(
        ("robot", f"{commands}, {found.files['csv']}: speeds to follow, with torques as feedforward")
    )
    return lines

"""What ``gap`` prints: what is missing, what adding it brings, where, and what to do next."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from wmr_replay.cli.printing.json import echo_document
from wmr_replay.cli.printing.layout import print_table
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_replay.cli.printing.words import modes_in_words, next_steps, numbers, p_in_words, unit_of
from wmr_schemas.text import figure, shown

if TYPE_CHECKING:
    from wmr_replay.api.gap import Gap as GapAnswer
    from wmr_schemas.gap_file import Effect, Gap, GapFile, HeldOut, OdometryError, Proof
    from wmr_schemas.model_file import Odometry

WIDTH = 100
STYLES = {
    "named": "bold green",
    "ambiguous": "bold yellow",
    "unnamed": "bold yellow",
    "nothing_missing": "bold cyan",
    "not_enough_excitation": "bold magenta",
}
MARKS = {"named": "●", "ambiguous": "◐", "unnamed": "◌", "nothing_missing": "○", "not_enough_excitation": "×"}
BAR = 20
BAR_KEY = "bar: █ what is left, ░ what the model now explains, ╋ the floor"
RUNS_AWAY = 100.0
"""Gap over a few seconds, m or rad, from which on a model is unstable, and the number says no more."""
NEAR_BIC = 10.0
"""Alternatives that are worse than this are not worth a word."""


def terminal() -> Console:
    """A console as wide as the terminal; 100 columns where the output goes to a file or pipe."""
    return console_of(width=None if sys.stdout.isatty() else WIDTH)


def print_gap(found: "GapAnswer", log: Path, *, as_json: bool) -> None:
    """Everything from the verdict to the files, or gap.json."""
    if as_json:
        echo_document(found.as_json().rstrip("\n"))
        return
    gap, console = found.document, terminal()
    console.print(header(found))
    console.print()
    console.print(verdict_line(gap))
    console.print()
    if gap.effects:
        print_table(console, effect_table(gap))
        console.print()
    print_table(console, gap_table(gap.gap))
    if bar(gap.gap.held_out) or bar(gap.gap.yaw.held_out):
        console.print(BAR_KEY, style="dim")
    console.print()
    listed = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    listed.add_column(style="dim", no_wrap=True)
    listed.add_column()
    for label, line in facts(gap):
        listed.add_row(label, shown(line))
    console.print(listed)
    console.print()
    if gap.verdict in ("nothing_missing", "not_enough_excitation") and gap.minimum_detectable:
        console.print("would have been seen from", style="dim")
        console.print(least_sizes(gap))
        console.print()
    for label, line in next_steps(found, log):
        console.print(styled((f"{label:<9}", "dim"), f" {line}"), soft_wrap=True)


def header(found: "GapAnswer") -> Text:
    """Log, length, base model, modes."""
    gap, pose = found.document, found.log.pose
    seconds = (pose.t_ns[-1] - pose.t_ns[0]) / 1e9
    first = styled((gap.log, "bold"), f"  {seconds:.1f} s, {len(pose)} poses, {inputs_of(found)}")
    second = styled((f"base model: {gap.base}; contact modes: {modes_in_words(gap.modes)}", "dim"))
    return Text("\n").join([first, second])


def inputs_of(found: "GapAnswer") -> str:
    """What drives the model, counted."""
    log, gap = found.log, found.document
    if gap.base_model == "torque":
        return f"{len(log.torque) if log.torque is not None else 0} torques"
    if gap.settings.input == "commands":
        return f"{len(log.commands) if log.commands is not None else 0} commands"
    return f"{len(log.wheels) if log.wheels is not None else 0} wheel speeds"


def odometry_line(odometry: "OdometryError | Odometry") -> str:
    """The error of dead reckoning before and after."""
    o = odometry
    sizes = (o.position_rms_before_m, o.position_rms_after_m, o.position_median_before_m)
    before, after, middle, left = (
        "–" if size is None else f"{figure(1e3 * size, 3)}" for size in (*sizes, o.position_median_after_m)
    )
    yaw = [
        "–" if size is None else figure(1e3 * size, 3) for size in (o.yaw_rms_before_rad, o.yaw_rms_after_rad)
    ]
    return (
        f"{before} → {after} mm rms ({middle} → {left} median), {yaw[0]} → {yaw[1]} mrad, "
        f"after {figure(o.seconds, 2)} s of dead reckoning, held out"
    )


def verdict_line(gap: "GapFile") -> Table:
    """The verdict in a word and a sentence, behind a coloured mark."""
    line = Table.grid(padding=(0, 1))
    style = STYLES[gap.verdict]
    word = gap.verdict.replace("_", " ")
    sentence = Text(shown(gap.sentence.strip()), style="bold")
    line.add_row(Text(MARKS[gap.verdict], style=style), Text(word, style=style, no_wrap=True), sentence)
    return line


def effect_table(gap: "GapFile") -> Table:
    """A line for each parameter: value, interval, what else it might be, significance."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in ("missing", "parameter"):
        table.add_column(name, no_wrap=True)
    for name in ("value", "95 % interval"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("or", ratio=1)
    table.add_column("p", justify="right", no_wrap=True)
    for effect in gap.effects:
        for cells in effect_rows(effect):
            table.add_row(*cells)
    return table


def effect_rows(effect: "Effect") -> Iterator[tuple[str | Text, ...]]:
    """The lines of one effect; name, alternatives and significance in the first."""
    name, other = Text(shown(effect.name), style="bold"), shown(or_else(effect))
    for k, (key, p) in enumerate(effect.parameters.items()):
        value, interval = numbers(p.value, p.ci95)
        first = k == 0
        yield (
            name if first else "",
            key,
            Text(value, style="bold"),
            interval,
            unit_of(p.unit),
            other if first else "",
            p_in_words(effect.p_value) if first else "",
        )


def or_else(effect: "Effect") -> str:
    """The confounded class, and what else explains this log nearly as well, with its ΔBIC."""
    others = [name for name in effect.confound_class if name != effect.name]
    near = [
        f"{other.name} (ΔBIC {figure(other.delta_bic, 2)})"
        for other in effect.alternatives
        if other.delta_bic is not None and other.delta_bic < NEAR_BIC
    ]
    return ", ".join([*others, *near]) or "–"


def gap_table(gap: "Gap") -> Table:
    """Position and yaw: before, after, floor, and the share of the gap that is left as a bar."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    table.add_column(f"held-out gap, {gap.windows} window{'' if gap.windows == 1 else 's'}", no_wrap=True)
    for name in ("before", "after", "floor", "reduced by", "p"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("")
    table.add_row(f"position over {gap.seconds} s", *held_out_cells(gap.held_out, "mm"), bar(gap.held_out))
    table.add_row(
        f"yaw over {gap.seconds} s", *held_out_cells(gap.yaw.held_out, "mrad"), bar(gap.yaw.held_out)
    )
    return table


def held_out_cells(held: "HeldOut", shown_unit: str) -> list[str]:
    """The gap in thousandths of its unit, and the reduction with its interval."""
    sizes = (held.before, held.after, held.floor)
    cells = ["–" if size is None else f"{figure(1e3 * size, 3)} {shown_unit}" for size in sizes]
    low, high = held.reduction_ci95
    same = held.before is None or held.after is None or held.before == held.after
    reduced = "–" if same or low is None or high is None else f"{100 * low:z.0f} … {100 * high:z.0f} %"
    return [*cells, reduced, "–" if same else p_in_words(held.p_value)]


def bar(held: "HeldOut") -> Text:
    """``before`` as a full bar: what is left full, what was explained light, the floor a mark in it."""
    if not held.before or held.after is None or held.after == held.before:
        return Text("")
    left = min(round(BAR * held.after / held.before), BAR)
    drawn = Text("█" * left, style="cyan") + Text("░" * (BAR - left), style="bright_black")
    if held.floor is not None and held.floor < held.before:
        mark = min(round(BAR * held.floor / held.before), BAR - 1)
        drawn = drawn[:mark] + Text("╋", style="white") + drawn[mark + 1 :]
    return drawn


def print_both(gap: "GapFile") -> None:
    """What torques and wheel speeds say together."""
    if gap.bases is not None:
        console = terminal()
        console.print()
        console.print(styled(("both bases", "bold"), f"  {gap.bases.sentence}"))


def facts(gap: "GapFile") -> Iterator[tuple[str, str]]:
    """Where the models disagree, what would have been seen, what was noticed: a label and a line each."""
    if gap.odometry is not None:
        yield "odometry", odometry_line(gap.odometry)
    if gap.where.channels and gap.effects:
        factors = (f"{name} ×{figure(q, 3)}" for name, q in gap.where.channels.items() if q is not None)
        yield "where", "disturbance that the base needs, over the extended model's: " + ", ".join(factors)
    yield from slip_facts(gap.gap)
    if gap.where.intervals:
        pieces = (f"{i.start_s:.1f} … {i.end_s:.1f} s{share(i.share)}" for i in gap.where.intervals[:3])
        yield "when", ", ".join(pieces)
    if gap.where.regions:
        pieces = (
            f"({r.x_m:.1f}, {r.y_m:.1f}) m ± {r.radius_m:.1f} m{share(r.share)}"
            for r in gap.where.regions[:3]
        )
        yield "on the path", ", ".join(pieces)
    yield from proof_facts(gap.proof)
    for effect in gap.effects:
        if effect.separate_with:
            yield "tell apart", f"{effect.name}: {effect.separate_with}"
    if gap.unnameable:
        yield "not named", f"{', '.join(gap.unnameable)}: not from a base calibrated on this log"
    for note in gap.notes:
        yield "note", note
    for found in gap.findings:
        yield found.severity, f"{found.code}: {found.text}; {found.meaning}; {found.advice}"


def slip_facts(gap: "Gap") -> Iterator[tuple[str, str]]:
    """The gap over the windows with slip, which the table leaves out."""
    if gap.in_slip is None or gap.yaw.in_slip is None:
        return
    said = []
    for name, metric, unit in (("position", gap.in_slip, "mm"), ("yaw", gap.yaw.in_slip, "mrad")):
        before, after = map(thousandths, (metric.before, metric.after))
        said.append(f"{name} {before} {unit}" if before == after else f"{name} {before} → {after} {unit}")
    yield (
        "in slip",
        f"{', '.join(said)} over {gap.seconds} s, {gap.in_slip.windows} windows not counted above",
    )


def thousandths(size: float | None) -> str:
    """A size in metres or radians as thousandths of it; that of a model that runs away in words."""
    if size is None:
        return "–"
    return figure(1e3 * size, 3) if size < RUNS_AWAY else "runs away"


def proof_facts(proof: "Proof | None") -> Iterator[tuple[str, str]]:
    """The gap on another log before and after, where there is one."""
    if proof is None:
        return
    said = []
    for name, metric, unit in (("position", proof.gap, "mm"), ("yaw", proof.gap.yaw, "mrad")):
        before, after, floor = held_out_cells(metric.held_out, unit)[:3]
        said.append(f"{name} {before} → {after} (noise alone {floor})")
    left_out = f"; without {', '.join(proof.left_out)}" if proof.left_out else ""
    yield "elsewhere", f"{proof.log}, never fitted: {', '.join(said)} over {proof.gap.seconds} s{left_out}"


def least_sizes(gap: "GapFile") -> Table:
    """The smallest size of each effect that would have been seen, two to a line; – where none would."""
    table = Table.grid(padding=(0, 2))
    cells = [
        (name, "–" if least.value is None else f"{figure(least.value, 2)} {unit_of(least.unit)}")
        for name, least in gap.minimum_detectable.items()
    ]
    height = -(-len(cells) // 2)
    for row in range(height):
        table.add_row(*(cell for entry in cells[row::height] for cell in entry))
    return table


def share(value: float | None) -> str:
    """The share in brackets."""
    return "" if value is None else f" ({value:.0%})"

"""What ``fit`` prints: the calibrated base model."""

from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from rich.table import Table

from wmr_replay.cli.printing.gap import odometry_line, terminal
from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import print_table
from wmr_replay.cli.printing.plain import styled
from wmr_replay.cli.printing.words import numbers, unit_of
from wmr_schemas.effects import catalogue, declared

if TYPE_CHECKING:
    from wmr_replay.api.fit import Fit
    from wmr_schemas.model_file import Model

NORMAL_95 = 1.96


def print_fit(fitted: "Fit", *, as_json: bool) -> None:
    """Parameters with their intervals, noise, what was noticed, the file, and what to do with it; or JSON."""
    if as_json:
        echo_json(fitted.as_dict())
        return
    console, pose = terminal(), fitted.log.pose
    seconds = (pose.t_ns[-1] - pose.t_ns[0]) / 1e9
    console.print(
        styled(("base model", "bold"), f" fitted to {seconds:.1f} s, {len(pose)} poses"), end="\n\n"
    )
    print_table(console, parameter_table(fitted.model))
    if fitted.model.odometry is not None:
        console.print()
        console.print(styled(("odometry", "dim"), f"  {odometry_line(fitted.model.odometry)}"))
    console.print()
    for note in fitted.notes:
        console.print(styled(("note", "dim"), f"      {note}"))
    for f in fitted.findings:
        told = f"{f['code']}: {f['text']}; {f['meaning']}; {f['advice']}"
        console.print(styled((f"{f['severity']:<9} ", "dim"), told))
    for label, line in (
        ("model", fitted.file),
        ("next", f"wmr-replay gap ANOTHER_LOG --model {fitted.file}"),
        *exports(fitted),
    ):
        console.print(styled((f"{label:<10}", "dim"), str(line)), soft_wrap=True)


def exports(fitted: "Fit") -> list[tuple[str, str]]:
    """What a calibrated odometry is good for."""
    if fitted.model.odometry is None:
        return []
    return [("", f"wmr-replay export {fitted.file} --to ros2-diff-drive")]


def parameter_table(model: "Model") -> Table:
    """A line for each known value."""
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    table.add_column("parameter", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True, style="bold")
    table.add_column("95 % interval", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for row in rows(model):
        table.add_row(*row)
    return table


def rows(model: "Model") -> Iterator[tuple[str, str, str, str]]:
    """Robot parameters, fitted or taken over, then the noise."""
    nothing: dict[str, float] = {}
    for record, sd, else_ in ((model.robot, model.robot_sd, "as given"), (model.noise, nothing, "–")):
        for described in fields(record):
            value: Any = getattr(record, described.name)
            if value is not None:
                yield (
                    described.name,
                    *interval(value, sd.get(described.name), else_),
                    unit_of(described.metadata["unit"]),
                )
        if record is model.robot:
            yield from effect_rows(model)


def effect_rows(model: "Model") -> Iterator[tuple[str, str, str, str]]:
    """Fitted effects, such as a wheel's scale; those that a base model on torques holds have no interval."""
    for effect in model.effects:
        for key, value in effect.parameters.items():
            unit = declared(effect.name).units.get(key, "") if effect.name in catalogue() else ""
            yield f"{effect.name} {key}", *interval(value, effect.sd.get(key), "held"), unit_of(unit)


def interval(value: float | str, sd: float | None, without: str) -> tuple[str, str]:
    """Value and 95 % interval, or what stands in its place."""
    if isinstance(value, str):
        return value, without
    if sd is None:
        return f"{value:.5g}", without
    return numbers(value, (value - NORMAL_95 * sd, value + NORMAL_95 * sd))

"""``wmr-replay info``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.mapping import between_from_options, mapping_from_options, mapping_options
from wmr_replay.cli.places import LOG

if TYPE_CHECKING:
    from rich.table import Table

    from wmr_replay.ingest import LogPath, LogReader
    from wmr_schemas.mapping_file import LogMapping

_WIDTH = 1000
"""Wide enough for every table: a terminal wraps a long line, while a cut one is lost."""
_ROLES = ("pose", "torque", "truth")


@click.command(name="info")
@click.argument("log", type=LOG)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@click.option(
    "--write-map",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write what was found to this mapping file (robot.toml).",
)
@mapping_options
def command(log: "LogPath", as_json: bool, write_map: Path | None, **options: str | Path | None) -> None:
    """What LOG holds, what would be used as pose, torque and truth, and why the rest would not.

    The whole file is read, so that what is damaged is known too.

    \b
    Examples:
      wmr-replay info log.mcap
      wmr-replay info log.mcap --pose /amcl_pose
      wmr-replay info s3://bucket/log.mcap
      wmr-replay info log.mcap --json | jq .channels
      wmr-replay info log.mcap --write-map robot.toml
    """
    import json

    from wmr_replay.cli.progress import byte_progress
    from wmr_replay.ingest import open_log

    mapping = mapping_from_options(options)
    reader = open_log(log, mapping, need_pose=False, between=between_from_options(options))
    with byte_progress(f"reading {log.name}") as progress:
        for _ in reader.batches(everything=True):
            if progress is not None:
                progress(reader.position_bytes, reader.size_bytes)
    if write_map is not None:
        write_mapping(reader, mapping, write_map)
    if as_json:
        click.echo(json.dumps(facts(reader), indent=2, ensure_ascii=False))
    else:
        show(reader)


def write_mapping(reader: "LogReader", said: "LogMapping", path: Path) -> None:
    """The mapping file of what was found, whole or not at all."""
    from wmr_replay.ingest.channels.mapping_proposal import proposed_mapping
    from wmr_replay.tables import replace_file
    from wmr_schemas.mapping_file import mapping_toml

    with replace_file(path) as part:
        part.write_text(mapping_toml(proposed_mapping(reader.plan, said, reader.robot)), encoding="utf-8")


def facts(reader: "LogReader") -> dict[str, Any]:
    """Everything that is known of a log once it is read."""
    return {
        "log": str(reader.path),
        "size_bytes": reader.size_bytes,
        "profile": reader.survey.profile,
        "library": reader.survey.library,
        "channels": [
            channel_facts(reader, channel_id) for channel_id in sorted(reader.survey.catalogue.channels)
        ],
        "used": {role: reader.plan.as_dict().get(role) for role in _ROLES},
        "clocks": {
            role: {"clock": clock.name, "offset_s": clock.offset_s, **clock.steps.as_dict()}
            for role, clock in reader.clocks.items()
        },
        "robot": reader.robot.known(),
        "losses": {**reader.losses.counts(), "notes": reader.losses.notes},
        "remarks": reader.remarks,
    }


def channel_facts(reader: "LogReader", channel_id: int) -> dict[str, Any]:
    """One channel: what it is, how much of it there is, and its role or why it has none."""
    book, tally = reader.survey.catalogue, reader.message_counts.by_channel.get(channel_id)
    channel = book.channels[channel_id]
    schema = book.schemas.get(channel.schema_id)
    return {
        "id": channel_id,
        "topic": channel.topic,
        "schema": schema.name if schema else None,
        "encoding": channel.message_encoding,
        "messages": tally.n if tally else 0,
        "rate_hz": tally.rate_hz if tally else None,
        "first_ns": tally.first_ns if tally else None,
        "last_ns": tally.last_ns if tally else None,
        "role": reader.plan.role(channel_id),
        "why_not": reader.plan.why_not.get(channel_id),
    }


def show(reader: "LogReader") -> None:
    """Everything for the eye: coloured on a terminal, plain lines elsewhere."""
    import sys

    from rich.console import Console
    from rich.markup import escape

    console = Console(highlight=False, soft_wrap=True)
    console.width = _WIDTH
    with console.capture() as capture:
        console.print(f"[bold]{escape(str(reader.path))}[/bold]  [dim]{escape(overview(reader))}[/dim]\n")
        if reader.survey.catalogue.channels:
            console.print(channel_table(reader))
            console.print()
        for name, text in lines(reader):
            console.print(f"[bold]{name:<8}[/bold]{escape(text)}")
    sys.stdout.write("".join(f"{line.rstrip()}\n" for line in capture.get().splitlines()))


def overview(reader: "LogReader") -> str:
    """Size, writer, length and number of messages in a line."""
    tallies = list(reader.message_counts.by_channel.values())
    parts = [f"{reader.size_bytes / 1e6:.3g} MB"]
    parts += [text for text in (reader.survey.profile, reader.survey.library) if text]
    if tallies:
        span_s = (max(t.last_ns for t in tallies) - min(t.first_ns for t in tallies)) / 1e9
        parts.append(f"{span_s:.4g} s")
    return " · ".join([*parts, f"{sum(t.n for t in tallies)} messages"])


def channel_table(reader: "LogReader") -> "Table":
    """A line for each channel; those in use first."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in ("id", "topic", "schema", "encoding", "messages", "Hz", "from s", "to s", "use"):
        right = name in {"id", "messages", "Hz", "from s", "to s"}
        table.add_column(name, justify="right" if right else "left", no_wrap=True)
    start_ns = min((tally.first_ns for tally in reader.message_counts.by_channel.values()), default=0)
    rows = [channel_facts(reader, channel_id) for channel_id in reader.survey.catalogue.channels]
    rows.sort(key=lambda row: (_ROLES.index(row["role"]) if row["role"] else len(_ROLES), row["id"]))
    for row in rows:
        use = (
            f"[bold green]{row['role']}[/bold green]"
            if row["role"]
            else f"[dim]{escape(row['why_not'] or '')}[/dim]"
        )
        rate = "–" if row["rate_hz"] is None else f"{row['rate_hz']:.4g}"
        span = [
            "–" if row[k] is None else f"{(row[k] - start_ns) / 1e9:.2f}" for k in ("first_ns", "last_ns")
        ]
        texts = [str(row["id"]), row["topic"], (row["schema"] or "–").replace("/msg/", "/"), row["encoding"]]
        table.add_row(*(escape(text) for text in texts), str(row["messages"]), rate, *span, use)
    return table


def lines(reader: "LogReader") -> list[tuple[str, str]]:
    """Each role with its clock, the robot's parameters, and whatever was lost or noticed."""
    plan, losses = reader.plan, reader.losses
    found = [(role, role_line(reader, role)) for role in _ROLES]
    known = ", ".join(
        f"{name} {value if isinstance(value, str) else f'{value:.5g}'}"
        for name, value in reader.robot.known().items()
    )
    found.append(
        ("robot", known or "no parameters known (metadata record wmr_replay, or [robot] with --map FILE)")
    )
    found += [("note", remark) for remark in reader.remarks]
    found += [("stamps", note) for note in reader.stamp_notes]
    if plan.pose_is_odometry:
        found.append(("note", "by its name the pose is odometry: skidding cannot be seen in wheel odometry"))
    if losses.n_torque_empty:
        found.append(("note", f"{losses.n_torque_empty} torque messages without an effort"))
    found += [("lost", note) for note in losses.notes] or [("lost", "nothing")]
    return found


def role_line(reader: "LogReader", role: str) -> str:
    """The channel and its clock, or how to name one."""
    channel = reader.plan.channel(role)
    if channel is None:
        return "none" + ("" if role == "truth" else f" found; name one with --{role} TOPIC or --map FILE")
    return f"{channel.topic}: {reader.clocks[role].describe()}"

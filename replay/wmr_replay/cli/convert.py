"""``wmr-replay convert``."""

from pathlib import Path

import click

from wmr_replay.cli.help import GroupedCommand


@click.command("convert", cls=GroupedCommand)
@click.argument("source", type=click.Path(path_type=Path))
@click.option(
    "--map",
    "map_path",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="For a CSV file: TOML file that names the columns, and says where the pose is of.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="The MCAP file to write (replaced).",
)
@click.option(
    "--encoding",
    type=click.Choice(["ros2", "protobuf", "json"]),
    default="ros2",
    help="For a CSV file: message encoding.",
)
def command(source: Path, map_path: Path | None, out: Path, encoding: str) -> None:
    """Write an MCAP log from a CSV file with a row per pose sample, or from a ROS bag.

    The commands that read logs take bags as they are; an MCAP file of one is for other tools.

    \b
    Examples:
      wmr-replay convert drive.csv --map columns.toml --out drive.mcap
      wmr-replay convert drive.bag --out drive.mcap
    """
    from wmr_replay.cli.printing.plain import say

    if map_path is None:
        _convert_bag(source, out)
    else:
        _convert_csv(source, map_path, out, encoding)
    say(f"next: wmr-replay run {out}")


def _convert_csv(csv: Path, map_path: Path, out: Path, encoding: str) -> None:
    """A CSV file as a log."""
    from wmr_replay.api.convert import convert
    from wmr_replay.cli.printing.plain import say

    converted = convert(csv, map_path, out, encoding=encoding)
    left_out = f", {converted.n_left_out} left out" if converted.n_left_out else ""
    n_breaks = len(converted.log.breaks_ns)
    windows = f" in {n_breaks + 1} windows" if n_breaks else ""
    say(f"wrote {out}: {converted.n_rows} rows{windows}{left_out}")


def _convert_bag(log: Path, out: Path) -> None:
    """A bag as an MCAP file."""
    from wmr_replay.api.convert import convert_bag
    from wmr_replay.cli.printing.plain import say
    from wmr_replay.cli.printing.progress import byte_progress

    if log.suffix.lower() == ".csv":
        raise click.UsageError("a CSV file needs --map FILE, which names its columns")
    with byte_progress(f"reading {log.name}") as progress:
        copied = convert_bag(log, out, progress=progress)
    say(f"wrote {out}: {copied.n_messages} messages")
    for note in copied.notes:
        say(f"lost: {note}", err=True)
    if copied.n_undescribed:
        say(f"lost: {copied.n_undescribed} messages of channels without description", err=True)

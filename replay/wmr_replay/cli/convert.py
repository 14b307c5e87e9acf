"""``wmr-replay convert``."""

from pathlib import Path

import click


@click.command("convert")
@click.argument("csv", type=click.Path(path_type=Path))
@click.option(
    "--map",
    "map_path",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    required=True,
    help="TOML file that names the columns, and says where the pose is of.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="The MCAP file to write (replaced).",
)
@click.option("--encoding", type=click.Choice(["ros2", "protobuf", "json"]), default="ros2")
def command(csv: Path, map_path: Path, out: Path, encoding: str) -> None:
    """Write the log that `run` takes from a CSV file with a row per pose sample.

    \b
    Examples:
      wmr-replay convert drive.csv --map columns.toml --out drive.mcap
      wmr-replay run drive.mcap
    """
    from wmr_replay.api.convert import convert
    from wmr_replay.cli.printing.plain import say

    converted = convert(csv, map_path, out, encoding=encoding)
    left_out = f", {converted.n_left_out} left out" if converted.n_left_out else ""
    say(f"wrote {out}: {converted.n_rows} rows{left_out}")
    say(f"next: wmr-replay run {out}")

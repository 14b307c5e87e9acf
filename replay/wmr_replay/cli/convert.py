"""``wmr-replay convert``: a CSV file as a canonical log."""

from pathlib import Path

import click

from wmr_schemas.errors import InvalidSetting


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
    from wmr_replay.jobs.convert import read_csv
    from wmr_schemas.csv_map import read_csv_map
    from wmr_synth import write_mcap
    from wmr_synth.atomic import replaced_together

    if not out.parent.is_dir():
        raise InvalidSetting(f"--out {out}: there is no directory {out.parent}; create it first")
    converted = read_csv(csv, read_csv_map(map_path))
    with replaced_together((out,)) as temporary:
        write_mcap(converted.log, temporary[0], encoding=encoding)
    left_out = f", {converted.n_left_out} left out" if converted.n_left_out else ""
    click.echo(f"wrote {out}: {converted.n_rows} rows{left_out}")
    click.echo(f"next: wmr-replay run {out}")

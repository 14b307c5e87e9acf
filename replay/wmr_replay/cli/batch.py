"""``wmr-replay batch``."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.mapping import between_from_options, mapping_from_options, mapping_options
from wmr_replay.cli.places import LOG
from wmr_replay.cli.tuning import settings_from_options, settings_options

if TYPE_CHECKING:
    from wmr_replay.fleet.job import Orders
    from wmr_replay.ingest import LogPath


@click.command(name="batch")
@click.argument("logs", type=LOG, nargs=-1, required=True)
@click.option(
    "--out", type=LOG, required=True, help="Directory or URL of the dataset; it grows with each batch."
)
@click.option("--jobs", type=click.IntRange(min=1), help="Processes; else one per core.")
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers do the work instead.")
@click.option("--json", "as_json", is_flag=True, help="Print totals and a row per log as JSON.")
@click.option("--rrd", is_flag=True, help="Write a Rerun timeline per log too.")
@click.option("--strict", is_flag=True, help="A log in which something was damaged has failed.")
@click.option(
    "--model",
    "model_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Model file (model.toml): parameters and effects beyond the base model.",
)
@mapping_options
@settings_options
def command(
    logs: "tuple[LogPath, ...]",
    out: "LogPath",
    jobs: int | None,
    scheduler: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Replay many LOGS into one dataset: files, rosbag2 directories, directories to search, globs, URLs.

    A log that fails stops no other; the exit code is 1 then. Run the same command again to go on where it was
    interrupted, or with more logs: what is done for the same content, settings and version is skipped.

    \b
    Examples:
      wmr-replay batch logs/ --out fleet/
      wmr-replay batch 'drives/2026-07-*.mcap' --out fleet/ --jobs 8 --map robot.toml
      wmr-replay batch s3://bucket/drives/ --out s3://bucket/results --scheduler tcp://10.0.0.5:8786
    """
    from wmr_replay.cli.fleet_report import print_batch
    from wmr_replay.cli.progress import batch_progress
    from wmr_replay.fleet.batch import run_batch
    from wmr_replay.fleet.summary import fleet_json

    with batch_progress() as progress:
        result = run_batch(
            logs,
            out,
            orders_from_options(options),
            n_jobs=jobs or os.cpu_count() or 1,
            scheduler=scheduler,
            progress=progress,
        )
    if as_json:
        click.echo(fleet_json(result.fleet))
    else:
        print_batch(result, out)
    if result.failed:
        sys.exit(1)


def orders_from_options(options: dict[str, Any]) -> "Orders":
    """What is to be done with each log."""
    from wmr_replay.fleet.job import Orders
    from wmr_schemas.model_file import Model, read_model

    return Orders(
        settings_from_options(options),
        mapping_from_options(options),
        between_from_options(options),
        read_model(options["model_file"]) if options["model_file"] else Model(),
        timeline=options["rrd"],
        strict=options["strict"],
    )

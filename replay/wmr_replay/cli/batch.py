"""``wmr-replay batch``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.mapping import log_options, mapping_options
from wmr_replay.cli.options.places import LOG
from wmr_replay.cli.options.settings import model_option, settings_from_options, settings_options

if TYPE_CHECKING:
    from wmr_replay.api.places import LogPath


@click.command("batch", cls=GroupedCommand)
@click.argument("logs", type=LOG, nargs=-1, required=True)
@click.option(
    "--out", type=LOG, required=True, help="Directory or URL of the dataset; it grows with each batch."
)
@click.option("--jobs", type=click.IntRange(min=1), help="Processes; else one per core.")
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers do the work instead.")
@click.option("--json", "as_json", is_flag=True, help="Print totals and a row per log as JSON.")
@click.option("--rrd", is_flag=True, help="Write a Rerun timeline per log too.")
@click.option(
    "--report", is_flag=True, help="Write a page per log and one of the fleet, report.html (extra report)."
)
@click.option("--strict", is_flag=True, help="A log in which something was damaged has failed.")
@model_option("Model file (model.toml): parameters and effects beyond the base model.")
@mapping_options
@settings_options
def command(  # noqa: PLR0917
    logs: "tuple[LogPath, ...]",
    out: "LogPath",
    jobs: int | None,
    scheduler: str | None,
    as_json: bool,
    rrd: bool,
    report: bool,
    strict: bool,
    model_file: Path | None,
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
    from wmr_replay.api.batch import batch
    from wmr_replay.cli.printing.batch import print_batch
    from wmr_replay.cli.printing.progress import batch_progress

    with batch_progress() as progress:
        result = batch(
            logs,
            out,
            jobs=jobs,
            scheduler=scheduler,
            model=model_file,
            timeline=rrd,
            report=report,
            strict=strict,
            progress=progress,
            **log_options(options),
            **settings_from_options(options),
        )
    print_batch(result, out, as_json=as_json)
    if result.failed:
        sys.exit(1)

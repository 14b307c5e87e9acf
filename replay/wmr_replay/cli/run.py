"""``wmr-replay run``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.mapping import between_from_options, mapping_from_options, mapping_options
from wmr_replay.cli.places import FOLDER, LOG
from wmr_replay.cli.tuning import settings_from_options, settings_options

if TYPE_CHECKING:
    from wmr_replay.ingest import LogPath


@click.command(name="run")
@click.argument("log", type=LOG)
@click.option("--out", type=FOLDER, help="Results go here, not to ./<stem>.wmr/.")
@click.option("--view", is_flag=True, help="Open the timeline in the Rerun viewer afterwards.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option("--no-rrd", is_flag=True, help="Write no Rerun timeline.")
@click.option("--strict", is_flag=True, help="Exit with 3 when something in the file was damaged.")
@click.option(
    "--model",
    "model_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Model file (model.toml): parameters and effects beyond the base model.",
)
@mapping_options
@settings_options
def command(
    log: "LogPath",
    out: Path | None,
    view: bool,
    as_json: bool,
    no_rrd: bool,
    strict: bool,
    model_file: Path | None,
    **options: Any,
) -> None:
    """Identify contact modes and alpha in LOG.

    Writes tables (Parquet, JSON) and a Rerun timeline to ./<stem>.wmr/ or --out DIR, then prints the summary.

    \b
    Examples:
      wmr-replay run log.mcap
      wmr-replay run log.mcap --out results/ --view
      wmr-replay run https://example.org/log.mcap --start 10 --end 20
      wmr-replay run log.mcap --pose /amcl_pose --torque '/joint_states{left=wheel_left,right=wheel_right}'
    """
    from wmr_replay.cli.progress import byte_progress
    from wmr_replay.cli.report import print_summary, summary_json
    from wmr_replay.jobs.run import run_log
    from wmr_replay.timeline import ViewerUnavailable, open_viewer
    from wmr_schemas.model_file import read_model

    if view and no_rrd:
        raise click.UsageError("--view needs the timeline that --no-rrd leaves out")
    with byte_progress(f"replaying {log.name}") as progress:
        result = run_log(
            log,
            out,
            settings=settings_from_options(options),
            mapping=mapping_from_options(options),
            between=between_from_options(options),
            model=read_model(model_file) if model_file else None,
            timeline=not no_rrd,
            strict=strict,
            progress=progress,
        )
    if as_json:
        click.echo(summary_json(result.summary))
    else:
        print_summary(result)
    if view and "timeline" in result.files:
        try:
            open_viewer(result.files["timeline"])
        except ViewerUnavailable as error:
            click.echo(f"warning: {error}", err=True)

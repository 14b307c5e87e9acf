"""``wmr-replay run``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.mapping import log_options, mapping_options
from wmr_replay.cli.options.places import FOLDER, LOG
from wmr_replay.cli.options.settings import model_option, settings_from_options, settings_options
from wmr_replay.cli.options.viewing import Viewing, viewing_options
from wmr_schemas.text import encodable

if TYPE_CHECKING:
    from wmr_replay.api.places import LogPath


@click.command("run", cls=GroupedCommand)
@click.argument("log", type=LOG)
@click.option("--out", type=FOLDER, help="Results go here, not to ./<stem>.wmr/.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option("--force", is_flag=True, help="Replace results of another log of the same name.")
@click.option("--no-rrd", is_flag=True, help="Write no Rerun timeline; one of an earlier run goes.")
@click.option("--report", is_flag=True, help="Write a report too: one HTML file to mail (extra report).")
@click.option("--strict", is_flag=True, help="Exit with 3 when something in the file was damaged.")
@model_option("Model file (model.toml): parameters and effects beyond the base model.")
@mapping_options
@settings_options
@viewing_options
def command(
    log: "LogPath",
    out: Path | None,
    as_json: bool,
    no_rrd: bool,
    report: bool,
    force: bool,
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
      wmr-replay run log.mcap --serve
      wmr-replay run https://example.org/log.mcap --start 10 --end 20
      wmr-replay run log.mcap --pose /amcl_pose --torque '/joint_states{left=wheel_left,right=wheel_right}'
    """
    from wmr_replay.api.run import run
    from wmr_replay.cli.printing.plain import say
    from wmr_replay.cli.printing.progress import AGAIN, byte_progress
    from wmr_replay.cli.printing.run import print_result

    viewing = Viewing.of(options, no_rrd=no_rrd)
    with byte_progress(f"reading {log.name} and identifying modes", AGAIN) as progress:
        result = run(
            log,
            out or encodable(f"{log.stem}.wmr"),
            model=model_file,
            timeline=not no_rrd,
            report=report,
            strict=strict,
            force=force,
            progress=progress,
            live=viewing.live,
            **log_options(options),
            **settings_from_options(options),
        )
    print_result(result, as_json=as_json)
    for file in result.outdated():
        say(f"note: {file} was made of an earlier content of this log", err=True)
    if "timeline" in result.files:
        viewing.show(result.files["timeline"])

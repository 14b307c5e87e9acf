"""``wmr-replay info``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.mapping import log_options, mapping_options
from wmr_replay.cli.options.places import LOG

if TYPE_CHECKING:
    from wmr_replay.api.places import LogPath


@click.command("info", cls=GroupedCommand)
@click.argument("log", type=LOG)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@click.option(
    "--write-map",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write what was found to this mapping file (robot.toml).",
)
@click.option("--full", is_flag=True, help="Read all of a large log, too, and count and check everything.")
@click.option("--force", is_flag=True, help="Let --write-map replace a file that exists.")
@mapping_options
def command(
    log: "LogPath", as_json: bool, write_map: Path | None, full: bool, force: bool, **options: Any
) -> None:
    """What LOG holds, what would be used as pose, torque and truth, why the rest would not, and what is wrong
    with the data.

    A log above 64 MB of messages is read in a few places, if it has an index; any other one, and every log
    with --full, is read as a whole, so that all that is damaged is known too.

    \b
    Examples:
      wmr-replay info log.mcap
      wmr-replay info log.mcap --pose /amcl_pose
      wmr-replay info s3://bucket/log.mcap
      wmr-replay info log.mcap --json | jq .channels
      wmr-replay info log.mcap --full
      wmr-replay info log.mcap --write-map robot.toml
    """
    from wmr_replay.api.log import open_log
    from wmr_replay.cli.printing.info import mapping_line, print_info
    from wmr_replay.cli.printing.plain import say
    from wmr_replay.cli.printing.progress import byte_progress

    if write_map is not None and not force and write_map.exists():
        raise click.UsageError(f"--write-map: {write_map} exists and is left as it is; --force replaces it")
    opened = open_log(log, **log_options(options))
    with byte_progress(f"reading {log.name}") as progress:
        info = opened.info(progress, full=full)
    print_info(info, as_json=as_json)
    if write_map is not None:
        opened.write_mapping(write_map, overwrite=force)
        say(mapping_line(write_map, opened.mapping()), err=as_json)

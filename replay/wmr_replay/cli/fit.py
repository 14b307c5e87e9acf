"""``wmr-replay fit``."""

import json
import shlex
import sys
from pathlib import Path
from typing import Any

import click

from wmr_replay.cli.gap import options_of, topic_of
from wmr_replay.cli.mapping import between_from_options, blind_options, mapping_from_options


@click.command(name="fit")
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "--modes",
    metavar="identified|ideal|topic:T",
    default="identified",
    help="Contact modes: estimated, ideal throughout, or those on topic T.",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="The model goes here, not to ./<stem>.wmr/.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the model as JSON.")
@blind_options
def command(log: Path, modes: str, out: Path | None, as_json: bool, **mapping: Any) -> None:
    """Calibrate the base model of a robot on LOG: alpha, yaw gain, noise, stiffness where it is excited.

    Writes <stem>.model.toml, with a standard deviation beside every value that was fitted.

    \b
    Examples:
      wmr-replay fit calibration.mcap
      wmr-replay fit calibration.mcap --out models/
      wmr-replay gap other.mcap --model models/calibration.model.toml
    """
    from wmr_replay.cli.fit_report import print_fit
    from wmr_replay.cli.progress import share_progress
    from wmr_replay.jobs.gap import fit_log
    from wmr_schemas.model_file import model_tables

    topic = topic_of(modes)
    with share_progress() as progress:
        run = fit_log(
            log,
            out,
            options=options_of(modes, "3:4", 3, 0),
            mode_topic=topic,
            mapping=mapping_from_options(mapping),
            between=between_from_options(mapping),
            command=shlex.join(["wmr-replay", *sys.argv[1:]]),
            progress=progress,
        )
    if as_json:
        click.echo(json.dumps(model_tables(run.model), indent=2, ensure_ascii=False))
    else:
        print_fit(run)

"""``wmr-replay fit``."""

from pathlib import Path
from typing import Any

import click

from wmr_replay.cli.gap import MODES_OPTION, base_option, command_line
from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.mapping import blind_options, log_options
from wmr_replay.cli.options.settings import CLOCK_OFFSET
from wmr_schemas.text import encodable

BASE_OPTION = base_option("torque", "wheel-speed")


@click.command("fit", cls=GroupedCommand)
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@BASE_OPTION
@MODES_OPTION
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="The model goes here, not to ./<stem>.wmr/.",
)
@click.option("--force", is_flag=True, help="Replace results of another log of the same name.")
@click.option("--json", "as_json", is_flag=True, help="Print the model as JSON.")
@CLOCK_OFFSET
@blind_options
def command(
    logs: tuple[Path, ...],
    base: str,
    modes: str,
    out: Path | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Calibrate the base model of a robot on LOG: alpha, yaw gain, noise, stiffness where it is excited.

    Where wheel speeds drive the model: wheel scales, effective track, centre of rotation, pose delay and
    noise, on one log or several, and the error of dead reckoning before and after, on what was held out.

    Writes <stem>.model.toml, with a standard deviation beside every value that was fitted.

    \b
    Examples:
      wmr-replay fit calibration.mcap
      wmr-replay fit calibration.mcap --out models/
      wmr-replay gap other.mcap --model models/calibration.model.toml
      wmr-replay fit encoders.mcap            # no torques: calibrates the odometry
      wmr-replay export encoders.wmr/encoders.model.toml --to ros2-diff-drive
    """
    from wmr_replay.api.fit import fit
    from wmr_replay.cli.printing.fit import print_fit
    from wmr_replay.cli.printing.progress import share_progress

    log = logs[0]
    with share_progress(f"reading {log.name}") as progress:
        fitted = fit(
            list(logs),
            out or encodable(f"{log.stem}.wmr"),
            base=base,
            modes=modes,
            command=command_line(),
            force=force,
            progress=progress,
            clock_offset_s=options.pop("clock_offset_s"),
            **log_options(options),
        )
    print_fit(fitted, as_json=as_json)

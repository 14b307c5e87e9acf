"""``wmr-replay export``."""

from pathlib import Path

import click

from wmr_replay.cli.help import GroupedCommand


@click.command("export", cls=GroupedCommand)
@click.argument("model", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--to",
    type=click.Choice(["ros2-diff-drive"]),
    required=True,
    help="ros2-diff-drive: YAML for the diff_drive_controller of ROS 2.",
)
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), help="File to write; else it is printed."
)
def command(model: Path, to: str, out: Path | None) -> None:
    """Write the wheel scales and the effective track of MODEL as another tool's parameters.

    Comments give 95 % intervals, and the error of the odometry before and after on what was held out.

    \b
    Examples:
      wmr-replay fit drive.mcap
      wmr-replay export drive.wmr/drive.model.toml --to ros2-diff-drive
      wmr-replay export drive.wmr/drive.model.toml --to ros2-diff-drive --out diff_drive.yaml
    """
    from wmr_replay.api.export import export
    from wmr_replay.cli.printing.plain import say

    text = export(model, out, to=to)
    say(text.rstrip("\n") if out is None else f"wrote {out}")

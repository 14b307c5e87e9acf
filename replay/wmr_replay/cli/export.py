"""``wmr-replay export``."""

from pathlib import Path

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.places import MODEL_FILE


@click.command("export", cls=GroupedCommand)
@click.argument("model", type=MODEL_FILE)
@click.option(
    "--to",
    type=click.Choice(["ros2-diff-drive", "mjcf"]),
    required=True,
    help="ros2-diff-drive: YAML for the diff_drive_controller of ROS 2; mjcf: for MuJoCo.",
)
@click.option(
    "--into",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Of mjcf: the robot's own file, which is given out with the parameters in it.",
)
@click.option(
    "--joints",
    metavar="LEFT,…:RIGHT,…",
    help="Of --into: the wheels' joints; else those with left and right in their names.",
)
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), help="File to write; else it is printed."
)
def command(model: Path, to: str, into: Path | None, joints: str | None, out: Path | None) -> None:
    """Write MODEL as another tool's parameters.

    For ROS 2: wheel scales and effective track; comments give 95 % intervals, and the error of the odometry
    before and after on what was held out. For MuJoCo: the effects that the simulator lacks, as masses,
    friction, gears, actuators and gravity; a comment lists what has no counterpart.

    \b
    Examples:
      wmr-replay fit drive.mcap
      wmr-replay export drive.wmr/drive.model.toml --to ros2-diff-drive
      wmr-replay export drive.wmr/drive.model.toml --to ros2-diff-drive --out diff_drive.yaml
      wmr-replay gap real.mcap --base-log simulated.mcap
      wmr-replay export real.wmr/real.model.toml --to mjcf --into robot.xml --out better.xml
    """
    from wmr_replay.api.export import export
    from wmr_replay.cli.printing.plain import say

    text = export(model, out, to=to, into=into, joints=None if joints is None else sides_of(joints))
    say(text.rstrip("\n") if out is None else f"wrote {out}")


def sides_of(text: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """``LEFT,…:RIGHT,…`` as names by side."""
    left, separator, right = text.partition(":")
    if not (left and separator and right):
        raise click.BadParameter(f"{text!r} is not LEFT,…:RIGHT,…", param_hint="--joints")
    return tuple(left.split(",")), tuple(right.split(","))

"""``wmr-replay excite``."""

from pathlib import Path

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.completion import complete_effects
from wmr_replay.cli.options.mapping import blind_options, log_options

POSITIVE = click.FloatRange(min=0, min_open=True)


@click.command(
    "excite",
    cls=GroupedCommand,
    groups={
        "Bounds": ("--duration", "--max-speed", "--max-yaw-rate", "--max-torque", "--area", "--no-reverse")
    },
)
@click.argument("source", required=False, type=click.Path(path_type=Path))
@click.option(
    "--from",
    "from_gap",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="gap.json that left something open: the effects, their sizes, the robot and the noise.",
)
@click.option(
    "--separate",
    metavar="A,B[,…]",
    shell_complete=complete_effects,
    help="Effects to be told apart.  [default: what --from left open, else any of the library]",
)
@click.option("--duration", "duration_s", type=POSITIVE, default=90.0, help="Longest drive in s.")
@click.option("--max-speed", "max_speed_mps", type=POSITIVE, default=1.5, help="Largest speed in m/s.")
@click.option(
    "--max-yaw-rate", "max_yaw_rate_radps", type=POSITIVE, default=1.5, help="Largest yaw rate in rad/s."
)
@click.option(
    "--max-torque",
    "max_torque_nm",
    type=POSITIVE,
    help="Largest torque of a wheel in N·m.  [default: what accelerates by 1.5 m/s²]",
)
@click.option(
    "--area",
    metavar="RADIUS|LENGTHxWIDTH",
    default="4",
    help="Where the robot stays, in m: a disc about the start, or a box ahead and across centred at it.",
)
@click.option("--no-reverse", is_flag=True, help="Never drive in reverse.")
@click.option(
    "--input",
    "inputs",
    type=click.Choice(["torques", "measured", "commands"]),
    default="torques",
    help="What drives the model; drives for wheel speeds are not designed.",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Directory for the results.  [default: that of --from, else ./<stem>.wmr]",
)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@blind_options
def command(  # noqa: PLR0917
    source: Path | None,
    from_gap: Path | None,
    separate: str | None,
    duration_s: float,
    max_speed_mps: float,
    max_yaw_rate_radps: float,
    max_torque_nm: float | None,
    area: str,
    no_reverse: bool,
    inputs: str,
    out: Path | None,
    as_json: bool,
    **mapping: str | Path | None,
) -> None:
    """Design what to drive next: a drive that tells apart what a log left open.

    SOURCE is a log, a model file or a file with [robot]; with --from it may be left out. Written are a
    scenario that `synth` plays, the commands for the robot as MCAP and CSV, and excite.json.

    \b
    Examples:
      wmr-replay excite --from drive.wmr/drive.gap.json
      wmr-replay excite robot.model.toml --separate actuator_lag,input_delay --area 6x4
      wmr-replay excite drive.mcap --separate rolling_resistance,slope --duration 60 --max-torque 3
      wmr-replay synth drive.wmr/drive.excite.toml --hide input_delay --out designed.mcap
    """
    from wmr_replay.api.excite import excite, stem_of
    from wmr_replay.cli import activity
    from wmr_replay.cli.printing.excite import print_excitation

    if source is None and from_gap is None:
        raise click.UsageError("which robot? Name a log, a model or a robot file, or a result with --from")
    size = area_of(area)
    home = out or (Path(f"{stem_of(source, None)}.wmr") if from_gap is None else from_gap.parent)
    activity.tell("designing a drive")
    found = excite(
        source,
        home,
        from_gap=from_gap,
        separate=tuple(name.strip() for name in separate.split(",")) if separate else (),
        duration_s=duration_s,
        max_speed_mps=max_speed_mps,
        max_yaw_rate_radps=max_yaw_rate_radps,
        max_torque_nm=max_torque_nm,
        area_m=size,
        reverse=not no_reverse,
        inputs=inputs,
        **log_options(mapping),
    )
    print_excitation(found, as_json=as_json)


def area_of(text: str) -> float | tuple[float, float]:
    """``RADIUS`` or ``LENGTHxWIDTH`` in m."""
    try:
        sizes = [float(part) for part in text.lower().split("x")]
    except ValueError:
        sizes = []
    if len(sizes) not in (1, 2) or not all(0 < size < float("inf") for size in sizes):
        raise click.BadParameter(f"{text!r} is not RADIUS or LENGTHxWIDTH in m", param_hint="--area")
    return sizes[0] if len(sizes) == 1 else (sizes[0], sizes[1])

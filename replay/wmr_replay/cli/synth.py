"""``wmr-replay synth``: write a synthetic log."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.model_file import split_sd
from wmr_schemas.robot import PAPER_ROBOT, RobotParameters
from wmr_schemas.tomlfile import expect_table, read_toml

if TYPE_CHECKING:
    from wmr_synth import Scenario, Sensors

LONG_LOG_MESSAGES = 200_000
POSITIVE = click.FloatRange(min=0, min_open=True)
NOT_NEGATIVE = click.FloatRange(min=0)


@click.command(
    "synth",
    epilog="""\b
Examples:
  wmr-replay synth --list
  wmr-replay synth paper-acceleration --out demo.mcap
  wmr-replay synth random --seed 7 --duration 600 --rate 200 --out random7.mcap
  wmr-replay synth stop-and-go --noise-xy-sd 0.01 --jitter 0.002 --dropout 0.05 --out rough.mcap
""",
)
@click.argument("scenario", required=False)
@click.option("--list", "listing", is_flag=True, help="List the scenarios and leave.")
@click.option(
    "--out", type=click.Path(path_type=Path, dir_okay=False), help="The MCAP file to write (replaced)."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="One seed, one file.")
@click.option("--duration", "duration_s", type=POSITIVE, help="Length in s.  [default: the scenario's]")
@click.option("--rate", "rate_hz", type=POSITIVE, help="Pose rate in Hz.  [default: the scenario's]")
@click.option(
    "--torque-rate", "torque_rate_hz", type=POSITIVE, help="Torque rate in Hz.  [default: the scenario's]"
)
@click.option(
    "--noise-variance", type=NOT_NEGATIVE, help="Variance of the noise on x (m²), y (m²) and yaw (rad²)."
)
@click.option("--noise-xy-sd", "noise_xy_sd_m", type=NOT_NEGATIVE, help="Standard deviation on x and y in m.")
@click.option(
    "--noise-yaw-sd", "noise_yaw_sd_rad", type=NOT_NEGATIVE, help="Standard deviation on yaw in rad."
)
@click.option(
    "--noise-effort-sd", "noise_effort_sd_nm", type=NOT_NEGATIVE, help="Standard deviation on torques in N·m."
)
@click.option(
    "--noise-wheel-speed-sd",
    "noise_wheel_speed_sd_radps",
    type=NOT_NEGATIVE,
    help="Standard deviation on wheel speeds in rad/s.",
)
@click.option(
    "--jitter", "jitter_s", type=NOT_NEGATIVE, help="Standard deviation of the sampling instants in s."
)
@click.option("--dropout", type=click.FloatRange(0, 0.99), help="Share of the messages lost.")
@click.option(
    "--clock-offset",
    "clock_offset_s",
    type=float,
    help="Torque stamps ahead of the pose's clock by this, in s.",
)
@click.option(
    "--robot",
    "robot_path",
    type=click.Path(path_type=Path, dir_okay=False),
    help="TOML file with a [robot] table.  [default: the paper's robot]",
)
@click.option(
    "--encoding", type=click.Choice(["ros2", "protobuf", "json"]), default="ros2", show_default=True
)
@click.option(
    "--no-truth", is_flag=True, help="Leave out the true mode and the side files (old ones are removed)."
)
@click.option("--json", "as_json", is_flag=True, help="Say what was written, or the list, as JSON.")
def command(  # noqa: PLR0917
    scenario: str | None,
    listing: bool,
    out: Path | None,
    seed: int,
    duration_s: float | None,
    noise_variance: float | None,
    robot_path: Path | None,
    encoding: str,
    no_truth: bool,
    as_json: bool,
    **sensor_options: float | None,
) -> None:
    """Write a synthetic log of SCENARIO as MCAP, and the truth beside it.

    Beside FILE.mcap stand FILE.truth.json (scenario, options, parameters) and FILE.truth.parquet (the
    noise-free motion), which `run` uses for scoring only.
    """
    if listing:
        show_list(as_json)
        return
    if scenario is None:
        raise click.UsageError("which SCENARIO? `wmr-replay synth --list` names them")
    from wmr_synth import record, synthesise
    from wmr_synth.synthesis import find_scenario

    chosen = find_scenario(scenario)
    if out is None:
        raise click.UsageError(f"where to? For example: wmr-replay synth {scenario} --out {scenario}.mcap")
    check_target(out)
    sensors = changed_sensors(chosen, noise_variance, sensor_options)
    robot = PAPER_ROBOT if robot_path is None else read_robot(robot_path)
    simulated = synthesise(chosen, seed=seed, duration_s=duration_s, sensors=sensors, robot=robot)
    n_messages = len(simulated.log.pose) + (len(simulated.log.torque) if simulated.log.torque else 0)
    try:
        with progress_bar(n_messages) as progress:
            paths = record(simulated, out, encoding=encoding, truth=not no_truth, progress=progress)
    except OSError as error:
        raise InvalidSetting(f"--out {out}: cannot be written ({error.strerror})") from None
    report(chosen.name, seed, paths, simulated.facts, n_messages, as_json)


def show_list(as_json: bool) -> None:
    """Name and description of every scenario."""
    from wmr_synth import SCENARIOS

    if as_json:
        rows = [
            {
                "name": s.name,
                "description": s.description,
                "duration_s": s.duration_s,
                "rate_hz": s.sensors.rate_hz,
            }
            for s in SCENARIOS.values()
        ]
        echo_json(rows)
        return
    width = max(map(len, SCENARIOS))
    for entry in SCENARIOS.values():
        click.echo(f"{entry.name:{width}}  {entry.duration_s:4.0f} s  {entry.description}")


def changed_sensors(
    scenario: "Scenario", noise_variance: float | None, options: dict[str, float | None]
) -> "Sensors":
    """The scenario's sensors with the options given on the command line."""
    changes = {name: value for name, value in options.items() if value is not None}
    if noise_variance is not None:
        clash = [name for name in ("noise_xy_sd_m", "noise_yaw_sd_rad") if name in changes]
        if clash:
            raise click.UsageError(
                "--noise-variance already sets the noise of x, y and yaw; give it or the …-sd options"
            )
        changes["noise_xy_sd_m"] = changes["noise_yaw_sd_rad"] = noise_variance**0.5
    return replace(scenario.sensors, **changes)


def read_robot(path: Path) -> RobotParameters:
    """The [robot] table of a robot, model or mapping file, without the standard deviations in it."""
    tables = read_toml(path)
    if "robot" not in tables:
        raise InvalidFile(path, "[robot]", "missing; the simulator needs the robot's parameters")
    values, _ = split_sd(path, "[robot]", expect_table(path, "[robot]", tables["robot"]))
    return RobotParameters.from_values(values, str(path))


def check_target(out: Path) -> None:
    """The file can be written where it was asked for."""
    if not out.parent.is_dir():
        raise InvalidSetting(f"--out {out}: there is no directory {out.parent}; create it first")


@contextlib.contextmanager
def progress_bar(n_messages: int) -> Iterator[Callable[[int, int], None] | None]:
    """A bar on standard error for long work at a terminal; nothing otherwise."""
    if n_messages < LONG_LOG_MESSAGES or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("writing", total=n_messages)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def report(
    name: str, seed: int, paths: tuple[Path, ...], facts: dict[str, Any], n_messages: int, as_json: bool
) -> None:
    """What was written, for a person or a machine."""
    if as_json:
        echo_json({"files": [str(path) for path in paths], "messages": n_messages, **facts})
        return
    beside = f" (and {', '.join(path.name for path in paths[1:])})" if len(paths) > 1 else ""
    click.echo(
        f"wrote {paths[0]}{beside}: {name}, seed {seed}, {facts['duration_s']:g} s, {n_messages} messages"
    )
    click.echo(f"next: wmr-replay run {paths[0]}")


def echo_json(content: object) -> None:
    """One JSON document on standard output."""
    import json

    click.echo(json.dumps(content, indent=2, ensure_ascii=False))

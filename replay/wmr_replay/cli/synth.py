"""``wmr-replay synth``: write a synthetic log."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

from wmr_replay.cli.synth_list import echo_json, show
from wmr_replay.cli.synth_world import (
    NOISE_NAMES,
    Beyond,
    chosen_robot,
    chosen_sensors,
    chosen_world,
)
from wmr_schemas.errors import InvalidSetting

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
  wmr-replay synth patrol --hide viscous_drag:c1_per_s=.2 --noise rtk --out drag.mcap
  wmr-replay synth patrol --hide payload --hide slope --seed 3 --no-truth-topic --out two.mcap
  wmr-replay synth patrol --model drag.model.toml --out extended.mcap
""",
)
@click.argument("scenario", required=False)
@click.option("--list", "listing", is_flag=True, help="List the scenarios and leave.")
@click.option("--list-effects", "effect_listing", is_flag=True, help="List what --hide can hide and leave.")
@click.option(
    "--hide",
    multiple=True,
    metavar="NAME[:PARAM=VALUE,...]",
    help="An effect that stands in the side files only; a bare name draws its size. Repeatable.",
)
@click.option(
    "--model",
    "model_path",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Robot, effects (in the candidates' form) and noise of a model file.",
)
@click.option(
    "--disturbance",
    metavar="SD:TAU|none",
    help="Coloured disturbance in m/s² and s on every channel.  [default: the model's or the scenario's]",
)
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
    "--noise",
    type=click.Choice(NOISE_NAMES),
    help="Pose noise: 1 mm and 2 mrad, 1 cm and 5 mrad, or 5 cm and 20 mrad.",
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
    help="TOML file with a [robot] table; fills in what --model lacks.  [default: the scenario's robot]",
)
@click.option(
    "--encoding", type=click.Choice(["ros2", "protobuf", "json"]), default="ros2", show_default=True
)
@click.option(
    "--no-truth", is_flag=True, help="Leave out the true mode and the side files (old ones are removed)."
)
@click.option(
    "--no-truth-topic", is_flag=True, help="Leave the true mode out of the log, not the side files."
)
@click.option(
    "--wrong-modes",
    type=click.FloatRange(0, 1),
    default=0.0,
    help="Share of the pose samples at which the log's mode is wrong.",
)
@click.option("--json", "as_json", is_flag=True, help="Say what was written, or the list, as JSON.")
def command(  # noqa: PLR0917
    scenario: str | None,
    listing: bool,
    effect_listing: bool,
    hide: tuple[str, ...],
    model_path: Path | None,
    disturbance: str | None,
    out: Path | None,
    seed: int,
    duration_s: float | None,
    noise: str | None,
    noise_variance: float | None,
    robot_path: Path | None,
    encoding: str,
    no_truth: bool,
    no_truth_topic: bool,
    wrong_modes: float,
    as_json: bool,
    **sensor_options: float | None,
) -> None:
    """Write a synthetic log of SCENARIO as MCAP, and the truth beside it.

    Beside FILE.mcap stand FILE.truth.json (scenario, options, parameters) and FILE.truth.parquet (the
    noise-free motion), which `run` uses for scoring only. There, and nowhere else, stands what --hide hid.
    """
    if listing or effect_listing:
        show(listing, as_json)
        return
    if scenario is None:
        raise click.UsageError("which SCENARIO? `wmr-replay synth --list` names them")
    from wmr_synth import record, synthesise
    from wmr_synth.synthesis import find_scenario

    chosen = find_scenario(scenario)
    if out is None:
        raise click.UsageError(f"where to? For example: wmr-replay synth {scenario} --out {scenario}.mcap")
    check_target(out)
    beyond = Beyond(hide, model_path, disturbance)
    model = beyond.read_model()
    robot = chosen_robot(chosen, robot_path, model)
    simulated = synthesise(
        chosen,
        seed=seed,
        duration_s=duration_s,
        sensors=chosen_sensors(chosen, noise, model, noise_variance, sensor_options),
        robot=robot,
        world=chosen_world(beyond, model, chosen, robot, seed, duration_s or chosen.duration_s),
        wrong_modes=wrong_modes,
    )
    n_messages = len(simulated.log.pose) + (len(simulated.log.torque) if simulated.log.torque else 0)
    try:
        with progress_bar(n_messages) as progress:
            paths = record(
                simulated,
                out,
                encoding=encoding,
                truth=not no_truth,
                mode_topic=not no_truth_topic,
                progress=progress,
            )
    except OSError as error:
        raise InvalidSetting(f"--out {out}: cannot be written ({error.strerror})") from None
    report(chosen.name, seed, paths, simulated.facts, n_messages, as_json)


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

"""``wmr-replay synth``: write a synthetic log."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.completion import complete_effect, complete_scenario
from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_replay.api.simulation import SensorArguments
    from wmr_replay.api.synthesise import Commands, Encoding, Noise, Torques

NOISE_NAMES = ("mocap", "rtk", "poor")
POSITIVE = click.FloatRange(min=0, min_open=True)
NOT_NEGATIVE = click.FloatRange(min=0)


@click.command(
    "synth",
    cls=GroupedCommand,
    groups={
        "Sensors": (
            "--rate",
            "--torque-rate",
            "--noise",
            "--noise-variance",
            "--noise-xy-sd",
            "--noise-yaw-sd",
            "--noise-effort-sd",
            "--noise-wheel-speed-sd",
            "--wheel-rate",
            "--encoder-ticks",
            "--command-rate",
            "--commands",
            "--torques",
            "--nominal-error",
            "--jitter",
            "--dropout",
            "--clock-offset",
            "--wrong-modes",
        )
    },
    epilog="""\b
Examples:
  wmr-replay synth --list
  wmr-replay synth paper-acceleration --out demo.mcap
  wmr-replay synth random --seed 7 --duration 600 --rate 200 --out random7.mcap
  wmr-replay synth stop-and-go --noise-xy-sd 0.01 --jitter 0.002 --dropout 0.05 --out rough.mcap
  wmr-replay synth patrol --hide viscous_drag:c1_per_s=.2 --noise rtk --out drag.mcap
  wmr-replay synth patrol --hide payload --hide slope --seed 3 --no-truth-topic --out two.mcap
  wmr-replay synth skid-steer --hide lateral_slip --encoder-ticks 512 --noise rtk --out skid.mcap
  wmr-replay synth patrol --model drag.model.toml --out extended.mcap
""",
)
@click.argument("scenario", required=False, shell_complete=complete_scenario)
@click.option("--list", "listing", is_flag=True, help="List the scenarios and leave.")
@click.option("--list-effects", "effect_listing", is_flag=True, help="List what --hide can hide and leave.")
@click.option(
    "--hide",
    multiple=True,
    shell_complete=complete_effect,
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
@click.option("--wheel-rate", "wheel_rate_hz", type=POSITIVE, help="Encoders' rate in Hz.")
@click.option(
    "--encoder-ticks",
    type=click.IntRange(min=0),
    help="Counts of an encoder in a turn of its wheel; 0: exact.",
)
@click.option("--command-rate", "command_rate_hz", type=POSITIVE, help="Rate of the commands in Hz.")
@click.option(
    "--commands",
    type=click.Choice(["wheels", "twist", "none"]),
    help="Commands as wheel speeds, as a twist, or none.  [default: the scenario's]",
)
@click.option(
    "--torques",
    type=click.Choice(["together", "apart", "none"]),
    help="Torques of a robot by wheel speeds: with these, in a channel of their own, or none.",
)
@click.option("--dropout", type=click.FloatRange(0, 0.99), help="Share of the messages lost.")
@click.option(
    "--clock-offset",
    "clock_offset_s",
    type=float,
    help="Stamps of torques or wheel speeds ahead of the pose's clock by this, in s.",
)
@click.option(
    "--robot",
    "robot_path",
    type=click.Path(path_type=Path, dir_okay=False),
    help="TOML file with a [robot] table; fills in what --model lacks.  [default: the scenario's robot]",
)
@click.option(
    "--nominal-error",
    type=click.FloatRange(0, 0.5, max_open=True),
    help="Share by which the stated lengths of a robot by wheel speeds may be wrong.",
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
    noise: "Noise | None",
    noise_variance: float | None,
    robot_path: Path | None,
    encoding: "Encoding",
    no_truth: bool,
    no_truth_topic: bool,
    wrong_modes: float,
    nominal_error: float | None,
    commands: "Commands | None",
    torques: "Torques | None",
    as_json: bool,
    **sensor_options: float | None,
) -> None:
    """Write a synthetic log of SCENARIO as MCAP, and the truth beside it.

    Beside FILE.mcap stand FILE.truth.json (scenario, options, parameters) and FILE.truth.parquet (the
    noise-free motion), which `run` uses for scoring only. There, and nowhere else, stands what --hide hid.
    """
    if listing or effect_listing:
        from wmr_replay.cli.printing.synth import print_effects, print_scenarios

        print_scenarios(as_json=as_json) if listing else print_effects(as_json=as_json)
        return
    from wmr_replay.api.synthesise import synthesise
    from wmr_replay.cli.printing.progress import message_progress
    from wmr_replay.cli.printing.synth import print_written

    if hide and model_path is not None:
        raise click.UsageError("--hide and --model each say what the effects are; give one of them")
    check_noise(noise, noise_variance, sensor_options)
    scenario, out = checked_target(scenario, out)
    made = synthesise(
        scenario,
        seed=seed,
        duration_s=duration_s,
        hide=hide,
        model=model_path,
        robot=robot_path,
        disturbance=disturbance,
        noise=noise,
        noise_variance=noise_variance,
        wrong_modes=wrong_modes,
        nominal_error=nominal_error,
        commands=commands,
        torques=torques,
        **cast("SensorArguments", sensor_options),
    )
    with message_progress(f"writing {out.name}") as progress:
        paths = made.save(
            out,
            encoding=encoding,
            truth=not no_truth,
            mode_topic=not no_truth_topic,
            progress=progress,
        )
    print_written(made, paths, as_json=as_json)


def check_noise(
    noise: "Noise | None", noise_variance: float | None, sensor_options: Mapping[str, float | None]
) -> None:
    """Raises a usage error where the noise of the pose is given twice."""
    in_sd = any(sensor_options[name] is not None for name in ("noise_xy_sd_m", "noise_yaw_sd_rad"))
    if noise_variance is not None and (noise or in_sd):
        raise click.UsageError(
            "--noise-variance already sets the noise of x, y and yaw; leave out --noise and the …-sd ones"
        )


def checked_target(scenario: str | None, out: Path | None) -> tuple[str, Path]:
    """The scenario and the file, both given and possible. Raises a usage error or InvalidSetting."""
    from wmr_replay.api.synthesise import check_scenario
    from wmr_replay.cli import activity

    if scenario is None:
        raise click.UsageError("which SCENARIO? `wmr-replay synth --list` names them")
    activity.tell(f"simulating {scenario}")
    check_scenario(scenario)
    if out is None:
        raise click.UsageError(f"where to? For example: wmr-replay synth {scenario} --out {scenario}.mcap")
    if not out.parent.is_dir():
        raise InvalidSetting(f"--out {out}: there is no directory {out.parent}; create it first")
    return scenario, out

"""``wmr-replay gap``."""

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.completion import complete_modes, list_of
from wmr_replay.cli.options.mapping import blind_options, log_options
from wmr_replay.cli.options.settings import CLOCK_OFFSET, model_option
from wmr_replay.cli.options.viewing import Viewing, viewing_options
from wmr_schemas.text import encodable

F = TypeVar("F", bound=Callable[..., Any])
VERDICTS = ("named", "ambiguous", "unnamed", "nothing_missing", "not_enough_excitation")
EXIT_CHECK_FAILED = 1
MODES_OPTION = click.option(
    "--modes",
    metavar="identified|ideal|topic:T",
    shell_complete=complete_modes,
    default="identified",
    help="Contact modes: estimated, ideal throughout, or those on topic T.",
)


def base_option(*bases: str) -> Callable[[F], F]:
    """--base with these choices, and auto."""
    return click.option(
        "--base",
        type=click.Choice(["auto", *bases]),
        default="auto",
        help="What drives the base model; auto: torques where the log has them, else wheel speeds.",
    )


BASE_OPTION = base_option("torque", "wheel-speed", "both")


@click.command("gap", cls=GroupedCommand)
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@model_option("Base model (model.toml); else the log's own parameters; else calibrated on the log.")
@click.option(
    "--base-log",
    type=click.Path(path_type=Path),
    metavar="LOG",
    help="In place of a model: a simulator's log; what it shows is the base model.",
)
@click.option(
    "--prove-on",
    type=click.Path(path_type=Path),
    metavar="LOG",
    help="Another log of the robot, never fitted: simulate base and extended model on it, too.",
)
@BASE_OPTION
@click.option(
    "--input",
    "inputs",
    type=click.Choice(["measured", "commands"]),
    default="measured",
    help="Which wheel speeds drive the model of --base wheel-speed.",
)
@MODES_OPTION
@click.option(
    "--tolerance",
    metavar="MM:S",
    default="3:4",
    help="An effect counts when it moves the simulated path by more than MM millimetres in S seconds.",
)
@click.option(
    "--max-effects",
    type=click.IntRange(1, 12),
    help="Most effects looked for.  [default: 3 on torques, 8 on wheel speeds]",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of the placebo logs.")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Results go here, not to ./<stem>.wmr/."
)
@click.option("--json", "as_json", is_flag=True, help="Print gap.json.")
@click.option(
    "--fail-on",
    metavar="VERDICT,…",
    shell_complete=list_of(VERDICTS),
    default="",
    help=f"Exit with 1 on these verdicts, of {', '.join(VERDICTS)}.",
)
@click.option("--force", is_flag=True, help="Replace results of another log of the same name.")
@click.option("--no-rrd", is_flag=True, help="Write no Rerun timeline; one of an earlier analysis goes.")
@click.option("--report", is_flag=True, help="Write a report too: one HTML file to mail (extra report).")
@CLOCK_OFFSET
@blind_options
@viewing_options
def command(  # noqa: PLR0917
    logs: tuple[Path, ...],
    model_file: Path | None,
    base_log: Path | None,
    prove_on: Path | None,
    base: str,
    inputs: str,
    modes: str,
    tolerance: str,
    max_effects: int | None,
    seed: int,
    out: Path | None,
    as_json: bool,
    fail_on: str,
    no_rrd: bool,
    report: bool,
    force: bool,
    **options: Any,
) -> None:
    """Say where simulation and measurement of LOG disagree, what the model lacks, and what adding it brings.

    Simulates the log's own torques, or where it has none its wheel speeds, names the missing effect where
    the log allows it, and proves it on a part of the log that was not fitted. Writes <stem>.gap.json,
    <stem>.gap.rrd and the extended <stem>.model.toml.

    \b
    Examples:
      wmr-replay gap log.mcap
      wmr-replay gap log.mcap --model robot.model.toml --tolerance 5:4
      wmr-replay gap log.mcap --modes topic:/ground_truth/mode --fail-on named,ambiguous,unnamed
      wmr-replay gap second.mcap --model log.wmr/log.model.toml     # is anything missing still?
      wmr-replay gap log.mcap --prove-on second.mcap --report       # does the model hold elsewhere?
      wmr-replay gap real.mcap --base-log simulated.mcap            # what does my simulator lack?
      wmr-replay gap encoders.mcap                                  # no torques: wheel speeds drive the model
      wmr-replay gap encoders.mcap --input commands                 # lag, delay and gains of the drive, too
    """
    from wmr_replay.api.gap import gap
    from wmr_replay.cli.printing.gap import print_both, print_gap
    from wmr_replay.cli.printing.progress import share_progress

    viewing = Viewing.of(options, no_rrd=no_rrd)
    failing, (tolerance_m, tolerance_s) = verdicts_of(fail_on), tolerance_of(tolerance)
    log = logs[0]
    with share_progress(f"reading {log.name}") as progress:
        found = gap(
            list(logs),
            out or encodable(f"{log.stem}.wmr"),
            model=model_file,
            base_log=base_log,
            prove_on=prove_on,
            base=base,
            inputs=inputs,
            modes=modes,
            tolerance_m=tolerance_m,
            tolerance_s=tolerance_s,
            max_effects=max_effects,
            seed=seed,
            timeline=not no_rrd,
            report=report,
            force=force,
            command=command_line(),
            progress=progress,
            clock_offset_s=options.pop("clock_offset_s"),
            **log_options(options),
        )
    print_gap(found, log, as_json=as_json)
    if found.also is not None and not as_json:
        print_gap(found.also, log, as_json=False)
        print_both(found.document)
    if "timeline" in found.files:
        viewing.show(found.files["timeline"])
    if failing & {answer.verdict for answer in (found, found.also) if answer is not None}:
        sys.exit(EXIT_CHECK_FAILED)


def command_line() -> str:
    """The call of the program, as the model file states it."""
    return shlex.join(["wmr-replay", *sys.argv[1:]])


def tolerance_of(text: str) -> tuple[float, float]:
    """``MM:S`` in m and s."""
    try:
        millimetres, seconds = map(float, text.split(":"))
    except ValueError:
        raise click.BadParameter(
            f"{text!r} is not MILLIMETRES:SECONDS, such as 3:4", param_hint="--tolerance"
        ) from None
    return millimetres / 1000, seconds


def verdicts_of(text: str) -> set[str]:
    """The verdicts of --fail-on."""
    chosen = {name.strip() for name in text.split(",") if name.strip()}
    if unknown := chosen - set(VERDICTS):
        raise click.BadParameter(
            f"no verdict {', '.join(sorted(unknown))}; there are {', '.join(VERDICTS)}",
            param_hint="--fail-on",
        )
    return chosen

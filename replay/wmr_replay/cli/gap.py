"""``wmr-replay gap``."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.mapping import between_from_options, blind_options, mapping_from_options
from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_replay.gap import GapOptions

VERDICTS = ("named", "ambiguous", "unnamed", "nothing_missing", "not_enough_excitation")
TOPIC = "topic:"
EXIT_CHECK_FAILED = 1


@click.command(name="gap")
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "--model",
    "model_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Base model (model.toml); else the log's own parameters; else calibrated on the log.",
)
@click.option(
    "--modes",
    metavar="identified|ideal|topic:T",
    default="identified",
    help="Contact modes: estimated, ideal throughout, or those on topic T.",
)
@click.option(
    "--tolerance",
    metavar="MM:S",
    default="3:4",
    help="An effect counts when it moves the simulated path by more than MM millimetres in S seconds.",
)
@click.option("--max-effects", type=click.IntRange(1, 3), default=3, help="Most effects looked for.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of the placebo logs.")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Results go here, not to ./<stem>.wmr/."
)
@click.option("--json", "as_json", is_flag=True, help="Print gap.json.")
@click.option(
    "--fail-on",
    metavar="VERDICT,…",
    default="",
    help=f"Exit with 1 on these verdicts, of {', '.join(VERDICTS)}.",
)
@click.option("--no-rrd", is_flag=True, help="Write no Rerun timeline.")
@blind_options
def command(  # noqa: PLR0917
    log: Path,
    model_file: Path | None,
    modes: str,
    tolerance: str,
    max_effects: int,
    seed: int,
    out: Path | None,
    as_json: bool,
    fail_on: str,
    no_rrd: bool,
    **mapping: Any,
) -> None:
    """Say where simulation and measurement of LOG disagree, what the model lacks, and what adding it brings.

    Simulates the log's own torques, names the missing effect where the log allows it, and proves it on a part
    of the log that was not fitted. Writes <stem>.gap.json, <stem>.gap.rrd and the extended <stem>.model.toml.

    \b
    Examples:
      wmr-replay gap log.mcap
      wmr-replay gap log.mcap --model robot.model.toml --tolerance 5:4
      wmr-replay gap log.mcap --modes topic:/ground_truth/mode --fail-on named,ambiguous,unnamed
      wmr-replay gap second.mcap --model log.wmr/log.model.toml     # is anything missing still?
    """
    from wmr_replay.cli.gap_report import print_gap
    from wmr_replay.cli.progress import share_progress
    from wmr_replay.jobs.gap import gap_log
    from wmr_schemas.gap_file import gap_to_json
    from wmr_schemas.model_file import read_model

    failing, topic = verdicts_of(fail_on), topic_of(modes)
    options = options_of(modes, tolerance, max_effects, seed)
    keep_base(log, model_file, out)
    with share_progress() as progress:
        run = gap_log(
            log,
            out,
            base=read_model(model_file) if model_file else None,
            options=options,
            mode_topic=topic,
            mapping=mapping_from_options(mapping),
            between=between_from_options(mapping),
            timeline=not no_rrd,
            command=shlex.join(["wmr-replay", *sys.argv[1:]]),
            progress=progress,
        )
    if as_json:
        click.echo(gap_to_json(run.document), nl=False)
    else:
        print_gap(run, log)
    if run.document.verdict in failing:
        sys.exit(EXIT_CHECK_FAILED)


def options_of(modes: str, tolerance: str, max_effects: int, seed: int) -> "GapOptions":
    """The options, checked. Raises InvalidSetting."""
    from wmr_replay.gap.options import GapOptions

    source = "given" if modes.startswith(TOPIC) else modes
    tolerance_m, tolerance_s = tolerance_of(tolerance)
    return GapOptions(source, tolerance_m, tolerance_s, max_effects, seed)


def topic_of(modes: str) -> str | None:
    """The topic of ``topic:T``."""
    topic = modes.removeprefix(TOPIC) if modes.startswith(TOPIC) else None
    if topic == "" or modes == "given":
        raise click.BadParameter("a topic is named as topic:/its/name", param_hint="--modes")
    return topic


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


def keep_base(log: Path, model_file: Path | None, out: Path | None) -> None:
    """Raises InvalidSetting where the extended model would take the place of the base model's file."""
    from wmr_replay.jobs.run import default_directory

    target = (out or default_directory(log)) / f"{log.stem}.model.toml"
    if model_file is not None and target.exists() and target.samefile(model_file):
        raise InvalidSetting(
            f"the extended model would overwrite its base, {model_file}; choose another place with --out DIR"
        )

"""``wmr-replay check``: replay as a regression test."""

import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.completion import complete_metric
from wmr_replay.cli.options.mapping import log_options, mapping_options
from wmr_replay.cli.options.settings import NAMES, model_option, settings_from_options, settings_options

if TYPE_CHECKING:
    from wmr_replay.api.check import Check
    from wmr_replay.api.request import SettingsArguments

FILE = click.Path(path_type=Path, dir_okay=False)
REPLAY_OPTIONS = (*NAMES, "model_file", "pose", "torque", "truth", "map", "clock", "start", "end", "every")
"""Options that decide what is stored: the command that accepts a reference repeats them."""


@click.command(
    "check",
    cls=GroupedCommand,
    epilog="""\b
Examples:
  wmr-replay check references/ logs/ --update        store the references
  wmr-replay check references/ logs/                 has any answer changed?
  wmr-replay check references/ a.mcap --diff a.parquet --junit report.xml
  wmr-replay check --criteria criteria.toml logs/    bounds instead of references
  wmr-replay check --require 'accuracy >= .9' logs/  the same without a file
""",
)
@click.argument("paths", metavar="[REFERENCE_DIR] LOGS...", nargs=-1, type=click.Path(path_type=Path))
@click.option("--criteria", type=FILE, help='Bounds on summary columns (TOML): accuracy = ">= .93".')
@click.option(
    "--require",
    metavar="'METRIC >= N'",
    multiple=True,
    shell_complete=complete_metric,
    help="A bound on a summary column, as in --criteria; repeatable.",
)
@click.option("--update", is_flag=True, help="Store what differs, or has no reference, as the reference.")
@click.option(
    "--every",
    type=click.IntRange(min=1),
    help="With --update: keep every N-th row of samples; the others are then not compared.  "
    "[default: as stored, else 1]",
)
@click.option("--diff", "diff_file", type=FILE, help="Every value beyond tolerance: .parquet, else text.")
@click.option("--junit", "junit_file", type=FILE, help="The outcome as JUnit XML.")
@click.option("--jobs", type=click.IntRange(min=1), default=1, help="Logs replayed at the same time.")
@click.option("--json", "as_json", is_flag=True, help="The outcome as JSON on standard output.")
@model_option("Model file, instead of the reference's.")
@mapping_options
@settings_options
@click.pass_context
def command(  # noqa: PLR0917
    ctx: click.Context,
    /,
    paths: tuple[Path, ...],
    criteria: Path | None,
    require: tuple[str, ...],
    update: bool,
    every: int | None,
    diff_file: Path | None,
    junit_file: Path | None,
    jobs: int,
    as_json: bool,
    model_file: Path | None,
    **options: Any,
) -> None:
    """Replay LOGS and compare the tables with those stored in REFERENCE_DIR.

    LOGS are files, bags or directories of them; a reference belongs to the log of its name. A log is
    replayed with the settings that its reference was made with; options given here stand above them. Types
    and counts are compared first, then every value, within max(abs, rel·|reference|) of its column; a
    tolerances.toml in REFERENCE_DIR changes the defaults. With --criteria, bounds on the summary are held
    instead, or beside references when REFERENCE_DIR holds any.

    Exit code: 0 all passed, 1 a check failed, 2 usage, 3 a log cannot be used and nothing else failed.
    """
    from wmr_replay.api.check import check
    from wmr_replay.cli.printing.check import print_check
    from wmr_replay.cli.printing.progress import AGAIN, byte_progress

    references, logs = split_paths(paths, criteria is not None or bool(require), update)
    whole: dict[str, Any] = {**log_options(options), **settings_from_options(options), "model": model_file}
    own = without_project(ctx, {**options, "model_file": model_file})
    settings = {
        name: value for name, value in settings_from_options(options).items() if name not in project(ctx)
    }
    found = check(
        references,
        logs,
        criteria=criteria,
        require=require,
        update=update,
        every=every,
        model=own["model_file"],
        watch=lambda log: byte_progress(f"replaying {log}", AGAIN),
        jobs=jobs,
        unreferenced=whole,
        **log_options(own),
        **cast("SettingsArguments", settings),
    )
    found = replace(found, accept=accepting_command(ctx, references, found))
    if diff_file is not None:
        found.write_differences(diff_file)
    if junit_file is not None:
        found.write_junit(junit_file)
    print_check(found, diff_file, as_json=as_json)
    sys.exit(exit_code(found))


def split_paths(
    paths: Sequence[Path], has_criteria: bool, update: bool
) -> tuple[Path | None, Sequence[Path]]:
    """The directory of the references and the logs; with criteria the directory may be left out."""
    from wmr_replay.api.check import check_folder, holds_references

    if not paths:
        raise click.UsageError("which logs? For example: wmr-replay check references/ logs/")
    first, rest = paths[0], paths[1:]
    if has_criteria and not update and not holds_references(first):
        return None, paths
    if not rest:
        raise click.UsageError(f"which logs? {first} is taken for the directory of the references")
    if first.exists() and not first.is_dir():
        raise click.UsageError(f"{first} is no directory of references; name that first, then the logs")
    check_folder(first, update=update, has_criteria=has_criteria)
    return first, rest


def project(ctx: click.Context) -> set[str]:
    """Parameters whose value comes from the project's file. A reference's own settings stand above those."""
    from wmr_replay.cli.config.apply import FROM_PROJECT

    named: set[str] = ctx.meta.get(FROM_PROJECT, set())
    return {name for name in named if not is_given(ctx, name)}


def without_project(ctx: click.Context, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options without what the project's file says."""
    left_out = project(ctx)
    return {name: None if name in left_out else value for name, value in options.items()}


def is_given(ctx: click.Context, name: str) -> bool:
    """Whether the option stands on the command line."""
    return ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def accepting_command(ctx: click.Context, references: Path | None, found: "Check") -> str | None:
    """The command that makes references of what differs now; None where nothing could be accepted."""
    if references is None or not found.acceptable:
        return None
    words = ["wmr-replay", "check", str(references), *map(str, found.acceptable), "--update"]
    for parameter in ctx.command.params:
        name = parameter.name or ""
        if name in REPLAY_OPTIONS and is_given(ctx, name):
            value = ctx.params[name]
            words += [parameter.opts[-1]] if value is True else [parameter.opts[-1], str(value)]
    return shlex.join(words)


def exit_code(found: "Check") -> int:
    """0 when all passed; 3 when what failed are logs that cannot be used alone, else 1."""
    from wmr_replay.cli import EXIT_CHECK_FAILED, EXIT_LOG_UNUSABLE

    if found.passed:
        return 0
    return EXIT_LOG_UNUSABLE if found.unusable else EXIT_CHECK_FAILED

"""``wmr-replay check``: replay as a regression test."""

import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.mapping import between_from_options, mapping_from_options, mapping_options
from wmr_replay.cli.tuning import NAMES, settings_options
from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_replay.regress.check import Checker, LogCheck
    from wmr_replay.regress.replayed import Asked

FILE = click.Path(path_type=Path, dir_okay=False)
REPLAY_OPTIONS = (*NAMES, "model_file", "pose", "torque", "truth", "map", "clock", "start", "end", "every")
"""Options that decide what is stored: the command that accepts a reference repeats them."""


@click.command(
    "check",
    epilog="""\b
Examples:
  wmr-replay check references/ logs/ --update        store the references
  wmr-replay check references/ logs/                 has any answer changed?
  wmr-replay check references/ a.mcap --diff a.parquet --junit report.xml
  wmr-replay check --criteria criteria.toml logs/    bounds instead of references
""",
)
@click.argument("paths", metavar="[REFERENCE_DIR] LOGS...", nargs=-1, type=click.Path(path_type=Path))
@click.option("--criteria", type=FILE, help='Bounds on summary columns (TOML): accuracy = ">= .93".')
@click.option("--update", is_flag=True, help="Store what differs, or has no reference, as the reference.")
@click.option(
    "--every",
    type=click.IntRange(min=1),
    help="With --update: keep every N-th row of samples; the others are then not compared.  "
    "[default: as stored, else 1]",
)
@click.option("--diff", "diff_file", type=FILE, help="Every value beyond tolerance: .parquet, else text.")
@click.option("--junit", "junit_file", type=FILE, help="The outcome as JUnit XML.")
@click.option("--json", "as_json", is_flag=True, help="The outcome as JSON on standard output.")
@click.option(
    "--model",
    "model_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Model file, instead of the reference's.",
)
@mapping_options
@settings_options
@click.pass_context
def command(
    ctx: click.Context,
    /,
    paths: tuple[Path, ...],
    criteria: Path | None,
    update: bool,
    every: int | None,
    diff_file: Path | None,
    junit_file: Path | None,
    as_json: bool,
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
    from wmr_replay.cli.logs import find_logs
    from wmr_replay.regress.check import Checker
    from wmr_replay.regress.criteria import read_criteria

    references, given = split_paths(paths, criteria is not None, update)
    logs = find_logs(given)
    bounds = read_criteria(criteria) if criteria else ()
    checker = Checker.of(references, bounds, asking(ctx, options), update=update, every=every)
    checks = [check_log(checker, log) for log in logs]
    accept = accepting_command(ctx, references, checks)
    missing = checker.missing(logs)
    write_files(checks, missing, accept, diff_file, junit_file)
    if as_json:
        from wmr_replay.cli.synth_list import echo_json
        from wmr_replay.regress.report import check_json

        echo_json(check_json(checks, missing, accept))
    else:
        show(checks, missing, accept, diff_file)
    sys.exit(exit_code(checks))


def split_paths(
    paths: Sequence[Path], has_criteria: bool, update: bool
) -> tuple[Path | None, Sequence[Path]]:
    """The directory of the references and the logs; with criteria the directory may be left out."""
    from wmr_replay.regress.results import stems

    if not paths:
        raise click.UsageError("which logs? For example: wmr-replay check references/ logs/")
    first, rest = paths[0], paths[1:]
    if has_criteria and not update and not (first.is_dir() and stems(first)):
        return None, paths
    if not rest:
        raise click.UsageError(f"which logs? {first} is taken for the directory of the references")
    if first.exists() and not first.is_dir():
        raise click.UsageError(f"{first} is no directory of references; name that first, then the logs")
    if not update and not first.is_dir():
        raise InvalidSetting(
            f"{first}: there is no such directory; `--update` makes one of what is found now"
        )
    return first, rest


def asking(ctx: click.Context, options: Mapping[str, Any]) -> Callable[["Asked"], "Asked"]:
    """What the options given on the command line change of a reference's request."""
    from wmr_schemas.mapping_file import LogMapping
    from wmr_schemas.model_file import read_model

    changes = {name: options[name] for name in NAMES if is_given(ctx, name)}
    mapping, between = mapping_from_options(options), between_from_options(options)
    model = read_model(options["model_file"]) if options["model_file"] else None
    return lambda asked: asked.changed(
        changes, None if mapping == LogMapping() else mapping, between or None, model
    )


def is_given(ctx: click.Context, name: str) -> bool:
    """Whether the user said it."""
    return ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def check_log(checker: "Checker", log: Path) -> "LogCheck":
    """One log, with a progress bar."""
    from wmr_replay.cli.progress import byte_progress

    with byte_progress(f"replaying {log.name}") as progress:
        return checker.check(log, progress)


def accepting_command(
    ctx: click.Context, references: Path | None, checks: Sequence["LogCheck"]
) -> str | None:
    """The command that makes references of what differs now; None where nothing could be accepted."""
    logs = [check.log for check in checks if not (check.unusable or check.same or check.accepted)]
    if references is None or not logs:
        return None
    words = ["wmr-replay", "check", str(references), *map(str, logs), "--update"]
    for parameter in ctx.command.params:
        name = parameter.name or ""
        if name in REPLAY_OPTIONS and is_given(ctx, name):
            value = ctx.params[name]
            words += [parameter.opts[-1]] if value is True else [parameter.opts[-1], str(value)]
    return shlex.join(words)


def write_files(
    checks: Sequence["LogCheck"],
    missing: Sequence[str],
    accept: str | None,
    diff_file: Path | None,
    junit_file: Path | None,
) -> None:
    """The diff and the JUnit report, where they were asked for."""
    from wmr_replay.regress.files import write_diff, write_text
    from wmr_replay.regress.report import junit_xml

    try:
        if diff_file is not None:
            write_diff(diff_file, checks)
        if junit_file is not None:
            write_text(junit_file, junit_xml(checks, missing, accept))
    except OSError as error:
        raise InvalidSetting(f"{error.filename or ''}: cannot be written ({error.strerror})") from None


def show(
    checks: Sequence["LogCheck"], missing: Sequence[str], accept: str | None, diff_file: Path | None
) -> None:
    """The short summary, and what to do when the change was meant."""
    from wmr_replay.regress.report import check_lines

    for check in checks:
        for line in check_lines(check):
            click.echo(line)
    for stem in missing:
        click.echo(f"{stem}: not checked, its log was not given")
    n_passed = sum(check.passed for check in checks)
    click.echo(f"{n_passed} of {len(checks)} logs passed")
    if accept is not None:
        if diff_file is not None:
            click.echo(f"every difference: {diff_file}")
        click.echo(f"if the change is meant, accept it:\n  {accept}")


def exit_code(checks: Sequence["LogCheck"]) -> int:
    """0 when all passed; 3 when what failed are logs beyond use alone, else 1."""
    from wmr_replay.cli import EXIT_CHECK_FAILED, EXIT_LOG_UNUSABLE

    failed = [check for check in checks if not check.passed]
    if not failed:
        return 0
    return EXIT_LOG_UNUSABLE if all(check.unusable for check in failed) else EXIT_CHECK_FAILED

"""Options that every command has: --config, --quiet and --verbose."""

from pathlib import Path

import click

from wmr_replay.cli.verbosity import Level, speak


def read_files(ctx: click.Context, _: click.Parameter, path: Path | None) -> None:
    """Make the options of the project's file and of --config the defaults of this call."""
    if not ctx.resilient_parsing:
        from wmr_replay.cli.config.apply import apply_files

        apply_files(ctx, path)


def speak_at(level: Level, given: bool) -> None:
    """Set the level where its option is given."""
    if given:
        speak(level)


def common_options() -> list[click.Option]:
    """--config, --quiet, --verbose."""
    return [
        click.Option(
            ["--config"],
            type=click.Path(exists=True, dir_okay=False, path_type=Path),
            is_eager=True,
            expose_value=False,
            callback=read_files,
            help="Options from a TOML file, or from a result: <stem>.summary.json, <stem>.gap.json, "
            "<stem>.model.toml of a fit.",
        ),
        click.Option(
            ["-q", "--quiet"],
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=lambda _ctx, _param, given: speak_at(Level.QUIET, given),
            help="Print nothing but errors, what --json prints, and the address of --serve.",
        ),
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=lambda _ctx, _param, given: speak_at(Level.VERBOSE, given),
            help="Say on standard error what is being done, and the time it takes.",
        ),
    ]

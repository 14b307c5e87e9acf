"""``wmr-replay compare``."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.completion import complete_setting
from wmr_replay.cli.options.viewing import Viewing, viewing_options
from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_replay.api.request import SettingsArguments

WHOLE = ("degree", "kappa", "mu")


@click.command(
    "compare",
    cls=GroupedCommand,
    epilog="""\b
Examples:
  wmr-replay compare before/ after/                        two directories of results
  wmr-replay compare monday.mcap tuesday.mcap              two logs
  wmr-replay compare drive.mcap --set-b identifier=paper   one log, two settings
  wmr-replay compare drive.mcap --set-a window_s=.5 --set-b window_s=1 --out windows/
""",
)
@click.argument("a", type=click.Path(path_type=Path, exists=True))
@click.argument("b", type=click.Path(path_type=Path, exists=True), required=False)
@click.option(
    "--set-a",
    metavar="NAME=VALUE",
    multiple=True,
    shell_complete=complete_setting,
    help="A setting of A's replay; repeatable.",
)
@click.option(
    "--set-b",
    metavar="NAME=VALUE",
    multiple=True,
    shell_complete=complete_setting,
    help="The same of B's.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("compare.wmr"),
    help="Directory of <name>.compare.rrd and <name>.compare.json.",
)
@click.option("--force", is_flag=True, help="Replace the comparison of another pair of the same name.")
@click.option("--no-rrd", is_flag=True, help="Write no Rerun timeline; one of an earlier comparison goes.")
@click.option(
    "--report", is_flag=True, help="Write <name>.compare.html too: one HTML file to mail (extra report)."
)
@click.option("--json", "as_json", is_flag=True, help="The differences as JSON.")
@viewing_options
def command(  # noqa: PLR0917
    a: Path,
    b: Path | None,
    set_a: tuple[str, ...],
    set_b: tuple[str, ...],
    out: Path,
    no_rrd: bool,
    report: bool,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Show what differs between A and B.

    Each is a directory of results, a log, or a directory of logs, which are replayed. Without B, A is
    compared with itself under other settings: those of summary.settings, as for `run`. Results of several
    logs are paired by name. Prints the summary's fields that differ, the share of rows with another mode, and
    the largest and root-mean-square difference of each column; both timelines go into one recording.
    """
    if b is None and set_a == set_b:
        raise click.UsageError("compare with what? Name B, or another setting: --set-b identifier=paper")
    viewing = Viewing.of(options, no_rrd=no_rrd)
    from wmr_replay.api.compare import compare_all
    from wmr_replay.cli.printing.compare import print_comparisons
    from wmr_replay.cli.printing.progress import AGAIN, byte_progress

    comparisons, lonely = compare_all(
        a,
        b,
        settings_a=parse_settings(set_a),
        settings_b=parse_settings(set_b),
        out=out,
        timeline=not no_rrd,
        report=report,
        force=force,
        watch=lambda log: byte_progress(f"replaying {log}", AGAIN),
    )
    print_comparisons(comparisons, lonely, out, as_json=as_json)
    drawn = [comparison.files["timeline"] for comparison in comparisons if "timeline" in comparison.files]
    viewing.show(*drawn)


def parse_settings(texts: Sequence[str]) -> "SettingsArguments":
    """The settings of --set-a or --set-b."""
    return cast("SettingsArguments", dict(map(parse_setting, texts)))


def parse_setting(text: str) -> tuple[str, Any]:
    """``NAME=VALUE`` of :class:`~wmr_replay.pipeline.settings.Settings`; the value as in TOML, or a word."""
    from wmr_replay.api.request import SettingsArguments

    name, equals, value = (part.strip() for part in text.partition("="))
    known = list(SettingsArguments.__annotations__)
    if name not in known or not equals or not value:
        raise InvalidSetting(f"{text!r} is no NAME=VALUE of a setting; the settings are {', '.join(known)}")
    try:
        parsed = json.loads(value) if value in {"true", "false"} else float(value)
    except ValueError:
        return name, value
    return name, int(parsed) if isinstance(parsed, float) and name in WHOLE else parsed

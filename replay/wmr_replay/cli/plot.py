"""``wmr-replay plot``."""

from pathlib import Path

import click

from wmr_replay.cli.help import GroupedCommand


@click.command("plot", cls=GroupedCommand)
@click.argument("result", type=click.Path(path_type=Path, exists=True))
@click.option(
    "-o",
    "--out",
    "target",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="The picture; its ending names the format: .png, .pdf or .svg.",
)
def command(result: Path, target: Path) -> None:
    """Draw a stored RESULT for papers and slides (extra plot).

    RESULT is a directory of results, or a file in it: <stem>.summary.parquet for a replay, <stem>.gap.json
    for a gap analysis.

    \b
    Examples:
      wmr-replay plot log.wmr/ -o log.pdf
      wmr-replay plot log.wmr/log.gap.json -o gap.svg
    """
    from wmr_replay.api.stored import plot
    from wmr_replay.cli.printing.plain import say

    plot(result, target)
    say(f"wrote {target}")

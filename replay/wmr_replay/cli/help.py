"""Help pages: options in groups, as wide as the terminal allows."""

import sys
from collections.abc import Iterable
from typing import Any

import click

from wmr_replay.cli.activity import activity
from wmr_replay.cli.options.common import common_options
from wmr_replay.cli.options.groups import REST, groups_with
from wmr_replay.cli.streams import writable
from wmr_replay.cli.verbosity import is_quiet, is_verbose, unheard

MOST_COLUMNS = 100
"""Longer lines are hard to read."""
NARROW, WIDE_TERM, NARROW_TERM = 68, 30, 22
"""Pages of fewer columns than the first leave the names of options less room."""

Row = tuple[str, str]


class GroupedCommand(click.Command):
    """A command whose help shows its options in the groups of :mod:`wmr_replay.cli.options.groups`.

    ``groups``: further groups of this command alone, by heading the long names of their options.
    """

    def __init__(self, *args: Any, groups: dict[str, tuple[str, ...]] | None = None, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.params += common_options()
        self.groups = groups_with(groups or {})

    def invoke(self, ctx: click.Context) -> Any:
        """Do the work; under --quiet unheard, but for errors, JSON and addresses."""
        if not is_quiet():
            if is_verbose():
                say_files(ctx)
            with activity():
                return super().invoke(ctx)
        with unheard(json=bool(ctx.params.get("as_json"))):
            return super().invoke(ctx)

    def get_help(self, ctx: click.Context) -> str:
        """The page, in characters that standard output has."""
        return writable(super().get_help(ctx))

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options, a section for each group that has any."""
        grouped = self.grouped_rows(ctx)
        for heading, rows in aligned(grouped, formatter.width).items():
            with formatter.section(heading):
                formatter.write_dl(rows, col_max=term_columns(formatter.width))

    def grouped_rows(self, ctx: click.Context) -> dict[str, list[Row]]:
        """The rows of each group in its order; groups without any are left out."""
        places = {
            option: (heading, place)
            for heading, options in self.groups.items()
            for place, option in enumerate(options)
        }
        found: dict[str, list[tuple[int, Row]]] = {heading: [] for heading in self.groups}
        for param in self.get_params(ctx):
            record = None if isinstance(param, click.Argument) else param.get_help_record(ctx)
            if record is not None:
                heading, place = place_of(param.opts, places)
                found[heading].append((place, record))
        return {
            heading: [row for _, row in sorted(rows, key=lambda placed: placed[0])]
            for heading, rows in found.items()
            if rows
        }


def say_files(ctx: click.Context) -> None:
    """The files that options of this call come from, on standard error."""
    from wmr_replay.cli.config.apply import files_said

    for line in files_said(ctx):
        print(line, file=sys.stderr)


def place_of(names: Iterable[str], places: dict[str, tuple[str, int]]) -> tuple[str, int]:
    """Group and place of an option by its names; behind all others of the last resort where it has none."""
    return next((places[name] for name in names if name in places), (REST, len(places)))


def term_columns(width: int) -> int:
    """Columns for the names of options on a page of this width."""
    return WIDE_TERM if width >= NARROW else NARROW_TERM


def aligned(grouped: dict[str, list[Row]], width: int) -> dict[str, list[Row]]:
    """The same with names padded, so that the texts of all groups start in one column."""
    longest = max((len(name) for rows in grouped.values() for name, _ in rows), default=0)
    column = min(longest, term_columns(width))
    return {
        heading: [(name.ljust(column) if text else name, text) for name, text in rows]
        for heading, rows in grouped.items()
    }

"""The reference of the command line, out of the commands themselves: in place of ``<!-- commands -->``."""

import inspect
import re
from typing import Any

import click
from sphinx.application import Sphinx

from wmr_replay.cli.commands import COMMANDS, LazyGroup
from wmr_replay.cli.help import GroupedCommand

MARK = "<!-- commands -->"
EXAMPLES = "Examples:"


def reference() -> str:
    """A section for each command, as Markdown."""
    group = LazyGroup("wmr-replay")
    with click.Context(group, info_name="wmr-replay", max_content_width=100) as parent:
        commands = [(name, group.get_command(parent, name)) for name in COMMANDS]
        return "\n\n".join(section(name, command, parent) for name, command in commands if command)


def section(name: str, command: click.Command, parent: click.Context) -> str:
    """What ``--help`` of a command prints: usage, text, examples, and its options in groups."""
    context = click.Context(command, info_name=name, parent=parent)
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    text, _, examples = inspect.cleandoc(command.help or "").replace("\b\n", "").partition(EXAMPLES)
    assert isinstance(command, GroupedCommand)
    groups = command.grouped_rows(context)
    return "\n\n".join(
        [
            f"## {name}",
            f"```text\n{usage}\n```",
            prose(text),
            *([f"```sh\n{inspect.cleandoc(examples)}\n```"] if examples.strip() else []),
            *(table(heading, rows) for heading, rows in groups.items()),
        ]
    )


def table(heading: str, rows: list[tuple[str, str]]) -> str:
    """The options of a group."""
    lines = [f"| {heading} | |", "| --- | --- |"]
    lines += [f"| `{cell(names)}` | {prose(cell(text))} |" for names, text in rows]
    return "\n".join(lines)


def cell(text: str) -> str:
    """A text inside a table."""
    return re.sub(r"\s+", " ", text).replace("|", r"\|")


def prose(text: str) -> str:
    """A help text without what Markdown would read as HTML or emphasis."""
    return re.sub(r"([<>*_\[\]])", r"\\\1", text.strip())


def fill(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put the reference where the page has its mark."""
    if MARK in source[0]:
        source[0] = source[0].replace(MARK, reference())


def setup(app: Sphinx) -> dict[str, Any]:
    """Sphinx's entry point."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

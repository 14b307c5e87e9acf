"""The commands by name, each imported when it is asked for, so that --help stays quick."""

import difflib
import importlib
from typing import Any

import click
from click.shell_completion import CompletionItem

from wmr_replay.cli.streams import reader_watched

COMMANDS = {
    "run": "Identify contact modes and alpha in a log.",
    "batch": "Replay many logs into one dataset.",
    "info": "What a log holds, and what would be used of it.",
    "synth": "Write a synthetic log.",
    "gap": "Where simulation and measurement disagree, and what the model lacks.",
    "excite": "Design what to drive next, to tell apart what a log left open.",
    "fit": "Calibrate the base model of a robot on a log.",
    "export": "Write a calibrated model as another tool's parameters.",
    "convert": "Turn a CSV file or a ROS bag into a log.",
    "suite": "Write a named, versioned set of synthetic logs.",
    "check": "Replay logs and compare with stored references, or hold them to criteria.",
    "compare": "Two results, logs or settings side by side.",
    "plot": "Draw a stored result for papers and slides.",
    "design": "Design a differentiator, see its kernel and what it does to a log.",
}
ALIASES = {"diff": "design"}
"""Former names, which still work and are not listed."""


class LazyGroup(click.Group):
    """Imports a command's module only when that command is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order in which they are usually needed."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command ``wmr_replay.cli.<name>.command``."""
        name = ALIASES.get(cmd_name, cmd_name)
        if name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"wmr_replay.cli.{name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command of the first argument. Raises UsageError with the nearest names where there is none."""
        name = args[0]
        if not (name.startswith("-") or ctx.resilient_parsing or self.get_command(ctx, name)):
            near = difflib.get_close_matches(name, COMMANDS, n=2)
            meant = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(COMMANDS)}"
            raise click.UsageError(f"no command {name!r}; {meant}", ctx)
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands, without importing any, and the options that stand before them."""
        named = [(name, text) for name, text in COMMANDS.items() if name.startswith(incomplete)]
        found = [CompletionItem(name, help=text) for name, text in named]
        return [*found, *click.Command.shell_complete(self, ctx, incomplete)]

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """The call's context; a help page is printed here. Raises ReaderLeft."""
        with reader_watched():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Do the work. Raises ReaderLeft."""
        with reader_watched():
            return super().invoke(ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list under --help, without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

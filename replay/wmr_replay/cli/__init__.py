"""The command line: where errors become text and exit codes.

Exit codes: 0 done; 1 a check failed; 2 usage; 3 the log cannot be used; 70 internal error; 130 interrupted.
"""

import importlib
import io
import os
import sys
from typing import NoReturn

import click

from wmr_replay.cli.compiling import say_when_compiling
from wmr_schemas import __version__
from wmr_schemas.errors import InvalidFile, InvalidSetting, LogUnusable, WmrError
from wmr_schemas.text import shown_lines

EXIT_CHECK_FAILED, EXIT_USAGE, EXIT_LOG_UNUSABLE, EXIT_INTERNAL, EXIT_INTERRUPTED = 1, 2, 3, 70, 130

COMMANDS = {
    "run": "Identify contact modes and alpha in a log.",
    "batch": "Replay many logs into one dataset.",
    "info": "What a log holds, and what would be used of it.",
    "synth": "Write a synthetic log.",
    "gap": "Where simulation and measurement disagree, and what the model lacks.",
    "fit": "Calibrate the base model of a robot on a log.",
    "convert": "Turn a CSV file into a log.",
    "suite": "Write a named, versioned set of synthetic logs.",
    "check": "Replay logs and compare with stored references, or hold them to criteria.",
    "compare": "Two results, logs or settings side by side.",
    "plot": "Draw a stored result for papers and slides.",
    "diff": "Design a differentiator, see its kernel and what it does to a log.",
}


class LazyGroup(click.Group):
    """Imports a command's module only when that command is asked for, so that --help stays quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order in which they are usually needed."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command ``wmr_replay.cli.<name>.command``."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"wmr_replay.cli.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list under --help, without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.version_option(__version__, prog_name="wmr-replay")
def cli() -> None:
    """Contact modes of wheeled robots, and the parameter alpha, out of MCAP logs and ROS bags.

    \b
    Examples:
      wmr-replay synth paper-acceleration --out demo.mcap
      wmr-replay info demo.mcap
      wmr-replay run demo.mcap --view
    """


def fail(message: str, code: int) -> NoReturn:
    """Print an error message and exit with ``code``."""
    click.echo(f"error: {shown_lines(message)}", err=True)
    sys.exit(code)


def main() -> None:
    """Entry point of ``wmr-replay``."""
    say_when_compiling()
    try:
        cli.main(standalone_mode=False)
    except click.exceptions.Exit as done:
        sys.exit(done.exit_code)
    except click.ClickException as error:
        said = io.StringIO()
        error.show(file=said)
        click.echo(shown_lines(said.getvalue()), err=True, nl=False)
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        fail("interrupted; nothing half-written was left", EXIT_INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(EXIT_CHECK_FAILED)
    except LogUnusable as error:
        fail(str(error), EXIT_LOG_UNUSABLE)
    except (InvalidFile, InvalidSetting) as error:
        fail(str(error), EXIT_USAGE)
    except WmrError as error:
        fail(str(error), EXIT_LOG_UNUSABLE)
    except Exception as error:
        if os.environ.get("WMR_REPLAY_TRACEBACK"):
            raise
        fail(
            f"internal error: {type(error).__name__}: {error}\nset WMR_REPLAY_TRACEBACK=1 for the traceback, "
            "and please report it with the log's `wmr-replay info`",
            EXIT_INTERNAL,
        )

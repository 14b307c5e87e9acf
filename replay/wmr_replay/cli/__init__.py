"""The command line: where errors become text and exit codes.

Exit codes: 0 done; 1 a check failed; 2 usage; 3 the log cannot be used; 70 internal error; 130 interrupted.
"""

import io
import os
import sys
from typing import NoReturn

import click

from wmr_replay.cli.commands import LazyGroup
from wmr_replay.cli.compiling import say_when_compiling
from wmr_replay.cli.help import MOST_COLUMNS
from wmr_schemas import __version__
from wmr_schemas.errors import InvalidFile, InvalidSetting, LogUnusable, WmrError
from wmr_schemas.text import shown_lines

EXIT_CHECK_FAILED, EXIT_USAGE, EXIT_LOG_UNUSABLE, EXIT_INTERNAL, EXIT_INTERRUPTED = 1, 2, 3, 70, 130

CONTEXT = {
    "help_option_names": ["-h", "--help"],
    "show_default": True,
    "max_content_width": MOST_COLUMNS,
}


@click.group(cls=LazyGroup, context_settings=CONTEXT)
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
        cli.main(prog_name="wmr-replay", standalone_mode=False)
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

"""The command line: where errors become text and exit codes.

Exit codes: 0 done; 1 a check failed; 2 usage; 3 the log cannot be used; 70 internal error; 130 interrupted;
141 the reader of the output left.
"""

import gc
import os
import sys
import traceback

import click

from wmr_replay.cli.commands import LazyGroup
from wmr_replay.cli.compiling import say_when_compiling
from wmr_replay.cli.help import MOST_COLUMNS
from wmr_replay.cli.streams import ReaderLeft, drop_output, flush, prepare_streams, reader_watched
from wmr_replay.cli.verbosity import is_verbose, speak_normally
from wmr_schemas import __version__
from wmr_schemas.errors import InvalidFile, InvalidSetting, LogUnusable, WmrError
from wmr_schemas.text import shown_lines

EXIT_CHECK_FAILED, EXIT_USAGE, EXIT_LOG_UNUSABLE, EXIT_INTERNAL, EXIT_INTERRUPTED = 1, 2, 3, 70, 130
EXIT_READER_LEFT = 141
"""As of a program that the signal SIGPIPE ends."""
COLLECTED_AFTER = 20_000
"""Objects between two searches for garbage, 700 by default: most objects are those of imported packages, and
searching them again and again is an eighth of a short command.
"""
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Linear algebra in one thread, unless the environment says otherwise: our matrices are small, threads wait
for each other on a busy machine, and the last bits would depend on how many there are.
"""
HELP_OPTIONS = ["-h", "--help"]
CONTEXT = {"help_option_names": HELP_OPTIONS, "show_default": True, "max_content_width": MOST_COLUMNS}


@click.group(cls=LazyGroup, context_settings=CONTEXT, invoke_without_command=True)
@click.version_option(__version__, prog_name="wmr-replay")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Contact modes of wheeled robots, and the parameter alpha, out of MCAP logs and ROS bags.

    \b
    Examples:
      wmr-replay synth paper-acceleration --out demo.mcap
      wmr-replay info demo.mcap
      wmr-replay run demo.mcap --view
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help(), err=True)
        ctx.exit(EXIT_USAGE)


def main() -> None:
    """Entry point of ``wmr-replay``."""
    gc.set_threshold(COLLECTED_AFTER)
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    prepare_streams()
    say_when_compiling()
    try:
        with reader_watched():
            code = exit_code_of_call()
            flush()
    except ReaderLeft:
        drop_output()
        code = EXIT_READER_LEFT
    finally:
        speak_normally()
        gc.freeze()  # else Python searches all objects for garbage once more, a sixth of a short command
    if code:
        sys.exit(code)


def exit_code_of_call() -> int:
    """Do what the command line says; its exit code, and any error as text on standard error."""
    try:
        code = cli.main(prog_name="wmr-replay", standalone_mode=False)
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else int(bool(done.code))
    except ReaderLeft:
        raise
    except (click.Abort, KeyboardInterrupt):
        return told("interrupted; nothing half-written was left", EXIT_INTERRUPTED)
    except Exception as error:
        if unexpected(error) and os.environ.get("WMR_REPLAY_TRACEBACK"):
            raise
        if unexpected(error) and is_verbose():
            traceback.print_exc()
        return told(*text_and_code(error))
    return code if isinstance(code, int) else 0


def told(message: str, code: int) -> int:
    """Print an error message; its exit code."""
    print(f"error: {shown_lines(message)}", file=sys.stderr)
    return code


def unexpected(error: Exception) -> bool:
    """Whether an error is a mistake of this program."""
    return not isinstance(error, click.ClickException | WmrError | OSError)


def text_and_code(error: Exception) -> tuple[str, int]:
    """What is said of an error, and the exit code."""
    if isinstance(error, click.ClickException):
        return usage_text(error), error.exit_code
    if isinstance(error, InvalidFile | InvalidSetting):
        return str(error), EXIT_USAGE
    if isinstance(error, LogUnusable | WmrError):
        return str(error), EXIT_LOG_UNUSABLE
    if isinstance(error, OSError):
        return file_text(error), EXIT_USAGE
    return (
        f"internal error: {type(error).__name__}: {error}\nset WMR_REPLAY_TRACEBACK=1 for the traceback, "
        "and please report it with the log's `wmr-replay info`",
        EXIT_INTERNAL,
    )


def usage_text(error: click.ClickException) -> str:
    """A mistake in the call, spelled as all errors are, and where the options are listed."""
    context = getattr(error, "ctx", None)
    message = error.format_message().rstrip(".")
    said = message[:1].lower() + message[1:]
    return said if context is None else f"{said}\n`{context.command_path} --help` lists arguments and options"


def file_text(error: OSError) -> str:
    """A file or directory that the system refuses, or a full disk."""
    reason = error.strerror or str(error)
    if error.filename is None:
        return f"the results cannot be written ({reason}); nothing half-written was left"
    return f"{os.fsdecode(error.filename)}: cannot be read or written ({reason})"

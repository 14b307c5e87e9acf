"""Reads logs as ``info`` and ``run`` do, under limits of memory and time, and says what each of them cost.

``python worker.py OUT [--memory MIB] [--seconds S] FILE…`` prints a line of JSON for each file. A worker that
does not get to its end was killed by a limit; the file whose line is missing is the one at fault.
"""

import argparse
import contextlib
import ctypes
import gc
import io
import json
import resource
import sys
import time
import traceback
from pathlib import Path
from typing import Any

OWN_ERRORS = {1, 2, 3}


def read_once(path: Path, out: Path) -> list[dict[str, Any]]:
    """Exit code, text, seconds and peak memory of ``info`` and of ``run``."""
    return [measured(command) for command in (["info", path], ["run", path, "--out", out])]


def measured(command: list[object]) -> dict[str, Any]:
    """One command in this process."""
    reset_peak()
    start, cpu = time.perf_counter(), time.process_time()
    code, text = run(command)
    return {
        "command": str(command[0]),
        "code": code,
        "text": text,
        "wall_s": round(time.perf_counter() - start, 2),
        "cpu_s": round(time.process_time() - cpu, 2),
        "peak_mib": peak_mib(),
    }


def run(command: list[object]) -> tuple[int, str]:
    """The command line's exit code and what it printed; of an internal error the traceback."""
    from wmr_replay.cli import cli
    from wmr_schemas.errors import WmrError

    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        try:
            cli.main([str(word) for word in command], prog_name="wmr-replay", standalone_mode=False)
        except WmrError as error:
            return 3, f"{text.getvalue()}{error}"
        except SystemExit as done:
            return int(done.code or 0), text.getvalue()
        except BaseException as error:
            if type(error).__module__.startswith("click"):
                return 2, str(error)
            return 70, "".join(traceback.format_exception(error))
    return 0, text.getvalue()


def reset_peak() -> None:
    """Give freed memory back, and forget the highest memory so far, where the system can."""
    gc.collect()
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def peak_mib() -> float:
    """Highest memory in use since :func:`reset_peak`, in MiB."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM"):
                return round(int(line.split()[1]) / 1024, 1)
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)


def main() -> None:
    """Read the files named on the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--memory", type=int, default=16 << 10, help="address space in MiB")
    parser.add_argument("--seconds", type=int, default=600, help="processor time in s")
    asked = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (asked.memory << 20, asked.memory << 20))
    resource.setrlimit(resource.RLIMIT_CPU, (asked.seconds, asked.seconds))
    for path in asked.files:
        line = {"file": path.stem, "commands": read_once(path, asked.out)}
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    sys.exit(main())

"""Runs the code of the pages: ``python docs/run_commands.py [PAGE …]``, or ``make docs-commands``.

A page's blocks of ``sh`` and ``python`` run in order in a temporary directory, each block by a shell or an
interpreter of its own; those of the notebook's page are run by the script that makes it. A block of ``toml``
whose first line is a comment with a path, such as ``# ci/suite.toml``, is written there. Where a block of
``text`` follows before the next heading, it must be what the block prints: lines in order, ``…`` for what is
left out, numbers within 2 % or one unit of their last digit, since processors differ in the last digits.

``<!-- not run: REASON -->`` before a block leaves it out, ``<!-- exit: 1 -->`` says how it ends, and
``<!-- not output -->`` stands before a text that no command printed. ``docs/commands.toml`` says what a page
needs beforehand, and which pages ``make slow`` runs.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(
    r"(?:^<!-- (?P<note>[^\n]*?) -->\n\n?)?^```(?P<kind>\w+)\n(?P<body>.*?)^```$|^(?P<heading>#+ )",
    re.MULTILINE | re.DOTALL,
)
NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
VIEWER = re.compile(r"\S*/rerun\b")
RELATIVE = 0.02
OMITTED = "…"
SHIMS = {
    "rerun": '#!/bin/sh\ntest -s "$1" && echo "viewer: $1"\n',
    "make": f'#!/bin/sh\nexec /usr/bin/env make -C "{ROOT}" VENV="{sys.prefix}" DEMO="$PWD/demo" "$@"\n',
}
"""In place of programs that open a window, or install into this environment."""
RUN = {"sh": ("bash", "-euo", "pipefail", "-c"), "python": (sys.executable, "-c")}
"""What runs a block of each kind."""
NOTEBOOK = ROOT / "docs" / "notebook.md"


@dataclass(frozen=True)
class Step:
    """Something to do for a page: a file to write, or code to run and what it should print.

    ``kind`` is ``sh``, ``python``, or the path of the file.
    """

    kind: str
    body: str
    line: int
    exit_code: int = 0
    expected: str | None = None


class WrongPage(Exception):
    """A page whose commands do not do what it says."""


def steps(text: str) -> list[Step]:
    """The files and commands of a page, in order."""
    found: list[Step] = []
    awaiting = False
    for block in BLOCK.finditer(text):
        note, kind, body = block["note"] or "", block["kind"], block["body"]
        line = text.count("\n", 0, block.start()) + 1
        runs = kind in RUN and not note.startswith("not run: ")
        if runs:
            code = int(note.removeprefix("exit: ")) if note.startswith("exit: ") else 0
            found.append(Step(kind, body, line, code))
        elif kind == "toml" and (path := re.match(r"# ([\w./-]+\.toml)\s", body)):
            found.append(Step(path[1], body, line))
        elif kind == "text" and awaiting and note != "not output":
            last = found.pop()
            found.append(Step(last.kind, last.body, last.line, last.exit_code, body))
        awaiting = runs
    return found


def left_out(text: str) -> list[str]:
    """The reasons of the blocks that do not run."""
    notes = [block["note"] or "" for block in BLOCK.finditer(text) if block["kind"] in RUN]
    return [note.removeprefix("not run: ") for note in notes if note.startswith("not run: ")]


def same_line(shown: str, printed: str) -> bool:
    """Whether a line of the page is the printed one, but for last digits and for what the page omits."""
    parts = [part.split() for part in shown.split(OMITTED)]
    if len(parts) == 1:
        return same_words(parts[0], printed.split())
    words = printed.split()
    start, end = parts[0], parts[-1]
    return (
        len(start) + len(end) <= len(words)
        and same_words(start, words[: len(start)])
        and same_words(end, words[len(words) - len(end) :])
    )


def same_words(shown: list[str], printed: list[str]) -> bool:
    """Word by word: texts are equal, numbers near."""
    return len(shown) == len(printed) and all(map(same_word, shown, printed))


def same_word(shown: str, printed: str) -> bool:
    """A word, or a number in some punctuation; bars are as long as their numbers are."""
    if NUMBER.sub("", shown) != NUMBER.sub("", printed):
        return bool(set(shown) <= set("█░╋") and set(printed) <= set("█░╋"))
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=False)
    return all(near(float(a), float(b), last_digit(a)) for a, b in pairs)


def near(shown: float, printed: float, unit: float) -> bool:
    """Within 2 %, or one unit of the last digit."""
    return abs(shown - printed) <= max(RELATIVE * abs(shown), 1.001 * unit)


def last_digit(number: str) -> float:
    """One unit of a decimal number's last digit."""
    mantissa, _, exponent = number.partition("e")
    return float(10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2])))


def first_difference(shown: str, printed: str) -> str | None:
    """The first line of the page that is not printed in its turn; None where all are."""
    lines = iter([line for line in printed.splitlines() if line.strip()])
    omitted = False
    for line in (line for line in shown.splitlines() if line.strip()):
        if line.strip() == OMITTED:
            omitted = True
            continue
        candidates = lines if omitted else (next(lines, "(nothing more)"),)
        if not any(same_line(line, candidate) for candidate in candidates):
            return line
        omitted = False
    return None


def run_page(page: Path, prepare: str = "") -> None:
    """Do what a page says, in a directory of its own. Raises WrongPage."""
    todo = steps(page.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder, "here")
        here.mkdir()
        environment = environment_in(Path(folder))
        if prepare:
            done = run("sh", prepare, here, environment)
            if done.returncode:
                raise WrongPage(f"{page.name}: commands.toml: {done.stdout}{done.stderr}")
        for step in todo:
            do(step, page, here, environment)


def do(step: Step, page: Path, here: Path, environment: dict[str, str]) -> None:
    """Write the file or run the code. Raises WrongPage."""
    if step.kind not in RUN:
        path = here / step.kind
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(step.body, encoding="utf-8")
        return
    done = run(step.kind, step.body, here, environment)
    printed = VIEWER.sub("rerun", done.stdout.replace(f"{here}/", ""))
    place = f"{page.relative_to(ROOT)}:{step.line}"
    if done.returncode != step.exit_code:
        raise WrongPage(f"{place}: exit code {done.returncode}, not {step.exit_code}\n{printed}{done.stderr}")
    if step.expected is not None and (line := first_difference(step.expected, printed)) is not None:
        raise WrongPage(f"{place}: the page shows\n    {line}\nand the block prints\n{printed}{done.stderr}")


def run(kind: str, code: str, here: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Commands up to the first that fails, or a program."""
    call = [*RUN[kind], code]
    return subprocess.run(call, cwd=here, env=environment, capture_output=True, text=True, check=False)


def environment_in(folder: Path) -> dict[str, str]:
    """Our environment is active; no terminal (a row is one line), no colour; no window opens."""
    shims = folder / "shims"
    shims.mkdir()
    for name, script in SHIMS.items():
        (shims / name).write_text(script.replace("/usr/bin/env make", real("make")), encoding="utf-8")
        (shims / name).chmod(0o755)
    path = os.pathsep.join([str(shims), str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    ours = {"PATH": path, "NO_COLOR": "1", "WMR_REPLAY_PROGRESS": "never", "MPLBACKEND": "Agg"}
    ours["ROOT"] = str(ROOT)
    return {name: value for name, value in os.environ.items() if name != "COLUMNS"} | ours


def real(name: str) -> str:
    """The program that a shim of its name calls."""
    places = (Path(folder, name) for folder in os.environ.get("PATH", "").split(os.pathsep))
    return str(next((path for path in places if path.exists()), name))


def settings() -> dict[str, dict[str, str]]:
    """What ``commands.toml`` says of each page: ``prepare``, ``quick``, ``needs``."""
    return tomllib.loads((ROOT / "docs" / "commands.toml").read_text(encoding="utf-8"))


def pages() -> Iterator[Path]:
    """README and all pages that have code to run; the notebook has a runner of its own."""
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        runs = any(step.kind in RUN for step in steps(page.read_text(encoding="utf-8")))
        if runs and page != NOTEBOOK:
            yield page


def name_of(page: Path) -> str:
    """A page as ``commands.toml`` and the terminal call it."""
    return str(page.relative_to(ROOT))


def main() -> None:
    """Run the pages and say which are wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pages", nargs="*", help="Such as docs/ci.md; all without any.")
    chosen, known, wrong = parser.parse_args().pages, settings(), 0
    for page in pages():
        if chosen and name_of(page) not in chosen:
            continue
        started = time.monotonic()
        try:
            run_page(page, known.get(name_of(page), {}).get("prepare", ""))
            verdict = "ok"
        except WrongPage as error:
            verdict, wrong = f"WRONG\n{error}", wrong + 1
        print(f"{name_of(page):32} {time.monotonic() - started:6.1f} s  {verdict}", flush=True)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()

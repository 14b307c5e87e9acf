"""Executes ``docs/notebook.py`` and writes the page made from it: ``python docs/make_notebook.py``.

Cells begin with ``# %%``, those of text with ``# %% [markdown]``. The last expression of a cell is shown:
figures as pictures below ``images/``, objects with HTML as HTML, everything else as text. The cells run in a
temporary folder; ``--out DIR`` writes elsewhere than to ``docs``.
"""

import argparse
import ast
import contextlib
import io
import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import polars as pl
from matplotlib.figure import Figure

HERE = Path(__file__).parent
SCRIPT = HERE / "notebook.py"
CELL = re.compile(r"^# %%(?P<text> \[markdown\])?\n", re.MULTILINE)
DPI = 110


def cells(script: str) -> Iterator[tuple[bool, str]]:
    """Whether a cell is text, and its content."""
    marks = list(CELL.finditer(script))
    ends = [mark.start() for mark in marks[1:]] + [len(script)]
    for mark, end in zip(marks, ends, strict=True):
        content = script[mark.end() : end].strip("\n")
        if mark["text"]:
            yield True, "\n".join(line.removeprefix("#").removeprefix(" ") for line in content.splitlines())
        else:
            yield False, content


def execute(source: str, names: dict[str, Any]) -> tuple[str, Any]:
    """Run a cell; what it printed, and the value of its last expression."""
    tree, value, printed = ast.parse(source), None, io.StringIO()
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(printed), pl.Config(tbl_cols=12, tbl_width_chars=110, fmt_str_lengths=40):
        exec(compile(tree, SCRIPT.name, "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), SCRIPT.name, "eval"), names)
        shown = "" if value is None or is_rich(value) else f"{value!s}\n"
    return printed.getvalue() + shown, value


def is_rich(value: Any) -> bool:
    """Whether a value is shown as a picture or as HTML."""
    if isinstance(value, pl.DataFrame):
        return False
    return isinstance(value, Figure) or hasattr(value, "_repr_html_")


def page(out: Path) -> str:
    """The page's Markdown; pictures are written below ``out/images``."""
    blocks, names, n_pictures = [], {"__name__": "notebook"}, 0
    for is_text, content in cells(SCRIPT.read_text(encoding="utf-8")):
        if is_text:
            blocks.append(content)
            continue
        blocks.append(f"```python\n{content}\n```")
        printed, value = execute(content, names)
        if printed:
            blocks.append(f"```text\n{printed.rstrip()}\n```")
        if isinstance(value, Figure):
            n_pictures += 1
            name = f"images/notebook_{n_pictures}.png"
            value.savefig(out / name, dpi=DPI)
            blocks.append(f"![Figure {n_pictures}]({name})")
        elif is_rich(value):
            blocks.append(f'<div class="result">{value._repr_html_()}</div>')
    return "\n\n".join(blocks) + "\n"


def make(out: Path) -> Path:
    """Execute the script in a temporary folder, and write page and pictures to ``out``."""
    (out / "images").mkdir(parents=True, exist_ok=True)
    before, target = Path.cwd(), out.absolute()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            text = page(target)
        finally:
            os.chdir(before)
    (target / "notebook.md").write_text(text, encoding="utf-8")
    return target / "notebook.md"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=HERE, help="Folder of notebook.md and images/.")
    print(f"wrote {make(parser.parse_args().out)}")

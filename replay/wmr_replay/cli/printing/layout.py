"""Text as wide as the terminal: no column of a table is cut off or left out, and no word is broken.

Where a table is too wide, each of its rows becomes a paragraph: the first cell in a line, the others behind
their headings below it.
"""

import shutil
import sys
import textwrap

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from wmr_replay.cli.printing.plain import say, styled

WIDE = 1000
"""Columns of a file or pipe: a line for each row, for tools that read lines."""
LEAST = 40
"""Narrower terminals break what they like."""
INDENT = 4


def output_width() -> int:
    """Columns of standard output: the terminal's; without limit in a file or pipe, whatever COLUMNS says."""
    if sys.stdout.isatty():
        return max(shutil.get_terminal_size().columns, LEAST)
    return WIDE


def print_table(console: Console, table: Table, n_titles: int = 1) -> None:
    """A table, or its rows one by one where it is wider than the console.

    ``n_titles``: first cells that stand together in the first line of such a row; 0: it has no such line.
    """
    headings = [plain(column.header) for column in table.columns]
    rows = [[plain(cell) for cell in row] for row in zip(*(c.cells for c in table.columns), strict=True)]
    if columns_needed(table, headings, rows) <= console.width:
        console.print(table)
        return
    if n_titles:
        console.print(Text("  ".join(headings[:n_titles]), style="dim"), soft_wrap=True)
    for cells in rows:
        title = "  ".join(cell for cell in cells[:n_titles] if cell)
        for line in record_lines(title, headings[n_titles:], cells[n_titles:], console.width):
            console.print(line, soft_wrap=True)


def columns_needed(table: Table, headings: list[str], rows: list[list[str]]) -> int:
    """Columns below which something of the table would be cut off: whole cells, or words where these wrap."""
    widths = [
        max(cell_len(part) for cell in column for part in ([cell] if described.no_wrap else cell.split(" ")))
        for described, *column in zip(table.columns, headings, *rows, strict=True)
    ]
    _, right, _, left = table.padding
    return sum(widths) + (right + left) * (len(widths) - 1)


def record_lines(title: str, headings: list[str], cells: list[str], width: int) -> list[str]:
    """A row as a paragraph: its title, then heading and cell of the others, empty ones left out.

    Pieces that do not fit into a line are wrapped between words.
    """
    lines, line = [title] if title else [], ""
    for heading, cell in zip(headings, cells, strict=True):
        pieces = wrapped(f"{heading}: {cell}" if heading else cell, width - INDENT) if cell else []
        for piece in pieces:
            fits = line and len(pieces) == 1 and len(line) + len(piece) + 2 <= width - INDENT
            if line and not fits:
                lines.append(" " * INDENT + line)
            line = f"{line}  {piece}" if fits else piece
    return [*lines, " " * INDENT + line] if line else lines


def wrapped(text: str, width: int) -> list[str]:
    """The text's lines, wrapped between words; a word that is too long stays whole."""
    return [
        piece
        for line in text.splitlines()
        for piece in textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False) or [""]
    ]


def labelled(label: str, text: str, column: int, width: int) -> list[str]:
    """Lines with the label in the first and the text in a column of its own."""
    if width >= WIDE:
        return [f"{label:<{column}}{text}"]
    first, *rest = wrapped(text, max(width - column, LEAST // 2)) or [""]
    return [f"{label:<{column}}{first}", *(" " * column + line for line in rest)]


def print_title(console: Console, name: str, text: str, width: int) -> None:
    """A name and what there is to say of it, in one line where it fits, else the text wrapped below."""
    if cell_len(name) + cell_len(text) + 2 <= width:
        console.print(styled((name, "bold"), f"  {text}"), soft_wrap=True)
        return
    console.print(styled((name, "bold")), soft_wrap=True)
    for line in wrapped(text, width - INDENT):
        console.print(styled(" " * INDENT + line), soft_wrap=True)


def say_labelled(label: str, text: str, column: int) -> None:
    """Print text behind a label."""
    for line in labelled(label, text, column, output_width()):
        say(line)


def plain(cell: object) -> str:
    """A cell's text."""
    return cell.plain if isinstance(cell, Text) else str(cell)

"""The text panel of a comparison."""

from collections.abc import Mapping
from typing import Any

import polars as pl

from wmr_schemas.text import figure, markdown

MOST_ROWS, DIGITS = 40, 3
WARNING = "warning:"


def comparison_text(a: str, b: str, told: list[str], summary: pl.DataFrame) -> str:
    """Markdown: the names of both, what is told of them, and the fields of the summary that differ."""
    blocks = [
        f"**a**: {markdown(a)}  \n**b**: {markdown(b)}",
        *(f"**{line}**" if line.startswith(WARNING) else line for line in told),
    ]
    if len(summary):
        rows = map(table_row, summary.head(MOST_ROWS).iter_rows(named=True))
        blocks.append("\n".join(["| summary | a | b | b − a |", "| --- | --- | --- | --- |", *rows]))
    return "\n\n".join(blocks)


def table_row(row: Mapping[str, Any]) -> str:
    """A field of the summary."""
    cells = (
        row["field"].replace("_", " "),
        *(figure(row[key], DIGITS) for key in "ab"),
        figure(row["delta"], DIGITS, "+"),
    )
    return f"| {' | '.join(cells)} |"

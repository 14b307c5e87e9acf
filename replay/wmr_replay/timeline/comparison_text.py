"""The text panel of a comparison."""

import polars as pl

from wmr_schemas.text import markdown

MOST_ROWS = 40


def comparison_text(a: str, b: str, told: list[str], summary: pl.DataFrame) -> str:
    """Markdown: the names of both, what is told of them, and the fields of the summary that differ."""
    blocks = [f"**a**: {markdown(a)}  \n**b**: {markdown(b)}", *told]
    if len(summary):
        rows = [
            f"| {row['field'].replace('_', ' ')} | {figure(row['a'])} | {figure(row['b'])} | {figure(row['delta'], '+')} |"
            for row in summary.head(MOST_ROWS).iter_rows(named=True)
        ]
        blocks.append("\n".join(["| summary | a | b | b − a |", "| --- | --- | --- | --- |", *rows]))
    return "\n\n".join(blocks)


def figure(value: float | None, sign: str = "") -> str:
    """A number of three digits, or a dash."""
    return "–" if value is None else f"{value:{sign}.3g}"

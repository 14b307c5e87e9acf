"""The files that a check leaves: whole or absent."""

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from wmr_replay.regress.check import DIFF, LogCheck
from wmr_schemas.files import whole_file
from wmr_schemas.text import shown


def write_text(path: Path, text: str) -> None:
    """A text file."""
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")


def write_diff(path: Path, checks: Sequence[LogCheck]) -> None:
    """Every value beyond its tolerance: a Parquet table by its ending, else columns of text."""
    table = pl.concat([pl.DataFrame(schema=DIFF), *(check.differences() for check in checks)])
    with whole_file(path) as part:
        if path.suffix == ".parquet":
            table.write_parquet(part)
        else:
            names = table["log"].unique().to_list()
            named = pl.col("log").replace_strict(names, [*map(shown, names)], return_dtype=pl.String)
            table.with_columns(named).write_csv(part, separator="\t")

"""Contact modes by label; the tables on disk hold their numbers."""

from typing import TypeVar

import polars as pl

from wmr_schemas.modes import ContactMode

MODE_DTYPE = pl.Enum([mode.label for mode in ContactMode])
"""Labels in the order of the modes' values: ``undecided``, ``ideal``, … ``skidding_slipping``."""
MODE_COLUMNS = ("mode", "mode_true")
_LABELS = {int(mode): mode.label for mode in ContactMode}

Frame = TypeVar("Frame", pl.DataFrame, pl.LazyFrame)


def with_names(frame: Frame) -> Frame:
    """``mode`` and ``mode_true`` as an Enum of labels, −1 as ``undecided``; null stays null.

    Takes a samples, segments or confusion table, eager or lazy; columns that are absent, or named already,
    are left as they are. Raises polars' InvalidOperationError for a number that is no contact mode.
    """
    schema = frame.lazy().collect_schema()
    numbered = [name for name in MODE_COLUMNS if name in schema and schema[name].is_integer()]
    return frame.with_columns(
        pl.col(name).replace_strict(_LABELS, return_dtype=MODE_DTYPE) for name in numbered
    )

"""Modes by name: tables hold them as Int8 on disk, results show them as an enumeration."""

from typing import TypeVar

import polars as pl

from wmr_schemas.modes import ContactMode

MODE_DTYPE = pl.Enum([mode.label for mode in ContactMode])
"""``undecided``, ``ideal``, ``skidding``, ``slipping``, ``skidding_slipping``."""
MODE_COLUMNS = ("mode", "mode_true")

Frame = TypeVar("Frame", pl.DataFrame, pl.LazyFrame)


def with_mode_names(frame: Frame, columns: tuple[str, ...]) -> Frame:
    """The frame with these mode columns as names; null stays null."""
    numbers, labels = [int(mode) for mode in ContactMode], [mode.label for mode in ContactMode]
    return frame.with_columns(
        pl.col(name).replace_strict(numbers, labels, return_dtype=MODE_DTYPE) for name in columns
    )

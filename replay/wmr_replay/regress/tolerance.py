"""How far a value may lie from its reference, column by column."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import polars as pl

from wmr_schemas.errors import InvalidFile
from wmr_schemas.tables import SAMPLES, SEGMENTS, SUMMARY, Column
from wmr_schemas.tomlfile import check_keys, expect_number, expect_table, read_toml

TOLERANCES = "tolerances.toml"
TABLES: dict[str, tuple[Column, ...]] = {"samples": SAMPLES, "segments": SEGMENTS, "summary": SUMMARY}
"""The tables that are compared, in the order in which they are."""


@dataclass(frozen=True)
class Tolerance:
    """A value passes when |new − reference| ≤ max(absolute, relative·|reference|).

    ``rows`` values of the column may lie further away; an ignored column is not compared at all.
    """

    absolute: float = 0.0
    relative: float = 0.0
    rows: int = 0
    ignore: bool = False


EXACT = Tolerance()
REAL = Tolerance(absolute=1e-9, relative=1e-6)
SHARE = Tolerance(absolute=1e-6, relative=1e-6)
"""Of probabilities and shares, whose small values mean nothing by themselves."""
IGNORED = Tolerance(ignore=True)
NOT_COMPARED = ("log", "log_sha256", "version", "settings", "notes")
"""Columns of the summary that say where an answer comes from; ``settings`` are what a replay starts from."""


def default_tolerance(table: str, column: Column) -> Tolerance:
    """Exact for whole numbers, texts and states; REAL for what has a unit; SHARE for what has none."""
    if table == "summary" and column.name in NOT_COMPARED:
        return IGNORED
    if column.dtype != pl.Float64:
        return EXACT
    return SHARE if column.unit == "–" else REAL


@dataclass(frozen=True)
class Tolerances:
    """The tolerance of every column of every table, by name."""

    tables: Mapping[str, Mapping[str, Tolerance]] = field(
        default_factory=lambda: {
            table: {column.name: default_tolerance(table, column) for column in columns}
            for table, columns in TABLES.items()
        }
    )

    def of(self, table: str, column: str) -> Tolerance:
        """The tolerance of a column; exact for one that the schema does not know."""
        return self.tables[table].get(column, EXACT)


def read_tolerances(directory: Path) -> Tolerances:
    """The defaults, overridden by ``tolerances.toml`` in the directory of the references, where there is one.

    Raises InvalidFile naming the key at fault.
    """
    path, defaults = directory / TOLERANCES, Tolerances()
    if not path.exists():
        return defaults
    given = read_toml(path)
    check_keys(path, "", given, TABLES)
    return Tolerances(
        {
            table: {**columns, **changed_columns(path, table, columns, given.get(table, {}))}
            for table, columns in defaults.tables.items()
        }
    )


def changed_columns(
    path: Path, table: str, columns: Mapping[str, Tolerance], given: object
) -> dict[str, Tolerance]:
    """What ``[table.column]`` sections say, over the defaults."""
    sections = expect_table(path, f"[{table}]", given)
    check_keys(path, f"[{table}]", sections, columns)
    return {
        name: changed(path, f"[{table}.{name}]", columns[name], section) for name, section in sections.items()
    }


def changed(path: Path, place: str, before: Tolerance, section: object) -> Tolerance:
    """One column's section: ``abs``, ``rel``, ``rows``, ``ignore``."""
    table = expect_table(path, place, section)
    check_keys(path, place, table, ("abs", "rel", "rows", "ignore"))
    changes: dict[str, Any] = {}
    for key, name in (("abs", "absolute"), ("rel", "relative"), ("rows", "rows")):
        if key in table:
            changes[name] = not_negative(path, f"{place} {key}", table[key])
    if "ignore" in table:
        if not isinstance(table["ignore"], bool):
            raise InvalidFile(path, f"{place} ignore", f"expected true or false, found {table['ignore']!r}")
        changes["ignore"] = table["ignore"]
    return replace(before, **changes)


def not_negative(path: Path, key: str, value: object) -> float:
    """A number not below 0."""
    number = expect_number(path, key, value)
    if number < 0:
        raise InvalidFile(path, key, f"expected a number not below 0, found {value!r}")
    return number

"""Criteria instead of references: bounds on columns of the summary, out of a TOML file.

accuracy = ">= .93"
median_detection_delay_s = ["> 0", "<= .5"]

[logs."noise-0.3m"]
accuracy = ">= .6"
"""

import difflib
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import polars as pl

from wmr_schemas.errors import InvalidFile
from wmr_schemas.tables import SUMMARY
from wmr_schemas.tomlfile import expect_table, read_toml

COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">": operator.gt,
    "<": operator.lt,
}
BOUND = re.compile(r"\s*(>=|<=|==|!=|>|<)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*")
REQUIRED = re.compile(r"\s*(\w+)\s*([<>=!].*)")
COLUMNS = tuple(column.name for column in SUMMARY if column.dtype in {pl.Float64, pl.Int64, pl.Boolean})
"""Columns of the summary that a bound can hold; true counts as 1."""


@dataclass(frozen=True)
class Criterion:
    """``column`` ``comparison`` ``bound``, for logs whose stem matches ``pattern``."""

    column: str
    comparison: str
    bound: float
    pattern: str = "*"

    def holds(self, value: float | None) -> bool:
        """Whether a value meets it; an unknown one does not."""
        return value is not None and COMPARISONS[self.comparison](float(value), self.bound)

    def __str__(self) -> str:
        return f"{self.column} {self.comparison} {self.bound:g}"


@dataclass(frozen=True)
class Judged:
    """A criterion and the value that it met."""

    criterion: Criterion
    value: float | None

    @property
    def passed(self) -> bool:
        """Whether it holds."""
        return self.criterion.holds(self.value)


def read_criteria(path: Path) -> tuple[Criterion, ...]:
    """Read and check a criteria file. Raises InvalidFile naming the key at fault."""
    tables = dict(read_toml(path))
    patterns = expect_table(path, "[logs]", tables.pop("logs", {}))
    found = list(section(path, "", "*", tables))
    for pattern, table in patterns.items():
        place = f'[logs."{pattern}"]'
        found += section(path, place, pattern, expect_table(path, place, table))
    if not found:
        raise InvalidFile(path, "", 'holds no criterion; one reads accuracy = ">= .93"')
    return tuple(found)


def required(text: str) -> Criterion:
    """A criterion for all logs out of ``accuracy >= .93``. Raises InvalidFile naming ``--require``."""
    match = REQUIRED.fullmatch(text)
    if match is None:
        raise InvalidFile(
            "--require", "", f"expected a comparison, such as 'accuracy >= .93', found {text!r}"
        )
    (found,) = section("--require", "", "*", {match[1]: match[2]})
    return found


def section(path: Path | str, place: str, pattern: str, table: Mapping[str, Any]) -> list[Criterion]:
    """The criteria of one table."""
    for column in table:
        if column not in COLUMNS:
            near = difflib.get_close_matches(column, COLUMNS, n=2)
            meant = f"; did you mean {' or '.join(near)}?" if near else ""
            known = f"is no number of the summary; these are: {', '.join(COLUMNS)}{meant}"
            raise InvalidFile(path, f"{place} {column}".strip(), known)
    return [
        bound(path, f"{place} {column}".strip(), column, pattern, text)
        for column, texts in table.items()
        for text in (texts if isinstance(texts, list) else [texts])
    ]


def bound(path: Path | str, key: str, column: str, pattern: str, text: object) -> Criterion:
    """One criterion out of its text."""
    match = BOUND.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise InvalidFile(path, key, f'expected a comparison and a number, such as ">= .93", found {text!r}')
    return Criterion(column, match[1], float(match[2]), pattern)


def criteria_for(stem: str, criteria: tuple[Criterion, ...]) -> list[Criterion]:
    """What applies to a log: of each column, what the last matching pattern says."""
    patterns = {c.column: c.pattern for c in criteria if fnmatchcase(stem, c.pattern)}
    return [c for c in criteria if patterns.get(c.column) == c.pattern]


def judge(stem: str, summary: Mapping[str, Any], criteria: tuple[Criterion, ...]) -> list[Judged]:
    """Every criterion that applies to a log, with the value of its summary."""
    return [Judged(criterion, summary[criterion.column]) for criterion in criteria_for(stem, criteria)]

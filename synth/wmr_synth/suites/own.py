"""A user's own suite, out of a TOML file."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.tomlfile import check_keys, expect_number, expect_table, expect_text, read_toml
from wmr_synth.suites.definition import NUMBERS, PARAMETERS, TEXTS, LogSpec, Suite

FILE_NAME = re.compile(r"[\w][\w.+-]*")
_LOG_KEYS = ("name", "scenario", "seed", "seeds", *PARAMETERS)


def read_suite(path: Path) -> Suite:
    """Read and check a suite's file. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, ("name", "version", "description", "logs"))
    entries = tables.get("logs", [])
    if not isinstance(entries, list) or not entries:
        raise InvalidFile(path, "logs", "expected [[logs]], an array of tables")
    logs = [
        log for index, entry in enumerate(entries) for log in read_logs(path, f"[[logs]] #{index + 1}", entry)
    ]
    try:
        return Suite(
            file_name(path, "name", tables.get("name", path.stem)),
            whole(path, "version", tables.get("version", 1)),
            expect_text(path, "description", tables.get("description", "")),
            tuple(logs),
        )
    except InvalidSetting as error:
        raise InvalidFile(path, "", str(error)) from None


def read_logs(path: Path, place: str, entry: object) -> Iterator[LogSpec]:
    """The logs of one ``[[logs]]`` table: one for each seed."""
    table = expect_table(path, place, entry)
    check_keys(path, place, table, _LOG_KEYS)
    if "scenario" not in table:
        raise InvalidFile(path, f"{place} scenario", "missing; `wmr-replay synth --list` names them")
    scenario = expect_text(path, f"{place} scenario", table["scenario"])
    name = file_name(path, f"{place} name", table.get("name", scenario))
    parameters = {
        key: parameter(path, f"{place} {key}", key, table[key]) for key in PARAMETERS if key in table
    }
    try:
        for stem, seed in seeds(path, place, name, table):
            yield LogSpec(stem, scenario, seed, parameters)
    except InvalidSetting as error:
        raise InvalidFile(path, place, str(error)) from None


def seeds(path: Path, place: str, name: str, table: dict[str, Any]) -> list[tuple[str, int]]:
    """The names and seeds of the logs: ``seed``, or ``seeds`` with the seed behind each name."""
    if "seeds" not in table:
        return [(name, whole(path, f"{place} seed", table.get("seed", 0)))]
    values = table["seeds"]
    if "seed" in table or not isinstance(values, list) or not values:
        raise InvalidFile(path, f"{place} seeds", "expected a list of whole numbers, and no `seed` beside it")
    return [(f"{name}-s{value}", whole(path, f"{place} seeds", value)) for value in values]


def parameter(path: Path, key: str, name: str, value: object) -> object:
    """A parameter's value, of its kind."""
    if name in NUMBERS:
        return expect_number(path, key, value)
    if name in TEXTS:
        return expect_text(path, key, value)
    if name == "chunk_bytes":
        return whole(path, key, value)
    if name == "robot":
        return expect_table(path, key, value)
    if name == "hide":
        effects = value if isinstance(value, list) else [value]
        return [expect_text(path, key, effect) for effect in effects]
    if not isinstance(value, bool):
        raise InvalidFile(path, key, f"expected true or false, found {value!r}")
    return value


def whole(path: Path, key: str, value: object) -> int:
    """A whole number, not below 0."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise InvalidFile(path, key, f"expected a whole number, not below 0, found {value!r}")
    return value


def file_name(path: Path, key: str, value: object) -> str:
    """A text that can be the stem of a file."""
    text = expect_text(path, key, value)
    if not FILE_NAME.fullmatch(text):
        raise InvalidFile(path, key, f"expected letters, digits, '-', '_', '.', found {value!r}")
    return text

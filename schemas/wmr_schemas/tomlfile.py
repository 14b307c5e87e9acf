"""Reading TOML with messages that name the file and the place."""

import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from wmr_schemas.errors import InvalidFile


def read_toml(path: Path) -> dict[str, Any]:
    """The file's tables. Raises InvalidFile when it is missing or is not TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidFile(path, "", f"cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidFile(path, "", f"is not TOML: {error}") from None


def check_keys(path: Path | str, section: str, table: Mapping[str, object], known: Iterable[str]) -> None:
    """Every key of ``table`` is a known one."""
    names = list(known)
    for key in table:
        if key not in names:
            raise InvalidFile(path, f"{section} {key}".strip(), f"unknown key; known are {', '.join(names)}")


def expect_text(path: Path | str, key: str, value: object) -> str:
    """A string."""
    if not isinstance(value, str):
        raise InvalidFile(path, key, f"expected a string, found {value!r}")
    return value


def expect_table(path: Path | str, key: str, value: object) -> dict[str, Any]:
    """A TOML table."""
    if not isinstance(value, dict):
        raise InvalidFile(path, key, f"expected a table, found {value!r}")
    return value


def expect_number(path: Path | str, key: str, value: object) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidFile(path, key, f"expected a finite number, found {value!r}")
    return float(value)

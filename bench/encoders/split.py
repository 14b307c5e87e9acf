"""The split of driver families and of conditions: those to develop on, and those that are only reported."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

PATH = Path(__file__).with_name("split.toml")


@dataclass(frozen=True)
class Part:
    """Driver families, conditions of pose and floor, and the first seed of a part of the split.

    ``coloured`` are conditions that are reported apart from the others.
    """

    families: tuple[str, ...]
    conditions: tuple[str, ...]
    first_seed: int
    coloured: tuple[str, ...] = ()


def part(name: str) -> Part:
    """``develop`` or ``report``."""
    table = tomllib.loads(PATH.read_text(encoding="utf-8"))[name]
    coloured = tuple(table.get("coloured", ()))
    return Part(tuple(table["families"]), tuple(table["conditions"]), table["first_seed"], coloured)

"""The split of the driver families: those to develop on, and two that are only reported."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

PATH = Path(__file__).with_name("split.toml")


@dataclass(frozen=True)
class Part:
    """Driver families and the first seed of a part of the split."""

    families: tuple[str, ...]
    first_seed: int


def part(name: str) -> Part:
    """``develop`` or ``report``."""
    table = tomllib.loads(PATH.read_text(encoding="utf-8"))[name]
    return Part(tuple(table["families"]), table["first_seed"])

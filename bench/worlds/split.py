"""The committed split: which families, plants and seeds are for tuning, and which for the report."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

FILE = Path(__file__).with_name("split.toml")


@dataclass(frozen=True)
class Part:
    """One part of the split: its cells (plant, family), and its first and last seed."""

    cells: tuple[tuple[int, str], ...]
    first_seed: int
    last_seed: int

    def check(self, plant: int, family: str, seed: int) -> None:
        """Raises ValueError for a log that is not of this part."""
        if (plant, family) not in self.cells:
            raise ValueError(f"{family} on plant {plant} is not in this part of the split")
        if not self.first_seed <= seed <= self.last_seed:
            raise ValueError(f"seed {seed} is not in {self.first_seed} to {self.last_seed}")


def part(name: str) -> Part:
    """The part called ``develop`` or ``report``."""
    table = tomllib.loads(FILE.read_text(encoding="utf-8"))[name]
    cells = tuple((cell["plant"], family) for cell in table["cells"] for family in cell["families"])
    return Part(cells, *table["seeds"])

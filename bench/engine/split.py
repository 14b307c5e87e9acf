"""The committed files: which robots, families and seeds are for tuning, and which names are accepted."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

from engine.robot import BY_WHEELS, FOUR_WHEELED

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Part:
    """One part of the split: its robots and driver families, and its first and last seed."""

    robots: tuple[str, ...]
    families: tuple[str, ...]
    first_seed: int
    last_seed: int

    def check(self, seed: int) -> None:
        """Raises ValueError for a seed that is not of this part."""
        if not self.first_seed <= seed <= self.last_seed:
            raise ValueError(f"seed {seed} is not in {self.first_seed} to {self.last_seed}")


def part(name: str) -> Part:
    """The part called ``develop`` or ``report``."""
    table = tomllib.loads((HERE / "split.toml").read_text(encoding="utf-8"))[name]
    return Part(tuple(table["robots"]), tuple(table["families"]), *table["seeds"])


def accepted(robot: str) -> dict[str, list[str]]:
    """Accepted names by effect of the engine, for the base model that the robot has."""
    tables = tomllib.loads((HERE / "accepted.toml").read_text(encoding="utf-8"))
    return dict(tables[table_of(robot)])


def makes_both(robot: str, effect: str) -> bool:
    """Whether an effect of the engine makes both of its accepted effects at once."""
    tables = tomllib.loads((HERE / "accepted.toml").read_text(encoding="utf-8"))
    return effect in tables["both"][table_of(robot)]


def table_of(robot: str) -> str:
    """The table of accepted names that holds for a robot."""
    if robot in FOUR_WHEELED:
        return "wheel_speed"
    return "two_wheels" if robot.endswith(BY_WHEELS) else "torque"

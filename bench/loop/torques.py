"""Pairs on the plants of ``worlds``: robot, hidden effect and its size are shared, the rest is not."""

from dataclasses import dataclass, replace

import numpy as np
from worlds.case import Case
from worlds.plant_two.effects import EFFECTS as ALL
from worlds.plant_two.effects import LOCAL
from worlds.simulate import simulated
from worlds.split import part

from loop.pair import Pair
from wmr_replay.gap import GapOptions, analyse
from wmr_schemas.model_file import Effect, Model

EFFECTS = tuple(name for name in ALL if name not in LOCAL)
SAME = ("robot", "size", "place")
LATER = 4_000
"""By how much the seed of the second log lies behind that of the first."""


@dataclass(frozen=True)
class OtherDrive(Case):
    """Another drive of the robot of ``first``, with the same effect."""

    first: Case | None = None

    def stream(self, purpose: str, *part: int) -> np.random.Generator:
        """The first log's stream where robot and effect are drawn, an own one elsewhere."""
        if purpose in SAME and self.first is not None:
            return self.first.stream(purpose, *part)
        return super().stream(purpose, *part)


def pair(split: str, effect: str, noise: str, seed: int, cell: int, seconds: tuple[float, float]) -> Pair:
    """Two drives by two families of a part of the split, on one plant. Raises RanAway."""
    cells = part(split).cells
    plant, family = cells[cell % len(cells)]
    families = [name for number, name in cells if number == plant]
    next_family = families[(families.index(family) + 1) % len(families)]
    case = Case(plant, family, noise, effect, seed, seconds[0])
    first = simulated(case)
    drive = OtherDrive(plant, next_family, noise, effect, seed + LATER, seconds[1], case)
    world = simulated(with_size(drive, first.sizes))
    base = Model(robot=first.robot)
    true = replace(base, effects=(Effect(effect, first.sizes),))
    return Pair(
        first.without_modes(),
        world.without_modes(),
        base,
        true,
        world.truth.mode,
        world.truth.t_s,
        "auto",
        lambda log, model: analyse(log, model, GapOptions(modes="identified")),
        world.log.mode,
    )


def with_size(case: OtherDrive, sizes: dict[str, float]) -> Case:
    """The case with the effect in the first log's size; plant one takes it as ``--hide`` does."""
    if case.plant != 1 or not case.effect:
        return case
    text = ",".join(f"{key}={value!r}" for key, value in sizes.items())
    return replace(case, effect=f"{case.effect}:{text}")

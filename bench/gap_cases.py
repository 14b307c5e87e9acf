"""The cases of the gap benchmark: hidden effects, scenario and noise, by seed.

Set and index determine a case. Everything random in it follows from its seed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, cycle, islice

import numpy as np

from wmr_schemas.effects import BEYOND, named_of
from wmr_synth import Disturbance, Sensors, SimulatedLog, synthesise
from wmr_synth.driving.patrol import drawn_robot
from wmr_synth.hidden import DEFAULT_DISTURBANCE
from wmr_synth.hidden.world import drawn_world
from wmr_synth.sensors import NOISE_LEVELS

NOISES = tuple(NOISE_LEVELS)
STRONG = Disturbance(0.1, 1.0)
WRONG_MODES = 0.02
DURATION_S = 90.0
EFFECTS = named_of("torque")
SINGLES = tuple((name,) for name in EFFECTS)
BEYONDS = tuple((name,) for name in BEYOND)
NOTHING: tuple[tuple[str, ...], ...] = ((),)


@dataclass(frozen=True)
class CaseSet:
    """A set of cases.

    ``worlds`` are the combinations of effects. They are hidden in turn, each ``repeats`` times at each noise
    level. ``first`` is added to the base seed: sets with the same ``first`` share their logs.
    """

    name: str
    first: int
    worlds: tuple[tuple[str, ...], ...]
    repeats: int
    scenario: str = "patrol"
    modes: str = "given"
    disturbance: Disturbance = DEFAULT_DISTURBANCE


@dataclass(frozen=True)
class Case:
    """One log: its set, its index in the set, hidden effects, noise and seed."""

    set: CaseSet
    number: int
    hide: tuple[str, ...]
    noise: str
    seed: int

    @property
    def key(self) -> str:
        """Key of the case's row of results."""
        return f"{self.set.name}/{'+'.join(self.hide) or 'nothing'}/{self.noise}/{self.seed}"

    def simulated(self) -> SimulatedLog:
        """The simulated log, with the truth that the analysis does not get."""
        robot = drawn_robot(np.random.default_rng([self.seed, 1]))
        world = drawn_world(self.hide, self.seed, robot, DURATION_S, self.set.disturbance)
        sensors = Sensors(100.0, 100.0, *NOISE_LEVELS[self.noise])
        return synthesise(
            self.set.scenario,
            seed=self.seed,
            duration_s=DURATION_S,
            sensors=sensors,
            robot=robot,
            world=world,
            wrong_modes=WRONG_MODES,
        )


def drawn_pairs(n: int) -> tuple[tuple[str, str], ...]:
    """``n`` pairs of different effects, drawn with a fixed seed."""
    pairs = list(combinations(EFFECTS, 2))
    chosen = np.random.default_rng(20090).permutation(len(pairs))[:n]
    return tuple(pairs[k] for k in chosen)


SETS = (
    CaseSet("single", 0, SINGLES, 4),
    CaseSet("single-identified", 0, SINGLES, 4, modes="identified"),
    CaseSet("pair", 10_000, drawn_pairs(50), 1),
    CaseSet("nothing", 20_000, NOTHING, 240),
    CaseSet("nothing-identified", 30_000, NOTHING, 100, modes="identified"),
    CaseSet("cruise-nothing", 40_000, NOTHING, 30, scenario="cruise"),
    CaseSet("cruise-single", 50_000, SINGLES, 1, scenario="cruise"),
    CaseSet("strong-nothing", 60_000, NOTHING, 30, disturbance=STRONG),
    CaseSet("strong-single", 70_000, SINGLES, 1, disturbance=STRONG),
    CaseSet("beyond", 80_000, BEYONDS, 5),
)
QUICK = {"single": 1, "single-identified": 1, "nothing": 10, "cruise-nothing": 3, "strong-nothing": 3}
"""Repeats in a quick run, by set."""


def cases_of(case_set: CaseSet, base_seed: int) -> Iterator[Case]:
    """The cases of a set in order: one case of each world at each noise before any repeats."""
    n = len(case_set.worlds) * case_set.repeats * len(NOISES)
    worlds = [world for world in case_set.worlds for _ in NOISES]
    for k, (hide, noise) in enumerate(islice(zip(cycle(worlds), cycle(NOISES), strict=False), n)):
        yield Case(case_set, k, hide, noise, base_seed + case_set.first + k)


def chosen_sets(choice: str) -> Sequence[CaseSet]:
    """The sets of ``all``, ``quick`` or comma-separated names.

    Raises SystemExit with the known sets if a name is unknown.
    """
    if choice == "all":
        return SETS
    if choice == "quick":
        return [replace(s, repeats=QUICK[s.name]) for s in SETS if s.name in QUICK]
    known = {s.name: s for s in SETS}
    unknown = set(choice.split(",")) - set(known)
    if unknown:
        raise SystemExit(f"no set {', '.join(sorted(unknown))}; known are all, quick, {', '.join(known)}")
    return [known[name] for name in choice.split(",")]

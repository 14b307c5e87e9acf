"""What a log's data can tell of its hidden form, by the rules of ``worlds.oracle``.

Written before the report of its forms.
A form of an expected 2 log-likelihood below 31 against nothing may be refused, and so may one that moves the
path by less than the tolerance. An effect of the library that leaves less than 33 of the form's own, at the
effect's best size, time or lag, may be said in its place. Such logs are counted apart, where that is said.

Since the thirteenth report, what an answer says is held against the form itself, too, with the sizes that it
says: where less than 33 of the difference is left, the log cannot tell the two. So |effort| is as good as
|effort|·sgn(v) on a drive that never reverses.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from worlds import oracle
from worlds.oracle_filter import moved_m, steps_of, whitened
from worlds.oracle_forms import Signals, Trace, accelerating, signals_of, trace

from formulas.plants import HiddenWorld
from formulas.score import UNNAMED, part_of

PLACES = ("low_friction_patch",)
"""Left out of the rivals: a loss of traction in one place is none of the forms."""


@dataclass(frozen=True)
class Judgement:
    """Expected 2 log-likelihood of the form against nothing, how far it moves the path within 4 s, and what
    the near effects of the library leave of it.
    """

    own: float
    moved_m: float
    near: dict[str, float]

    def excuses(self, said: list[str]) -> bool:
        """Whether the data cannot tell what is said from the form."""
        if not said:
            return self.own < oracle.SEEN or self.moved_m < oracle.TOLERANCE_M
        return len(said) == 1 and said[0] in self.near


def hidden_trace(world: HiddenWorld, s: Signals) -> Trace:
    """The form's acceleration along the true motion."""
    ahead, turning = world.hidden.both(world.at())
    t_s = world.world.truth.t_s
    return accelerating(s, np.interp(s.t_s, t_s, ahead), 0.0, np.interp(s.t_s, t_s, turning))


def judged(world: HiddenWorld) -> Judgement:
    """The rules' word on a world with a hidden form."""
    s = signals_of(world.world)
    hidden = hidden_trace(world, s)
    rivals = [block for block in oracle.blocks(s, oracle.COARSE_S) if block.name not in PLACES]
    traces = [hidden, *(trace(block.name, sizes, s) for block in rivals for sizes in block.parameters)]
    steps = steps_of(s, world.world.conditions, world.world.case.noise_sd)
    columns = whitened(steps, traces)
    g, place, left = columns[:, 0], 1, dict[str, float]()
    for block in rivals:
        width = len(block.parameters)
        found = oracle.left_over(g, columns[:, place : place + width], block.bounds)
        left[block.name] = min(left.get(block.name, np.inf), found)
        place += width
    near = {name: value for name, value in left.items() if value < oracle.SEPARATED}
    return Judgement(float(g @ g), moved_m(steps, hidden, oracle.TOLERANCE_S), near)


def difference(world: HiddenWorld, effects: Iterable[Mapping[str, Any]]) -> float:
    """Expected 2 log-likelihood of the hidden form against what ``effects`` say, with their sizes; infinite
    where one of them has no trace.
    """
    s = signals_of(world.world)
    total = hidden_trace(world, s)
    for effect in effects:
        try:
            said = said_trace(world, s, effect["name"], {k: p[0] for k, p in effect["parameters"].items()})
        except KeyError:
            return float("inf")
        total = Trace(total.acceleration - said.acceleration, total.pose - said.pose)
    g = whitened(steps_of(s, world.world.conditions, world.world.case.noise_sd), [total])[:, 0]
    return float(g @ g)


def said_trace(world: HiddenWorld, s: Signals, name: str, values: dict[str, float]) -> Trace:
    """An effect along the true motion: a term as the manual defines it, others as they are declared."""
    if not name.startswith(UNNAMED):
        return trace(name, values, s)
    part, t_s = part_of(name, values, world.world.robot), world.world.truth.t_s
    along = np.interp(s.t_s, t_s, part.of(world.at()))
    return accelerating(s, along) if part.channel == "longitudinal" else accelerating(s, turn=along)

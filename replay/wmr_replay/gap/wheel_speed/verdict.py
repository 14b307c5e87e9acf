"""The verdict of a selection, and the notes that say why it is no firmer."""

import numpy as np

from wmr_replay.gap.result.result import Detectable, Verdict
from wmr_replay.gap.wheel_speed.disagreement import Disagreement
from wmr_replay.gap.wheel_speed.predict import DECLARED, Problem
from wmr_replay.gap.wheel_speed.select import Selection
from wmr_schemas.arrays import F64
from wmr_schemas.slip_terms import is_slip_term


def said_of(standing: Disagreement) -> str:
    """A disagreement that stands, in words."""
    return f"{standing.text}, which no effect explains"


def verdict_of(
    problem: Problem,
    selection: Selection,
    detectable: dict[str, Detectable],
    standing: Disagreement | None,
) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict, and notes that say why it is no firmer, or what no effect explains."""
    if any(is_slip_term(one.name) for one in selection.found):
        return "unnamed", ()
    if selection.found:
        close = [
            f"{one.name} and {other} explain the log almost equally well"
            for one in selection.found
            for other, delta in one.alternatives
            if delta < 10.0
        ]
        return ("ambiguous", tuple(close)) if close else ("named", ())
    if standing is not None:
        return "unnamed", (standing.text,)
    if reason := too_calm(problem):
        return "not_enough_excitation", (reason,)
    hidden = [
        name
        for name, least in detectable.items()
        if (relevant := DECLARED[name].relevant) is not None and least.value > relevant
    ]
    if len(hidden) > problem.settings.gates.most_unseen:
        return "not_enough_excitation", ("the log would not have shown " + ", ".join(hidden),)
    return "nothing_missing", ()


def too_calm(problem: Problem) -> str:
    """Why the driving shows nothing; empty where it may."""
    own, driven = problem.settings.gates, too_short_a_way(problem)
    if driven:
        return driven
    turned = float(steps_of(problem)[2])
    if turned < own.least_turning_rad:
        return f"the robot turns by {turned:.2g} rad (at least {own.least_turning_rad:g} rad are needed)"
    return ""


def too_short_a_way(problem: Problem) -> str:
    """Says that the wheels hardly drive; empty where they do."""
    own, driven = problem.settings.gates, float(steps_of(problem)[0])
    if driven < own.least_driven_m:
        return f"the wheels drive {driven:.2g} m in the log (at least {own.least_driven_m:g} m are needed)"
    return ""


def steps_of(problem: Problem) -> F64:
    """How far the wheels drive ahead and sideways [m], and turn [rad], (3,)."""
    way = problem.bins.blocks(problem.predicted({}))
    inside = problem.bins.inside[:, 1:]
    return np.asarray(np.where(inside, np.abs(np.diff(way, axis=-1)), 0.0).sum(axis=(1, 2)))

"""Whether a loss of traction stands out of the slips that come and go on a record.

A wheel that spins is a contact mode. A loss in a time or a place is an effect only where it is not one slip
more: a record whose other slips are as steady, and nearly as long, has slipped once more.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.wheel_speed.estimate import Fit
from wmr_replay.gap.wheel_speed.modes import slipping
from wmr_replay.gap.wheel_speed.places import LOSSES, Rates, inside_of
from wmr_replay.gap.wheel_speed.predict import Problem, summed
from wmr_schemas.arrays import Bool


def stands_out(problem: Problem, before: Fit, after: Fit, name: str) -> bool:
    """Whether a loss in an interval or a disc lasts clearly longer than every other steady slip."""
    own, whole = problem.settings.gates, problem.with_slip
    place, rates = after.values[name], Rates(problem, before.values)
    inside = inside_of(whole, place, name)
    lasting_s, _ = rates.steadiness(inside, place["loss"], own)
    others = slipping(replace(whole, base=summed(whole.base, after.values))) & ~beside(inside)
    gains = rates.gains()
    for run in runs(others):
        loss = float(LOSSES[int(np.argmax(gains[:, run].sum(axis=1)))])
        seconds, share = rates.steadiness(run, loss, own)
        if share >= own.least_steady_share and lasting_s < own.least_beyond_usual * seconds:
            return False
    return True


def runs(chosen: Bool) -> list[Bool]:
    """The runs of chosen bins (n,), each as a mask of its own."""
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    at = np.arange(len(chosen))
    return [(at >= start) & (at < end) for start, end in edges]


def beside(inside: Bool) -> Bool:
    """Chosen bins (n,) and their two neighbours on each side, which a difference over two bins reaches."""
    return np.asarray(np.convolve(inside, np.ones(5), mode="same") > 0)

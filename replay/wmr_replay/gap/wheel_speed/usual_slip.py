"""Whether a loss of traction stands out of the slips that come and go on a record.

A wheel that spins and a robot that skids are contact modes. A loss in a time or a place is an effect only
where it is not one slip more of that kind.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.wheel_speed.bins import bins_of
from wmr_replay.gap.wheel_speed.estimate import Fit
from wmr_replay.gap.wheel_speed.evidence import driving, inside_of
from wmr_replay.gap.wheel_speed.modes import slipping
from wmr_replay.gap.wheel_speed.predict import Problem, summed
from wmr_schemas.arrays import F64, Bool


def stands_out(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a loss in an interval or a disc is more than another slip.

    A disc that the robot crossed more than once stands out, since all of its crossings agree on the loss.
    An interval, or a disc crossed once, has to last longer than slips do, and clearly longer than each other
    slip of the record.
    """
    own, whole = problem.settings.gates, problem.with_slip
    inside = inside_of(whole, fit.values[name], name)
    lasting = lengths_s(whole, inside & driving(whole))
    if name == "low_grip_patch" and (lasting > own.least_crossing_s).sum() > 1:
        return True
    others = slipping(replace(whole, base=summed(whole.base, fit.values))) & ~beside(inside)
    usual_s = lengths_s(whole, others).max(initial=0.0)
    return bool(lasting.sum() > max(own.least_interval_s, own.least_beyond_usual * usual_s))


def lasting_alone(problem: Problem, fit: Fit) -> Problem:
    """The problem with slip, less the slips that are too short to be an effect."""
    whole = problem.with_slip
    slips = slipping(replace(whole, base=summed(whole.base, fit.values)))
    edges = np.diff(slips.astype(np.int8), prepend=0, append=0)
    start, end = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    long = (end - start) * whole.bins.step_s > whole.settings.gates.least_interval_s
    marks = np.zeros(len(slips) + 1, np.int64)
    np.add.at(marks, start[~long], 1)
    np.add.at(marks, end[~long], -1)
    brief = beside(np.cumsum(marks[:-1]) > 0)
    return replace(
        whole, bins=bins_of(whole.record, whole.settings.layout, np.repeat(brief, whole.bins.count))
    )


def lengths_s(problem: Problem, chosen: Bool) -> F64:
    """Durations (k,) of the runs of chosen bins (n,)."""
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0))
    return np.asarray((edges[1::2] - edges[::2]) * problem.bins.step_s)


def beside(inside: Bool) -> Bool:
    """Chosen bins (n,) and their two neighbours on each side, which a difference over two bins reaches."""
    return np.asarray(np.convolve(inside, np.ones(5), mode="same") > 0)

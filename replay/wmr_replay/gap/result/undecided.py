"""What the model's own contact modes cannot be told from, where nothing is named."""

from collections.abc import Mapping

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.result.result import Detectable
from wmr_replay.gap.search.slip_test import slipping_runs, unlike_slipping


def slip_or_loss(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """Intervals that are called slipping and lose clearly more or less than the model's slipping does.

    No effect was found likelier there, so both are said, with their sizes. The level is 1 % for the whole
    log.
    """
    binned = problem.binned
    if not binned.identified:
        return ()
    doubts, n = unlike_slipping(problem, fit), len(slipping_runs(binned))
    level = problem.settings.significance.level / max(n, 1)
    base = fit.extension.base
    own = (
        f"the model's slipping: {1 - base.slip_share:.0%} ahead and {1 - base.slip_share_yaw:.0%} in turning"
    )
    return tuple(
        f"from {binned.t_s[d.first]:.1f} to {binned.t_s[d.last - 1]:.1f} s the robot slips, or a "
        f"slip_interval or low_friction_patch takes {d.loss:.0%} of the traction ({own})"
        for d in doubts
        if np.exp(-d.distance / 2) < level
    )


def skidding_note(problem: Problem, detectable: Mapping[str, Detectable]) -> tuple[str, ...]:
    """That identified skidding may hide tyres of another stiffness, with its duration and their size."""
    binned, least_s = problem.binned, problem.settings.slip.shortest_inside_s
    seconds = float(binned.step_s[binned.skids].sum())
    if not binned.identified or seconds < least_s:
        return ()
    first_s, least = float(binned.t_s[int(np.argmax(binned.skids))]), detectable.get("cornering_stiffness")
    other = f"that differs by less than {least.value:.0%}" if least is not None else "of another size"
    return (
        f"skidding is identified for {seconds:.1f} s, first at {first_s:.1f} s: a cornering stiffness "
        f"{other} cannot be told from skids that begin or end at slightly other times",
    )

"""What the model's own contact modes cannot be told from, where nothing is named."""

from collections.abc import Mapping

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.result.result import Detectable
from wmr_replay.gap.search.slip_doubts import Doubt, slipping_runs, unlike_slipping


def slip_or_loss(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """Intervals that are called slipping and lose clearly more or less than the model's slipping does.

    No effect was found likelier there, so what may be there is said, with the sizes. The level is 1 % for the
    whole log.
    """
    binned = problem.binned
    if not binned.identified:
        return ()
    doubts, n = unlike_slipping(problem, fit), len(slipping_runs(binned))
    level = problem.settings.significance.level / max(n, 1)
    return tuple(as_said(problem, fit, doubt) for doubt in doubts if np.exp(-doubt.distance / 2) < level)


def as_said(problem: Problem, fit: Fit, doubt: Doubt) -> str:
    """One such interval in words; where next to no traction is lost, it is said not to slip."""
    binned, base = problem.binned, fit.extension.base
    when = f"from {binned.t_s[doubt.first]:.1f} to {binned.t_s[doubt.last - 1]:.1f} s"
    own = (
        f"the model's slipping: {1 - base.slip_share:.0%} ahead and {1 - base.slip_share_yaw:.0%} in turning"
    )
    if doubt.loss < problem.settings.slip.least_apart:
        return (
            f"{when} the robot is called slipping and does not slip: {doubt.loss:.0%} of the traction is "
            f"lost ({own}), so that the identifier takes something else for slipping"
        )
    return (
        f"{when} the robot slips, or a slip_interval or low_friction_patch takes {doubt.loss:.0%} of the "
        f"traction ({own})"
    )


def skidding_note(problem: Problem, detectable: Mapping[str, Detectable]) -> tuple[str, ...]:
    """That identified skidding may hide tyres of another stiffness, with its duration and their size."""
    binned, least_s = problem.binned, problem.settings.slip.shortest_inside_s
    seconds = float(binned.step_s[binned.skids].sum())
    if not binned.identified or seconds < least_s:
        return ()
    first_s, least = float(binned.t_s[int(np.argmax(binned.skids))]), detectable.get("cornering_stiffness")
    other = (
        f"that differs by less than {shown_share(least.value)}"
        if least is not None and np.isfinite(least.value)
        else "of another size"
    )
    return (
        f"skidding is identified for {seconds:.1f} s, first at {first_s:.1f} s: a cornering stiffness "
        f"{other} cannot be told from skids that begin or end at slightly other times",
    )


def shown_share(share: float) -> str:
    """A share in whole per cent, a smaller one with its first digit."""
    return f"{share:.0%}" if share >= 0.01 else f"{100 * share:.1g}%"

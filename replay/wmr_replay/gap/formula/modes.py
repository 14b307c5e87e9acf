"""Formulas as models that contact modes are identified with, and which of two such models is the likelier."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed, no_more_than_calm
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, cost_of, evaluate, fit_model
from wmr_replay.gap.estimation.relabel import with_slipping
from wmr_replay.gap.estimation.smoothed_modes import with_smoothed_modes
from wmr_replay.gap.formula.groups import CURVE, groups_of
from wmr_replay.gap.formula.grow import grow
from wmr_replay.gap.formula.scores import ScoredGroup, excess, log_n, scored_groups, with_group
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_schemas.arrays import Bool
from wmr_schemas.signals import Log


@dataclass(frozen=True, eq=False)
class Start:
    """A fitted model with the modes that it was fitted with, the model ``rest`` without its formula, and the
    price of its terms.
    """

    problem: Problem
    fit: Fit
    rest: Extension
    price: float = 0.0


def may_slip_less(problem: Problem) -> bool:
    """Whether an identifier sees so much slipping that a missing acceleration may hide in it."""
    return float(np.mean(problem.binned.slips)) > problem.settings.modes.much_slip


def sees_the_same(one: Problem, other: Problem) -> bool:
    """Whether two problems have the same modes, but for a switch here and there."""
    return float(np.mean(one.binned.mode != other.binned.mode)) < one.settings.modes.much_slip


def is_calm(start: Start) -> bool:
    """Whether a model leaves no disturbance that a formula may explain."""
    settings = start.problem.settings
    return calmed(start.fit.noise, settings.diffusion, settings.formula.something_left) is None


def curve_starts(problem: Problem, base: Fit) -> list[Start]:
    """The curves that explain most beside the base model, each fitted: at the disturbance that is left, and
    at a calm one; of the efforts, which is what slipping looks like, and of the motion. And the group with
    numbers that explains most, where it explains more than they do.
    """
    tried = groups_of(problem.binned, problem.settings.formula)
    curves = [group for group in tried.groups if group.family == CURVE]
    chosen: dict[tuple[str, ...], ScoredGroup] = {}
    for noise in filter(None, (base.noise, calmed(base.noise, problem.settings.diffusion))):
        here = base if noise is base.noise else evaluate(problem, base.extension, noise)
        kinds: dict[bool, ScoredGroup] = {}
        for one in scored_groups(problem, here, curves):
            kinds.setdefault("effort" in one.group.names[0], one)
        some = [*kinds.values()]
        least = max(excess(problem, one) for one in some)
        some += [one for one in winners(problem, here, tried.shaped)[:1] if excess(problem, one) > least]
        chosen |= {one.group.names: one for one in some}
    return [started(problem, base, one) for one in chosen.values()]


def rolling_starts(problem: Problem, base: Fit) -> list[Start]:
    """The formula and the curves that explain most if the robot never slips, each fitted.

    Slipping that is only a name for what the model lacks takes the rows that show it. Where all rows roll, a
    term that always acts is seen on all of them; slips that are real come back with the identifier.
    """
    rolled = problem.relabelled(with_slipping(problem.binned, np.zeros(len(problem.binned), bool)))
    rest = fit_model(rolled, base.extension, None, problem.settings.budget.base_diffusion)
    grown = grow(rolled, rest, groups_of(rolled.binned, problem.settings.formula))
    whole = Start(rolled, grown.fit, rest.extension, grown.price(rolled))
    return [*([whole] if grown.groups else []), *curve_starts(rolled, rest)]


def started(problem: Problem, base: Fit, scored: ScoredGroup) -> Start:
    """The base model with a curve, fitted with its disturbance."""
    extension, budget = with_group(base.extension, scored), problem.settings.budget
    fit = fit_model(problem, extension, base.noise, budget.best_diffusion, budget.last_steps)
    return Start(problem, fit, base.extension, scored.group.price(log_n(problem)))


def once_more(log: Log, start: Start, options: GapOptions) -> Start:
    """The model fitted with the modes that are seen with it: by the identifier, or by the likelihood that
    sums over the modes, whichever it is likelier with.

    The identifier knows no disturbance. The likelihood is asked with a calm one first, as wrong modes leave a
    large one that explains all slips, and then with the one that is left.
    """
    track = likely_modes(log, start.fit.extension, options.gates, start.fit.noise)
    problem = Problem.of(bin_identified(log, track, options.gates))
    seen, last = [refitted(start, problem)], start
    noise = no_more_than_calm(start.fit.noise, problem.settings.diffusion)
    for _ in range(problem.settings.modes.smoothed):
        last = refitted(last, with_smoothed_modes(problem, last.fit.extension, noise))
        seen, noise = [*seen, last], last.fit.noise
    return min(seen, key=whole_cost)


def refitted(start: Start, problem: Problem) -> Start:
    """The model fitted with a problem's modes."""
    iterations = problem.settings.budget.best_diffusion
    fit = fit_model(problem, start.fit.extension, start.fit.noise, iterations)
    return replace(start, problem=problem, fit=fit)


def likeliest(starts: Sequence[Start]) -> Start | None:
    """The start of the least cost with its own modes: the settings are the same for all of them, and a row
    that slips is predicted loosely, which costs.
    """
    return min(starts, key=whole_cost, default=None)


def whole_cost(start: Start) -> float:
    """The cost of a model with its modes, and of its terms."""
    return cost_of(start.fit) + start.price


def is_likelier(one: Start, other: Start) -> bool:
    """Whether a model with its modes costs less than another one with its own: on all rows, or on those that
    roll with both.

    A row that slips is predicted loosely, and hides what a model lacks; so does a larger disturbance on rows
    that are said to roll and slip. Where both roll, the better model has the smaller errors.
    """
    whole = [whole_cost(start) for start in (one, other)]
    rows = rolls(one.problem) & rolls(other.problem)
    return whole[0] < whole[1] or cost_on(one, rows) < cost_on(other, rows)


def rolls(problem: Problem) -> Bool:
    """The fitted rows (n,) that do not slip, and are not next to a change of the mode."""
    binned, slips = problem.binned, problem.binned.slips
    near = np.convolve(
        np.diff(binned.mode, prepend=binned.mode[:1]) != 0, np.ones(2 * binned.margin + 1), "same"
    )
    return np.asarray(problem.train & ~slips & (near < 0.5))


def cost_on(start: Start, rows: Bool) -> float:
    """The cost of a model with its modes on some rows."""
    problem = start.problem
    changes = np.sum(np.diff(problem.binned.mode, prepend=problem.binned.mode[:1])[problem.train] != 0)
    return (
        float(start.fit.row_deviance[rows].sum() + changes * problem.settings.modes.change_cost) + start.price
    )

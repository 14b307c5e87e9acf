"""Groups of terms that a log asks for whatever its contact modes are.

An identifier that lacks an acceleration calls it slipping or skidding; with those labels, no group explains
what it hides. So the groups are scored as if the robot rolled all the time, where slips are a few rows that
nothing explains, and those that promise most are held against each other by a likelihood that sums over the
modes (:mod:`..search.whatever_modes`). What it shows is a model to identify the modes with, and no answer.
"""

from wmr_replay.gap.estimation.diffusion import diffusion_of, no_more_than_calm
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate
from wmr_replay.gap.formula.groups import Tried, groups_of
from wmr_replay.gap.formula.modes import Start
from wmr_replay.gap.formula.scores import log_n, with_group
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.search.whatever_modes import (
    Deviance,
    Point,
    all_rolling,
    cost_of_point,
    likeliest_sizes,
    unlabelled_deviance,
)


def unlabelled_starts(problem: Problem, base: Fit) -> list[Start]:
    """The model ``base`` with one group: the likeliest whatever the modes, and what is nearly as likely.

    None that is not clearly likelier than that model. Disturbances are calm, so that they do not explain what
    is missing.
    """
    settings = problem.settings
    rolling, noise = all_rolling(problem), no_more_than_calm(base.noise, settings.diffusion)
    deviance = unlabelled_deviance(rolling, noise)
    nothing = float(deviance(base.extension).sum())
    noises = (noise, diffusion_of(settings.diffusion.start_log, settings.diffusion))
    ats = [evaluate(rolling.all_fitted(), base.extension, one) for one in noises]
    found = likeliest_sizes(scored_points(ats, deviance), deviance, nothing, settings)
    if not found:
        return []
    most = min(nothing - settings.modes.least_doubt, found[0].cost + settings.modes.hopeless)
    likely = [point for point in found if point.cost < most][: settings.unlabelled.most_models]
    return [
        Start(problem, evaluate(problem, point.extension, noise), base.extension, point.price)
        for point in likely
    ]


def tried_beside(at: Fit) -> Tried:
    """What is tried beside the effects of a fit."""
    return groups_of(at.problem.binned, at.problem.settings.formula).beside(at.extension.effects)


def scored_points(ats: list[Fit], deviance: Deviance) -> list[Point]:
    """The groups that promise most at each of the fits, with the sizes and numbers that promise it; of the
    same terms the likelier.
    """
    points: dict[tuple[str, ...], Point] = {}
    for at in ats:
        for scored in winners(at.problem, at, tried_beside(at)):
            finer = refined(at.problem, at, scored)
            extension = with_group(at.extension, finer)
            candidates = tuple(candidate_of(name) for name in finer.group.names)
            price = finer.group.price(log_n(at.problem))
            point = Point(candidates, extension, deviance(extension), price)
            names = finer.group.names
            points[names] = min(point, points.get(names, point), key=cost_of_point)
    return list(points.values())

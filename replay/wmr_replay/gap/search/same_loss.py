"""A loss of traction that acts once, as one in a time and as one in a place.

Where a robot crosses a disc once, a loss there and one in the time of that crossing differ in the form of
their ends alone: soft in distance, or in time. A scan looks for both on grids of their own, and may miss the
one that is the same as the other. So each is fitted from the rows of the other.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.extension import Parameters, weight
from wmr_replay.gap.search.fit_candidates import FittedCandidate, price_of
from wmr_replay.gap.search.starts import search_edges
from wmr_schemas.arrays import F64

OTHER_FORM = {"slip_interval": "low_friction_patch", "low_friction_patch": "slip_interval"}


def with_both_forms(
    problem: Problem, current: Fit, found: tuple[FittedCandidate, ...]
) -> tuple[Fit, tuple[FittedCandidate, ...]]:
    """The model and its effects, each loss of traction that acts once with its other form as an alternative;
    in the likelier form.
    """
    effects = list(found)
    for i, effect in enumerate(effects):
        if effect.name in LOCAL and OTHER_FORM[effect.name] not in current.extension.effects:
            current, effects[i] = in_both_forms(problem, current, effect)
    return current, tuple(effects)


def in_both_forms(problem: Problem, current: Fit, effect: FittedCandidate) -> tuple[Fit, FittedCandidate]:
    """One loss of traction of the model in the likelier form, the other one as its alternative."""
    start = other_form(problem.binned, current, effect.name)
    if start is None:
        return current, effect
    other = OTHER_FORM[effect.name]
    fit = fitted_from(problem, current, effect.name, start)
    scored = replace(effect.scored, name=other, parameters=dict(start))
    worse = fit.deviance + price_of(problem, scored, fit)
    worse -= current.deviance + price_of(problem, effect.scored, current)
    if worse >= 0:
        return current, with_alternative(effect, other, worse)
    gain = effect.gain + current.deviance - fit.deviance
    others = tuple((name, delta - worse) for name, delta in effect.alternatives if name != other)
    best = replace(effect, scored=scored, fit=fit, gain=gain, alternatives=others)
    return fit, with_alternative(best, effect.name, -worse)


def with_alternative(effect: FittedCandidate, name: str, worse: float) -> FittedCandidate:
    """The effect with ``name`` as an alternative, where it was no nearer one before."""
    others = dict(effect.alternatives)
    others[name] = min(worse, others.get(name, np.inf))
    return replace(effect, alternatives=tuple(sorted(others.items(), key=lambda one: one[1])))


def fitted_from(problem: Problem, current: Fit, name: str, start: Parameters) -> Fit:
    """The model with a loss of traction in its other form, fitted from ``start``."""
    other, budget = OTHER_FORM[name], problem.settings.budget
    extension = current.extension.without(name).with_effect(other, start)
    rough = fit_model(problem, extension, current.noise, budget.ranked_diffusion)
    edged = search_edges(problem.all_fitted(), rough, other)
    return fit_model(problem, edged, rough.noise, budget.ranked_diffusion)


def other_form(binned: BinnedLog, fit: Fit, name: str) -> Parameters | None:
    """A loss of traction of the model in a place where it stands in a time, or the other way round; None
    where it acts more than once.
    """
    parameters = fit.extension.effects[name]
    acts = weight(name, parameters, binned)
    visit = only_visit(binned, acts)
    if visit is None:
        return None
    loss, (first, last) = {"loss": parameters["loss"]}, visit
    if name == "low_friction_patch":
        return {"start_s": float(binned.t_s[first]), "end_s": float(binned.t_s[last - 1])} | loss
    felt = np.square(fit.extension.mean_torques(binned)).sum(axis=0) * binned.step_s
    return nearest_disc(binned, acts, felt, slice(first, last)) | loss


def only_visit(binned: BinnedLog, acts: F64) -> tuple[int, int] | None:
    """The rows [first, last) of the only stretch in which a loss of the weight ``acts`` (n,) acts, close ones
    joined; None where there are more or none.
    """
    own = binned.settings.slip
    rows = np.flatnonzero(acts > own.half)
    if not len(rows) or np.any(np.diff(binned.t_s[rows]) > own.close_s):
        return None
    return int(rows[0]), int(rows[-1]) + 1


def nearest_disc(binned: BinnedLog, acts: F64, felt: F64, visit: slice) -> dict[str, float]:
    """The disc whose weights come nearest to ``acts`` (n,), rows counted by ``felt`` (n,), the torques there.

    From the disc about the visit, centre and radius are moved in ever shorter steps.
    """
    own, path = binned.settings.scan, binned.pose[visit, :2]
    centre = (path.min(axis=0) + path.max(axis=0)) / 2
    best = np.array([*centre, np.hypot(*(path - centre).T).max()])

    def apart(disc: F64) -> float:
        place = dict(zip(("x_m", "y_m", "radius_m"), disc.tolist(), strict=True))
        return float(felt @ np.square(weight("low_friction_patch", place, binned) - acts))

    moves = [np.array(move) for move in product((-1, 0, 1), repeat=3) if any(move)]
    least = apart(best)
    for step in own.disc_steps_m:
        while True:
            tried = [best + step * move for move in moves]
            costs = [apart(disc) if disc[2] > own.disc_steps_m[-1] else np.inf for disc in tried]
            k = int(np.argmin(costs))
            if costs[k] >= least:
                break
            best, least = tried[k], costs[k]
    return dict(zip(("x_m", "y_m", "radius_m"), best.tolist(), strict=True))

"""The gates of a formula as a whole: significance, held-out proof, placebo, size, excitation."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import chdtrc, fdtrc

from wmr_replay.gap.estimation.covariance import robust_covariance, time_blocks
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, clipped, evaluate, fit_model, gauss_newton
from wmr_replay.gap.evidence.excitation import p_in_manoeuvres
from wmr_replay.gap.evidence.holdout import Proof, path_change, prove
from wmr_replay.gap.evidence.placebo import block_scores
from wmr_replay.gap.evidence.spread import may_be_nothing
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.groups import CURVE, Group, Tried
from wmr_replay.gap.formula.rests import beyond_rests
from wmr_replay.gap.formula.scores import chunked, efforts_of, log_n, places_in, sensitivities_to
from wmr_replay.gap.formula.screen import fitted_innovations, screen_of
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.score import NormalEquations, projected
from wmr_replay.gap.scan.turning_in_doubt import terms_in_doubt
from wmr_schemas.arrays import F64
from wmr_schemas.terms import COEFFICIENT, TermChannel, parse_term


def p_value_of(problem: Problem, formula: Formula) -> float:
    """The larger p of likelihood ratio and block-robust Wald test, times the groups that were tried.

    Sizes are tested on all rows: those that were held out rank no groups, and only let them pass.
    """
    whole, budget = problem.all_fitted(), problem.settings.budget
    fit = gauss_newton(whole, formula.fit.extension, formula.fit.noise, budget.last_steps)
    columns = [j for j, (name, _) in enumerate(fit.keys) if name in formula.names]
    V, n_blocks = robust_covariance(whole, fit)
    values = fit.values[columns]
    within = V[np.ix_(columns, columns)]
    wald = float(values @ np.linalg.lstsq(within, values, rcond=1e-10)[0]) / len(columns)
    by_wald = float(fdtrc(len(columns), max(n_blocks - len(columns), 1), wald))
    by_ratio = float(chdtrc(len(columns), max(formula.gain, 0.0)))
    n_tried = sum(group.n_tried for group in formula.groups)
    return min(max(by_wald, by_ratio) * n_tried, 1.0)


def by_channel(problem: Problem, formula: Formula) -> list[Formula]:
    """The terms of each channel on top of the model with all others, the weakest first.

    That model has its own disturbances, which are larger where terms explained them.
    """
    parts, budget = [], problem.settings.budget
    for channel in formula.channels:
        mine = tuple(group for group in formula.groups if group.terms[0].channel == channel)
        rest = formula.fit.extension
        for name in (name for group in mine for name in group.names):
            rest = rest.without(name)
        fit = fit_model(problem, rest, formula.rest.noise, budget.base_diffusion, budget.last_steps)
        parts.append(Formula(fit, formula.fit, mine))
    return sorted(parts, key=lambda part: part.gain)


def of_proven_channels(problem: Problem, formula: Formula, tried: Tried, options: GapOptions) -> Formula:
    """The formula without the weakest channel whose terms do not pass the gates beside the others.

    Accelerations ahead and in turning are two statements: what one of them explains says nothing of the
    other.
    """
    for part in by_channel(problem, formula) if len(formula.channels) > 1 else ():
        if why_not(problem, part, tried, options)[0]:
            left = tuple(group for group in formula.groups if group not in part.groups)
            return Formula(formula.rest, part.rest, left)
    return formula


def why_not(
    problem: Problem, formula: Formula, tried: Tried, options: GapOptions
) -> tuple[str, Proof | None]:
    """The first gate that a formula does not pass, empty where it passes all; and its held-out proof."""
    settings, rest, fit = problem.settings, formula.rest, formula.fit
    level = settings.significance.level
    if failed := too_small(problem, formula):
        return failed, None
    if p_value_of(problem, formula) > level or all(may_be_nothing(problem, fit, n) for n in formula.names):
        return "not significant", None
    proof = prove(problem, rest, fit)
    if not proof.holds:
        return "not proven on held-out windows", proof
    if placebo_p(problem, formula, tried, options.seed) > level:
        return "no more than what logs with nothing missing would show", proof
    small = path_change(problem, rest, fit, options.tolerance_s) < options.tolerance_m
    if small or only_answers(problem, formula):
        return "not seen where it would matter", proof
    return "", proof


def too_small(problem: Problem, formula: Formula) -> str:
    """Why a formula's size is none that matters; empty where it is one."""
    least_mps2, fit, names = problem.settings.formula.least_mps2, formula.fit, formula.names
    if size_of(accelerations(problem, fit, names)) < least_mps2:
        return "too small to matter"
    if terms_in_doubt(fit.extension, problem.binned, names):
        return "no more than the error of alpha_yaw"
    return "no more than the base model leaves" if beyond_base_mps2(problem, formula) < least_mps2 else ""


def only_answers(problem: Problem, formula: Formula) -> bool:
    """Whether a formula of speeds and efforts is not seen where the torques ask for a manoeuvre."""
    if all(parse_term(name).is_placed for name in formula.names):
        return False
    p = p_in_manoeuvres(problem, formula.fit, *formula.names)
    return p >= problem.settings.excitation.level


def accelerations(problem: Problem, fit: Fit, names: Sequence[str]) -> dict[TermChannel, F64]:
    """The terms' acceleration (n,) on each channel, m/s²."""
    columns = columns_of(problem.binned)
    total: dict[TermChannel, F64] = {}
    for name in names:
        term = parse_term(name)
        value = fit.extension.effects[name][COEFFICIENT] * term.evaluate(columns)
        total[term.channel] = total.get(term.channel, np.zeros(len(value))) + value
    return total


def size_of(by_channel: Mapping[TermChannel, F64]) -> float:
    """Root mean square of accelerations where they act, each row by its share of a²: √(Σ a⁴ / Σ a²), m/s²;
    the larger of both channels. What acts in a few places is as large as it is there.
    """
    squares = [value[value != 0] ** 2 for value in by_channel.values()]
    return max((float(np.sqrt(np.sum(a * a) / np.sum(a))) for a in squares if len(a)), default=0.0)


def beyond_base_mps2(problem: Problem, formula: Formula) -> float:
    """The size of what a formula says beyond what the base model leaves on its own calibration log."""
    extension, own = formula.rest.extension, problem.settings.misfit
    found = accelerations(problem, formula.fit, formula.names)
    return size_of({c: beyond_rests(value, c, extension, problem.binned, own) for c, value in found.items()})


def placebo_p(problem: Problem, formula: Formula, tried: Tried, seed: int) -> float:
    """Share of placebo logs of which one group explains as much as the formula does of the log.

    See :mod:`wmr_replay.gap.evidence.placebo`; here every group of the dictionary is tried on each of them.
    """
    rest, noise, settings = formula.rest, formula.fit.noise, problem.settings
    here = evaluate(problem, rest.extension, noise)
    whole = Group(CURVE, tuple(term for group in formula.groups for term in group.terms))
    all_groups = [whole, *formula.groups, *tried.groups]
    train, price = problem.train, log_n(problem)
    left = clipped(formula.fit.innovations[train], settings.refit)
    signs: F64 | None = None
    best, observed, single = np.zeros(settings.placebo.draws), 0.0, 0.0
    for part in chunked(all_groups, settings.formula.chunk):
        terms = [term for group in part for term in group.terms]
        psi, e = sensitivities_to(problem, here, efforts_of(problem, here, terms))
        flat = projected(psi[train], here.psi[train])
        G = flat.T @ flat
        scores = block_scores(problem, flat, left)
        if signs is None:
            draws = (settings.placebo.draws, len(scores))
            signs = np.random.default_rng(seed).choice((-1.0, 1.0), draws)
        own = NormalEquations(flat.T @ clipped(e[train], settings.refit).ravel(), G)
        placebos = signs @ scores
        for group, places in places_in(part):
            cost = group.price(price)
            if group is whole:
                observed = max(own.gain(places)[0] - formula.price(problem), 0.0)
                continue
            if group in formula.groups:
                single = max(single, own.gain(places)[0] - cost)
            inverse = np.linalg.pinv(G[np.ix_(places, places)], rcond=1e-10)
            gains = np.einsum("di,ij,dj->d", placebos[:, places], inverse, placebos[:, places])
            best = np.maximum(best, gains - cost)
    if signs is not None:
        best = np.maximum(best, best_of_grids(problem, here, formula, tried, signs))
    return float((1 + np.sum(best >= max(observed, single))) / (1 + len(best)))


def best_of_grids(problem: Problem, here: Fit, formula: Formula, tried: Tried, signs: F64) -> F64:
    """What the best group of the grids explains of each placebo log (draws,), less its price."""
    left = fitted_innovations(problem, formula.fit.innovations)
    block = np.zeros(len(problem.binned), int)
    block[problem.train] = np.unique(
        time_blocks(problem, problem.settings.placebo.block_s), return_inverse=True
    )[1]
    screen = screen_of(problem, here, left[:, :, None] * signs.T[block][:, None], here.psi)
    price, best = log_n(problem), np.zeros(len(signs))
    for grid in tried.grids:
        excess = screen.gains(grid) - tried.prices(grid, price)[:, None]
        best = np.maximum(best, excess.max(axis=0))
    return best

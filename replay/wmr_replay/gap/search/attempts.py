"""What might be missing next: the best leads, fitted in full and ranked."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.stats import chi2

from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.estimation.problem import CALM, Problem, calmed, fit_noise
from wmr_replay.gap.estimation.refit import Fit, gauss_newton, replaced
from wmr_replay.gap.evidence.holdout import Proof
from wmr_replay.gap.evidence.significance import robust_p
from wmr_replay.gap.model.candidates import candidate_of, is_place
from wmr_replay.gap.model.extension import Extension, weight
from wmr_replay.gap.search.leads import Lead, score_of
from wmr_replay.gap.search.scan import scan, scan_terms

MOST_FITTED = 6
CLOSE = 25.0
LEAST_GAIN, PROMISING = 8.0, 0.3
LEAST_SCORE, LEAST_SCORE_LATER = -10.0, 0.0
"""A lead that promises less is not worth a fit; the first makes the diffusion calmer, and gains by that."""
ONE_SIDE = 0.1
SEARCHED, CLEARLY = (1.0, 0.4, 0.15), 1.0
"""Steps of the search for an edge, s or m, and what a step must gain."""
CALM_LATERAL_MPS = float(np.exp(CALM[-1]))


@dataclass(frozen=True, eq=False)
class Tried:
    """A lead fitted in full, and how it stands."""

    lead: Lead
    fit: Fit
    gain: float
    score: float
    p_value: float
    likeness: float = 0.0
    proof: Proof | None = None
    failed: str = ""
    alternatives: tuple[tuple[str, float], ...] = ()


def fitted(
    problem: Problem,
    extension: Extension,
    noise: Diffusion | None = None,
    iterations: int = 5,
    steps: int = 3,
) -> Fit:
    """Effects and diffusion at the greatest likelihood, in turns."""
    if not extension.effects:
        noise, _ = fit_noise(problem, extension, noise, iterations)
        return gauss_newton(problem, extension, noise, 0)
    if noise is None:
        noise, _ = fit_noise(problem, extension, None, iterations)
    extension = gauss_newton(problem, extension, noise, steps).extension
    noise, _ = fit_noise(problem, extension, noise, iterations)
    return gauss_newton(problem, extension, noise, 2)


def attempts(problem: Problem, current: Fit, *, terms: bool) -> tuple[Tried, ...]:
    """The best leads fitted, the best first: ranked at the diffusion that the best lead leaves. Leads are the
    library's, or the dictionary's ``terms``.
    """
    first = likeliest(problem, current, terms=terms)
    if first is None:
        return ()
    best, noise = first[0], first[1].noise
    leads = ranked(problem, current, noise, terms=terms)
    if best.name not in [lead.name for lead in leads[:MOST_FITTED]]:
        leads = [best, *leads]
    least = PROMISING * max(score_of(lead) for lead in leads)
    worthy = [lead for lead in leads[:MOST_FITTED] if lead.gain > LEAST_GAIN and score_of(lead) >= least]
    promising = [started(problem, current, lead) for lead in worthy or leads[:1]]
    quick = [(lead, gauss_newton(problem, joined(current, lead), noise, 4)) for lead in promising]
    quick.sort(key=lambda pair: pair[1].deviance + cost_of(problem, *pair))
    families = len({lead.name for lead in leads})
    out = []
    for i, (lead, roughly) in enumerate(quick):
        fit = fitted(problem, placed(problem, roughly, lead.name), noise, 3, 1) if i < 2 else roughly
        if not begins_or_ends_with_the_log(problem, fit, lead.name):
            out.append(tried_of(problem, current, lead, fit, families))
    return decided(problem, tuple(sorted(out, key=lambda a: -a.score)))


def likeliest(problem: Problem, current: Fit, *, terms: bool) -> tuple[Lead, Fit] | None:
    """The best lead with its fit. What a lasting effect does, a slow disturbance does too, and where the
    diffusion has taken it in, a scan shows little: so the best of a scan with calm disturbances is asked too.
    """
    least = LEAST_SCORE_LATER if current.keys else LEAST_SCORE
    best = leads_of(problem, current, current.noise, terms=terms)[0]
    asked = [best] if score_of(best) >= least else []
    calm = calmed(current.noise)
    if calm is not None:
        other = ranked(problem, current, calm, terms=terms)[0]
        new = other.name not in [lead.name for lead in asked]
        asked += [other] if score_of(other) >= least and new else []
    leads = [started(problem, current, lead) for lead in asked]
    tries = [(lead, fitted(problem, joined(current, lead), current.noise, 4)) for lead in leads]
    return min(tries, key=lambda pair: pair[1].deviance + cost_of(problem, *pair), default=None)


def ranked(problem: Problem, current: Fit, noise: Diffusion, *, terms: bool) -> list[Lead]:
    """Leads at another diffusion than the current fit's, the best first."""
    here = gauss_newton(problem, current.extension, noise, 2 if current.extension.effects else 0)
    return leads_of(problem, here, noise, terms=terms)


def leads_of(problem: Problem, current: Fit, noise: Diffusion, *, terms: bool) -> list[Lead]:
    """What a scan at the diffusion ``noise`` finds, the best first."""
    if terms:
        leads = scan_terms(problem, current.extension, noise, current.psi)
    else:
        leads = scan(problem, current.extension, noise, current.psi).leads
    return sorted(leads, key=score_of, reverse=True)


def tried_of(problem: Problem, current: Fit, lead: Lead, fit: Fit, families: int) -> Tried:
    """Gain, score and significance. The last is corrected for everything scanned: each of the ``families``
    has an equal share of the level, and within it each time and place (weighted Bonferroni).
    """
    gain = current.deviance - fit.deviance
    by_ratio = chi2.sf(max(gain, 0.0), len(lead.parameters))
    p_value = max(by_ratio, robust_p(problem, fit, lead.name)) * families * lead.tried
    return Tried(lead, fit, gain, gain - cost_of(problem, lead, fit), float(min(p_value, 1.0)))


def decided(problem: Problem, tried: tuple[Tried, ...]) -> tuple[Tried, ...]:
    """Where the two best are close, bins of half the length say which: lag and delay differ in them."""
    if len(tried) < 2 or tried[0].score - tried[1].score > CLOSE or tried[0].score < 0:
        return tried
    costs = fine_costs(problem, tried[:2])
    first, second = (tried[0], tried[1]) if costs[0] <= costs[1] else (tried[1], tried[0])
    second = replace(second, score=first.score - abs(costs[0] - costs[1]))
    return (first, second, *tried[2:])


def fine_costs(problem: Problem, tried: Iterable[Tried]) -> list[float]:
    """Deviance and price of each in bins of half the length."""
    finer = problem.finer()
    fits = [(a, gauss_newton(finer, a.fit.extension, a.fit.noise, 2)) for a in tried]
    return [fit.deviance + cost_of(problem, a.lead, a.fit) for a, fit in fits]


def begins_or_ends_with_the_log(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a load step lies so near an end that the log shows one side only, as a payload would."""
    if name != "load_step":
        return False
    t_s = problem.drive.t_s
    share = (fit.extension.effects[name]["t0_s"] - t_s[0]) / (t_s[-1] - t_s[0])
    return not ONE_SIDE <= share <= 1 - ONE_SIDE


def started(problem: Problem, current: Fit, lead: Lead) -> Lead:
    """The lead at the best of its starts, where its slope at no effect says little about its size."""
    candidate = candidate_of(lead.name)
    key, values = candidate.free[0], candidate.declaration.search.starts
    if not values:
        return lead
    calm = current.noise._replace(lat_sd_mps=CALM_LATERAL_MPS)
    starts = [replace(lead, parameters={key: value}) for value in (lead.parameters[key], *values)]
    return min(starts, key=lambda start: problem.deviance(joined(current, start), calm))


def placed(problem: Problem, fit: Fit, name: str) -> Extension:
    """Edges in time and space by a search along each of them, in ever shorter steps: between the edges of two
    fits the likelihood is flat. The disturbances are held calm, lest they explain what a wrong edge leaves.
    """
    keys = [key for key in candidate_of(name).free if is_place(name, key)]
    if not keys:
        return fit.extension
    noise = calmed(fit.noise) or fit.noise
    for step in SEARCHED:
        here = gauss_newton(problem, fit.extension, noise, 2)
        extension, deviance = here.extension, here.deviance
        for key, move in product(keys, (step, -step)):
            new = moved(extension, name, key, move)
            while (new_deviance := problem.deviance(new, noise)) < deviance - CLEARLY:
                extension, deviance = new, new_deviance
                new = moved(extension, name, key, move)
        fit = replace(fit, extension=extension)
    return fit.extension


def moved(extension: Extension, name: str, key: str, by: float) -> Extension:
    """One parameter of an effect changed."""
    return replaced(extension, ((name, key),), np.array([extension.effects[name][key] + by]))


def joined(current: Fit, lead: Lead) -> Extension:
    """The model with the lead in it."""
    return current.extension.with_effect(lead.name, lead.parameters)


def cost_of(problem: Problem, lead: Lead, fit: Fit) -> float:
    """BIC's price, and that of every place where it was looked for."""
    return float(
        shown_parameters(problem, lead, fit) * np.log(3 * problem.train.sum()) + 2 * np.log(lead.tried)
    )


def shown_parameters(problem: Problem, lead: Lead, fit: Fit) -> int:
    """How many parameters the log can show: of a patch that is crossed once, its ends on the path and the
    loss.
    """
    if lead.name != "low_friction_patch":
        return len(lead.parameters)
    inside = weight(lead.name, fit.extension.effects[lead.name], problem.drive) > 0.5
    crossings = int(inside[0]) + int(np.sum(~inside[:-1] & inside[1:]))
    return 4 if crossings > 1 else 3

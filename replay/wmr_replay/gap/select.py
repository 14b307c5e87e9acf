"""Which effects are missing: leads fitted in full, the best accepted while it passes, up to three."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from wmr_replay.gap.candidates import LOCAL
from wmr_replay.gap.excitation import too_calm_for
from wmr_replay.gap.extension import Extension
from wmr_replay.gap.kalman import Diffusion
from wmr_replay.gap.leads import Lead
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.problem import Problem, fit_noise
from wmr_replay.gap.prove import Proof, moved_by, prove
from wmr_replay.gap.refit import Fit, gauss_newton
from wmr_replay.gap.scan import scan, scan_terms
from wmr_replay.gap.significance import LEVEL, likeness, robust_p

MOST_FITTED = 6
LIKE, LIKE_SHARE = 0.25, 0.15
CLOSE = 25.0
LEAST_SCORE, LEAST_SCORE_LATER = -10.0, 0.0
"""A lead that promises less is not worth a fit; the first makes the diffusion calmer, and gains by that."""
ONE_SIDE = 0.1
STARTS = {"undeclared_skid": {"stiffness_ratio": (0.2, 0.4, 0.8, 1.6, 3.2)}}
CALM_LATERAL_MPS = 0.005


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


@dataclass(frozen=True, eq=False)
class Selection:
    """Effects found, in order, with every stage's attempts."""

    base: Fit
    fit: Fit
    found: tuple[Tried, ...]
    stages: tuple[tuple[Tried, ...], ...]
    refused: str = ""


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


def select(
    problem: Problem, extension: Extension, options: GapOptions, *, provisional: bool = False
) -> Selection:
    """Forward, one effect at a time; after each acceptance, what has become needless goes. A provisional
    selection asks for significance only.
    """
    base = current = fitted(problem, extension, None, 8)
    found: list[Tried] = []
    stages: list[tuple[Tried, ...]] = []
    for _ in range(options.max_effects):
        tried = attempts(problem, current, terms=False)
        tried = tuple(
            judged(problem, current, a, found, None if provisional else options) if i < 1 else a
            for i, a in enumerate(tried)
        )
        stages.append(tried)
        if not provisional and not (tried and (tried[0].p_value <= LEVEL or not tried[0].failed)):
            tried = attempts(problem, current, terms=True)
            tried = tuple(
                judged(problem, current, a, found, None if provisional else options) if i < 1 else a
                for i, a in enumerate(tried)
            )
        passing = [a for a in tried[:1] if not a.failed]
        if not passing:
            break
        others = tuple((a.lead.name, max(passing[0].score - a.score, 0.0)) for a in tried[1:] if a.score > 0)
        found.append(replace(passing[0], alternatives=others))
        current = passing[0].fit
        if not provisional:
            current, found = eliminated(problem, current, found)
    refused = "" if provisional else next(filter(None, (calm_about(problem, current, f) for f in found)), "")
    if refused:
        return Selection(base, base, (), tuple(stages), refused)
    return Selection(base, current, tuple(found), tuple(stages))


def calm_about(problem: Problem, fit: Fit, found: Tried) -> str:
    """Why the drive is too calm for an effect that was found, once all are in the model; else empty."""
    return too_calm_for(found.lead.name, problem, fit.extension, fit.noise)


def attempts(problem: Problem, current: Fit, *, terms: bool) -> tuple[Tried, ...]:
    """The best leads fitted, the best first: ranked at the diffusion that the best lead leaves. Leads are the
    library's, or the dictionary's ``terms``.
    """
    leads = leads_of(problem, current, current.noise, terms=terms)
    best = started(problem, current, max(leads, key=score_of))
    if score_of(best) < (LEAST_SCORE_LATER if current.keys else LEAST_SCORE):
        return ()
    first = fitted(problem, joined(current, best), current.noise, 4)
    noise = first.noise
    here = gauss_newton(problem, current.extension, noise, 2 if current.extension.effects else 0)
    leads = sorted(leads_of(problem, here, noise, terms=terms), key=score_of, reverse=True)
    if best.name not in [lead.name for lead in leads[:MOST_FITTED]]:
        leads = [best, *leads]
    quick = [
        (lead, gauss_newton(problem, joined(current, started(problem, current, lead)), noise, 4))
        for lead in leads[:MOST_FITTED]
        if lead.gain > 8.0
    ]
    quick.sort(key=lambda pair: pair[1].deviance + cost_of(problem, pair[0]))
    total = sum(lead.tried for lead in leads)
    out = []
    for i, (lead, roughly) in enumerate(quick):
        fit = fitted(problem, roughly.extension, noise, 3, 1) if i < 2 else roughly
        if begins_or_ends_with_the_log(problem, fit, lead.name):
            continue
        gain = current.deviance - fit.deviance
        by_ratio = chi2.sf(max(gain, 0.0), len(lead.parameters))
        p_value = max(by_ratio, robust_p(problem, fit, lead.name)) * total
        out.append(Tried(lead, fit, gain, gain - cost_of(problem, lead), float(min(p_value, 1.0))))
    return decided(problem, tuple(sorted(out, key=lambda a: -a.score)))


def decided(problem: Problem, tried: tuple[Tried, ...]) -> tuple[Tried, ...]:
    """Where the two best are close, bins of half the length say which: lag and delay differ in them."""
    if len(tried) < 2 or tried[0].score - tried[1].score > CLOSE or tried[0].score < 0:
        return tried
    finer = problem.finer()
    costs = [
        gauss_newton(finer, a.fit.extension, a.fit.noise, 2).deviance + cost_of(problem, a.lead)
        for a in tried[:2]
    ]
    first, second = (tried[0], tried[1]) if costs[0] <= costs[1] else (tried[1], tried[0])
    second = replace(second, score=first.score - abs(costs[0] - costs[1]))
    return (first, second, *tried[2:])


def leads_of(problem: Problem, current: Fit, noise: Diffusion, *, terms: bool) -> list[Lead]:
    """What a scan at the diffusion ``noise`` finds."""
    if terms:
        return scan_terms(problem, current.extension, noise, current.psi)
    return scan(problem, current.extension, noise, current.psi).leads


def begins_or_ends_with_the_log(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a load step lies so near an end that the log shows one side only, as a payload would."""
    if name != "load_step":
        return False
    t_s = problem.drive.t_s
    share = (fit.extension.effects[name]["t0_s"] - t_s[0]) / (t_s[-1] - t_s[0])
    return not ONE_SIDE <= share <= 1 - ONE_SIDE


def started(problem: Problem, current: Fit, lead: Lead) -> Lead:
    """The lead at the best of its grid's starts, where its slope at no effect says little about its size."""
    if lead.name not in STARTS:
        return lead
    ((key, values),) = STARTS[lead.name].items()
    calm = current.noise._replace(lat_sd_mps=CALM_LATERAL_MPS)
    starts = [replace(lead, parameters={key: value}) for value in (lead.parameters[key], *values)]
    return min(starts, key=lambda start: problem.deviance(joined(current, start), calm))


def joined(current: Fit, lead: Lead) -> Extension:
    """The model with the lead in it."""
    return current.extension.with_effect(lead.name, lead.parameters)


def score_of(lead: Lead) -> float:
    """Gain less what its freedom costs."""
    return float(lead.gain - 8 * len(lead.parameters) - 2 * np.log(lead.tried))


def cost_of(problem: Problem, lead: Lead) -> float:
    """BIC's price, and that of every place where it was looked for."""
    return float(len(lead.parameters) * np.log(3 * problem.train.sum()) + 2 * np.log(lead.tried))


def judged(
    problem: Problem, current: Fit, tried: Tried, found: list[Tried], options: GapOptions | None
) -> Tried:
    """The gates, in order; the first that fails is named. Without options the significance alone counts."""
    if tried.p_value > LEVEL or tried.score <= 0:
        return replace(tried, failed="not significant")
    like = likeness(problem, tried.fit, tried.lead.name)
    strongest = max((f.gain for f in found), default=0.0)
    tried = replace(tried, likeness=like)
    if (like > LIKE or tried.lead.name in LOCAL) and tried.gain < LIKE_SHARE * strongest:
        return replace(tried, failed="a remainder of what is found already")
    if options is None:
        return tried
    proof = prove(problem, current, tried.fit)
    if not proof.holds:
        return replace(tried, proof=proof, failed="not proven on held-out windows")
    small = moved_by(problem, current, tried.fit, options.tolerance_s) < options.tolerance_m
    return replace(tried, proof=proof, failed="moves the path by less than the tolerance" if small else "")


def eliminated(problem: Problem, current: Fit, found: list[Tried]) -> tuple[Fit, list[Tried]]:
    """Drop each earlier effect that the later ones have made needless."""
    for earlier in list(found[:-1]):
        name = earlier.lead.name
        rest = fitted(problem, current.extension.without(name), current.noise, 4)
        loss = rest.deviance - current.deviance
        if loss < cost_of(problem, earlier.lead) + 10 or not prove(problem, rest, current).holds:
            current, found = rest, [f for f in found if f.lead.name != name]
    return current, found

"""Which effects are missing: one after the other while they are significant, then each proven in its turn."""

from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem, calmed
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.excitation import too_calm_for
from wmr_replay.gap.evidence.holdout import moved_by, prove
from wmr_replay.gap.evidence.placebo import placebo_p
from wmr_replay.gap.evidence.significance import LEVEL, likeness, touched
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.attempts import Tried, attempts, cost_of, fine_costs, fitted
from wmr_replay.gap.search.relabel import like_slipping
from wmr_schemas.effects import BUILT_IN

LIKE, LIKE_SHARE, AKIN_SHARE = 0.25, 0.15, 0.5
AKIN = tuple({effect.name, *effect.akin} for effect in BUILT_IN if effect.akin)
"""Forms of one physical cause: most real lags lie between a lag of one pole and a delay."""
MARGIN, MARGIN_UNSURE = 10.0, 30.0
"""What an effect must explain beside others; more where a wrong label would explain as much."""
RIVAL = 100.0
SOMETHING_LEFT = 2.0


@dataclass(frozen=True, eq=False)
class Selection:
    """Effects found, in order, with every stage's attempts."""

    base: Fit
    fit: Fit
    found: tuple[Tried, ...]
    stages: tuple[tuple[Tried, ...], ...]
    refused: str = ""


def select(problem: Problem, extension: Extension, options: GapOptions) -> Selection:
    """Forward, one effect at a time, by significance; then each must be needed and proven beside the others,
    and the drive lively enough for it.
    """
    return established(problem, forward(problem, extension, options), options)


def forward(problem: Problem, extension: Extension, options: GapOptions, *, terms: bool = True) -> Selection:
    """What is significant, one effect after the other; with ``terms`` also what only the dictionary
    describes.
    """
    base = current = fitted(problem, extension, None, 8)
    found: list[Tried] = []
    stages: list[tuple[Tried, ...]] = []
    for _ in range(options.max_effects):
        tried = best_of(problem, base, current, found, terms=terms)
        stages.append(tried)
        if not tried or tried[0].failed:
            break
        others = tuple((a.lead.name, max(tried[0].score - a.score, 0.0)) for a in tried[1:] if a.score > 0)
        found.append(replace(tried[0], alternatives=others))
        current = tried[0].fit
    return Selection(base, current, tuple(found), tuple(stages))


def established(problem: Problem, selection: Selection, options: GapOptions) -> Selection:
    """What of it passes the other gates."""
    base, stages = selection.base, selection.stages
    current, found = exchanged(problem, selection.fit, list(selection.found), stages)
    current, found = proven(problem, base, current, found, options)
    refused = next(filter(None, (calm_about(problem, current, f) for f in found)), "")
    if refused:
        return Selection(base, base, (), stages, refused)
    return Selection(base, current, tuple(found), stages)


def best_of(
    problem: Problem, base: Fit, current: Fit, found: list[Tried], *, terms: bool
) -> tuple[Tried, ...]:
    """The library's attempts, the first judged; the dictionary's where none of those is significant and a
    disturbance is left that something may explain.
    """
    tried = judged(problem, base, current, attempts(problem, current, terms=False), found)
    significant = tried and tried[0].p_value <= LEVEL and tried[0].score > 0
    if terms and not significant and calmed(current.noise, SOMETHING_LEFT) is not None:
        others = judged(problem, base, current, attempts(problem, current, terms=True), found)
        if others and not others[0].failed:
            return others
    return tried


def judged(
    problem: Problem, base: Fit, current: Fit, tried: tuple[Tried, ...], found: list[Tried]
) -> tuple[Tried, ...]:
    """The first attempt past the gates that need no proof, or with the name of the one that it fails."""
    if not tried:
        return ()
    first = tried[0]
    if first.p_value > LEVEL or first.score <= 0:
        return (replace(first, failed="not significant"), *tried[1:])
    first = replace(first, likeness=likeness(problem, first.fit, first.lead.name))
    if found and first.gain < remainder(problem, base, current, first, found):
        first = replace(first, failed="a remainder of what is found already")
    return (first, *tried[1:])


def remainder(problem: Problem, base: Fit, current: Fit, tried: Tried, found: list[Tried]) -> float:
    """What the wrong form of the effects found may leave for one that is like them: a share of their gain.
    What acts in a time or place is held against their gain there.
    """
    name = tried.lead.name
    if name in LOCAL:
        rows = touched(problem, tried.fit, name)
        return LIKE_SHARE * float((base.row_deviance - current.row_deviance)[rows].sum())
    if tried.likeness <= LIKE:
        return 0.0
    akin = [f.gain for f in found if {f.lead.name, name} in AKIN]
    return max(LIKE_SHARE * max(f.gain for f in found), AKIN_SHARE * max(akin, default=0.0))


def exchanged(
    problem: Problem, current: Fit, found: list[Tried], stages: tuple[tuple[Tried, ...], ...]
) -> tuple[Fit, list[Tried]]:
    """Where an effect was found while others were still missing, its rivals are tried in its place beside
    them.
    """
    for i, tried in enumerate(found[:-1]):
        names = [f.lead.name for f in found]
        rivals = [a for a in stages[i][1:3] if tried.score - a.score < RIVAL and a.lead.name not in names]
        others = []
        for rival in rivals:
            name = rival.lead.name
            rest = current.extension.without(tried.lead.name)
            fit = fitted(problem, rest.with_effect(name, rival.fit.extension.effects[name]), current.noise, 3)
            others.append(replace(rival, fit=fit))
        if others:
            here = [replace(tried, fit=current), *others]
            costs = fine_costs(problem, here)
            best = int(np.argmin(costs))
            deltas = [
                (a.lead.name, c - costs[best])
                for a, c in zip(here, costs, strict=True)
                if a is not here[best]
            ]
            p_value = max(tried.p_value, here[best].p_value)
            found[i] = replace(
                here[best], alternatives=tuple(deltas), p_value=p_value, likeness=tried.likeness
            )
            current = here[best].fit
    return current, found


def proven(
    problem: Problem, base: Fit, current: Fit, found: list[Tried], options: GapOptions
) -> tuple[Fit, list[Tried]]:
    """The effects that are needed and proven beside the others; one that is not goes, the weakest first, and
    the rest is asked again.
    """
    while found:
        asked = [needed(problem, base, current, f, options) for f in found]
        failed = [f for f in asked if f.failed]
        if not failed:
            return current, asked
        weakest = min(failed, key=lambda f: f.gain)
        found = [f for f in found if f.lead.name != weakest.lead.name]
        current = without(problem, base, current, weakest.lead.name)
    return base, []


def needed(problem: Problem, base: Fit, current: Fit, tried: Tried, options: GapOptions) -> Tried:
    """One of the effects of ``current`` held against the same model without it."""
    rest = without(problem, base, current, tried.lead.name)
    gain = rest.deviance - current.deviance
    tried = replace(tried, gain=gain)
    unsure = problem.drive.identified and tried.lead.name in LOCAL
    margin = 0.0 if len(current.extension.effects) == 1 else MARGIN_UNSURE if unsure else MARGIN
    if gain < cost_of(problem, tried.lead, current) + margin:
        return replace(tried, failed="needless beside the others")
    if like_slipping(problem, current, tried.lead.name):
        return replace(tried, failed="no other than the model's own slipping")
    proof = prove(problem, rest, current)
    if not proof.holds:
        return replace(tried, proof=proof, failed="not proven on held-out windows")
    if placebo_p(problem, rest, current, tried.lead.name, options.seed) > LEVEL:
        return replace(tried, proof=proof, failed="no more than what logs with nothing missing would show")
    small = moved_by(problem, rest, current, options.tolerance_s) < options.tolerance_m
    return replace(tried, proof=proof, failed="moves the path by less than the tolerance" if small else "")


def without(problem: Problem, base: Fit, current: Fit, name: str) -> Fit:
    """The model fitted anew with one effect fewer."""
    rest = current.extension.without(name)
    return fitted(problem, rest, base.noise, 6) if rest.effects else base


def calm_about(problem: Problem, fit: Fit, found: Tried) -> str:
    """Why the drive is too calm for an effect that was found, once all are in the model; else empty."""
    return too_calm_for(found.lead.name, problem, fit.extension, fit.noise)

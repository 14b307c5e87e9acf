"""The library asked once more, on the problem of a formula that is made of its effects' own terms.

A slow disturbance does what a lasting effect does, and wrong contact modes take what shows it: the library
may have missed an effect that a formula finds, with the modes that belong to it. Its scan begins there now
with that effect, and holds all others against it at the disturbance that it leaves.
"""

from dataclasses import replace
from itertools import chain

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.formula.groups import TWINS, twins_of
from wmr_replay.gap.formula.proven import Proven
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.search.fit_candidates import Hints
from wmr_replay.gap.search.select import Selection, confirm, forward_selection

UNSEEN = "others explain more"
"""Why an effect is not named that no gate refuses: it is no candidate."""


def effects_meant(found: Proven) -> tuple[str, ...]:
    """The effects of the library whose own terms are among the formula's."""
    return tuple(name for name in TWINS if twins_of([name]) & {*found.formula.names})


def library_again(found: Proven, options: GapOptions) -> tuple[Problem, Selection]:
    """What the library says with the formula's modes, beginning with the effects that the formula means, and
    no more of them: with modes that were not made for it, others may be a wrong mode.

    Nothing where that is a loss of traction: the modes in which one is looked for are not these; nor where
    none of those effects promises anything beside the disturbance that the formula leaves.
    """
    problem, hints = found.problem.all_fitted(), hints_of(found)
    if not hints:
        return problem, Selection(found.base, found.base, (), ())
    few = replace(options, max_effects=min(len(hints), options.max_effects))
    selection = forward_selection(problem, found.base.extension, few, terms=False, hints=hints)
    if any(effect.name in LOCAL for effect in selection.found):
        return problem, replace(selection, fit=selection.base, found=())
    return problem, confirm(problem, selection, options)


def hints_of(found: Proven) -> Hints:
    """The effects that the formula means, at their best sizes with the disturbance that it leaves."""
    meant, noise = effects_meant(found), found.formula.fit.noise
    scored = scan(found.problem, found.base.extension, noise, found.base.psi).scored
    return tuple((one.name, one.parameters) for one in scored if one.name in meant and one.gain > 0)


def why_not_named(found: Proven, selection: Selection) -> tuple[tuple[str, str], ...]:
    """The effects that the formula means, each with the gate that it does not pass in ``selection``."""
    tested = (*selection.dropped, *chain.from_iterable(selection.stages))
    failed = {one.name: one.failed for one in reversed(tested) if one.failed}
    return tuple((name, failed.get(name, UNSEEN)) for name in effects_meant(found))

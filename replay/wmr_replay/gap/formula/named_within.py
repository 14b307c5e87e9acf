"""Effects of the library within a formula: terms that say no more than one of them get its name."""

from dataclasses import replace

from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.groups import TWINS, Group
from wmr_replay.gap.formula.library_again import effects_meant
from wmr_replay.gap.formula.proven import Proven
from wmr_replay.gap.formula.scores import log_n
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.search.fit_candidates import price_of
from wmr_replay.gap.search.select import Selection, confirm, forward_selection
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import Term, parse_term

GROUND = ("x", "y", "xy")
"""What a wave over the ground runs along."""


def with_names(found: Proven, said: Selection, options: GapOptions) -> Selection:
    """The selection ``said`` of a formula, with effects of the library in place of terms that they explain.

    An effect stands for all terms of its own quantities on its channel, passes the library's gates beside the
    others, and explains as much as they do: else it is part of a curve, as it is where another term has it
    times something else.
    """
    groups = found.formula.groups
    for names in same_terms(found):
        alike = tuple(group for group in groups if is_like(group, names[0]))
        others = tuple(group for group in groups if group not in alike)
        if not alike or is_in(others, names[0]) or {*names} & {*said.fit.extension.effects}:
            continue
        named = beside(found, said, alike, names, options)
        if named.found and not named.refused and explains_as_much(found, said, alike, named):
            said, groups = put_in_place(said, alike, named), others
    return said


def same_terms(found: Proven) -> list[tuple[str, ...]]:
    """The effects that a formula means; those of the same terms together."""
    terms: dict[tuple[str, ...], list[str]] = {}
    for name in effects_meant(found):
        terms.setdefault(TWINS[name], []).append(name)
    return [tuple(names) for names in terms.values()]


def terms_of(effect: str) -> list[Term]:
    """The effect's own terms."""
    return [parse_term(UNNAMED_PREFIX + twin) for twin in TWINS[effect]]


def is_like(group: Group, effect: str) -> bool:
    """Whether a group of terms reads what the effect's own terms read, on their channels."""
    own = {(twin.channel, frozenset(twin.columns)) for twin in terms_of(effect)}
    return (group.terms[0].channel, group.columns) in own


def is_in(groups: tuple[Group, ...], effect: str) -> bool:
    """Whether a term of the groups has one of the effect's own terms as a factor; true of no groups.

    A wave over the ground has no mean: what it is a wave of acts beside it.
    """
    own = [(twin.channel, {*twin.factors} - {"1"}) for twin in terms_of(effect)]
    terms = [term for group in groups if not is_ground_wave(group.family) for term in group.terms]
    return not groups or any(
        term.channel == c and factors <= {*term.factors} for term in terms for c, factors in own
    )


def is_ground_wave(family: Family) -> bool:
    """Whether a family swings from place to place."""
    return family.kind == "wave" and family.along in GROUND


def without(extension: Extension, groups: tuple[Group, ...]) -> Extension:
    """The extension without the groups' terms."""
    for name in (name for group in groups for name in group.names):
        extension = extension.without(name)
    return extension


def beside(
    found: Proven, said: Selection, alike: tuple[Group, ...], names: tuple[str, ...], options: GapOptions
) -> Selection:
    """What the library says of these effects beside everything else that is said."""
    rest, noise = without(said.fit.extension, alike), found.formula.fit.noise
    there = fit_model(found.problem, rest, noise)
    scored = scan(found.problem, there.extension, noise, there.psi).scored
    hints = tuple((one.name, one.parameters) for one in scored if one.name in names and one.gain > 0)
    if not hints:
        return Selection(there, there, (), ())
    problem, few = found.problem.all_fitted(), replace(options, max_effects=1)
    selection = forward_selection(problem, rest, few, terms=False, hints=hints)
    if not {effect.name for effect in selection.found} <= {*names}:
        return replace(selection, fit=selection.base, found=())
    return confirm(problem, selection, few)


def explains_as_much(found: Proven, said: Selection, alike: tuple[Group, ...], named: Selection) -> bool:
    """Whether the effect costs no more than the terms in whose place it is, up to what is as good."""
    problem, own = found.problem, found.problem.settings.formula
    before, after = (fit_on(found, one.fit.extension) for one in (said, named))
    terms = sum(group.price(log_n(problem)) for group in alike)
    prices = sum(price_of(problem, effect.scored, after) for effect in named.found)
    return after.deviance + prices <= before.deviance + terms + own.margin


def fit_on(found: Proven, extension: Extension) -> Fit:
    """An extension fitted to the rows that the formula was fitted to."""
    return fit_model(found.problem, extension, found.formula.fit.noise)


def put_in_place(said: Selection, alike: tuple[Group, ...], named: Selection) -> Selection:
    """The selection with the library's effect in place of the terms."""
    gone = {name for group in alike for name in group.names}
    kept = [replace(one, fit=named.fit) for one in said.found if one.name not in gone]
    library = [one for one in kept if not one.name.startswith(UNNAMED_PREFIX)]
    terms = [one for one in kept if one.name.startswith(UNNAMED_PREFIX)]
    found = (*library, *named.found, *terms)
    return replace(said, fit=named.fit, found=found, stages=(*said.stages, *named.stages))

"""What a found term may be shaped by: one quantity more, or one that it reads, in another way."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.excitation import ANSWERS
from wmr_replay.gap.formula.families import Factors, Family
from wmr_replay.gap.formula.grids import Grid, grid_of, scale_of, shapes_of
from wmr_replay.gap.formula.groups import CURVE, Group, Tried, twins_of
from wmr_replay.gap.model.dictionary import columns_of, is_one_way
from wmr_schemas.shape_factors import PRODUCTS, SHAPED, quantity
from wmr_schemas.terms import CHANNELS, FACTORS, Term, TermChannel, parse_term

MOVING = ("v", "yaw_rate")
"""The quantities whose sign may turn about what is found."""


def modulations_of(problem: Problem, terms: Sequence[Term], *, own: bool = False) -> Iterator[Grid]:
    """Terms of one channel, all of them times one shape of a quantity; with ``own``, of those that they read
    as well, and of products of two. No shape is of the efforts that answer what is found. A speed that has
    both signs may turn them about, too: what rubs one side holds it back whichever way the robot rolls.
    """
    read = {column for term in terms for column in term.columns}
    carriers = tuple(tuple(factor for factor in term.factors if factor != "1") for term in terms)
    for z in (*SHAPED, *PRODUCTS) if own else SHAPED:
        if ANSWERS[terms[0].channel] not in PRODUCTS.get(z, (z,)) and (own or z not in read):
            yield shaped_by(problem, z, terms[0].channel, carriers)
        if z in MOVING and not own and z not in read and turns_about(problem, z):
            yield soft_signs(problem, z, terms[0].channel, carriers)


def turns_about(problem: Problem, z: str) -> bool:
    """Whether a log shows both signs of a quantity."""
    return not is_one_way(columns_of(problem.binned)[z], problem.settings.report.one_way)


def shapes_instead(problem: Problem, terms: Sequence[Term]) -> Iterator[Grid]:
    """The terms with one quantity that they all read, odd or even, in another way: by its shapes alone, or
    times its sign, an effort's times itself. Terms that read nothing else are left as they are. Terms of the
    efforts that answer stay such terms.
    """
    channel = terms[0].channel
    for z in SHAPED:
        parities = {term.parity.get(z) for term in terms}
        carriers = tuple(dict.fromkeys(factors_without(z, term) for term in terms))
        if carriers == ((),):
            continue
        if parities == {"even"}:
            yield shaped_by(problem, z, channel, carriers)
        if parities == {"odd"}:
            yield soft_signs(problem, z, channel, carriers)
            sign = f"sgn({z})" if f"sgn({z})" in FACTORS else z
            yield shaped_by(problem, z, channel, tuple((*one, sign) for one in carriers), but="rise")


def towards_a_speed(terms: Sequence[Term], n_tried: float) -> Iterator[Group]:
    """The terms without one quantity and in proportion to it, together: a floor or a wind that moves drags
    towards its own speed.
    """
    channel = terms[0].channel
    for z in SHAPED:
        bare = dict.fromkeys(factors_without(z, term) for term in terms)
        if z != ANSWERS[channel] and {*bare} != {()}:
            both = [factors for one in bare for factors in (one or ("1",), (*one, z))]
            yield Group(CURVE, tuple(Term(channel, one) for one in both), n_tried=len(SHAPED) * n_tried)


def a_moving_floor(terms: Sequence[Term], n_tried: float) -> Iterator[Group]:
    """The terms that read a speed ahead, with their floor moving somewhere: in place of v, v less the part
    along the heading of the floor's speed.
    """
    bare = dict.fromkeys(factors_without("v", term) for term in terms)
    if terms[0].channel == "longitudinal" and {*bare} != {()} and all("v" in term.columns for term in terms):
        both = [(*one, speed) for one in bare for speed in ("v", "cos(yaw)", "sin(yaw)")]
        yield Group(CURVE, tuple(Term("longitudinal", one) for one in both), n_tried=n_tried)


def factors_without(z: str, term: Term) -> tuple[str, ...]:
    """A term's factors but those of a quantity; none of the constant's."""
    return tuple(one for one in term.factors if one != "1" and z not in Term(term.channel, (one,)).columns)


def shaped_by(
    problem: Problem, z: str, channel: TermChannel, carriers: tuple[Factors, ...], but: str = ""
) -> Grid:
    """These carriers times one shape of a quantity, of any kind but one."""
    settings = problem.settings.formula
    shares = *settings.scale_shares, ("rise", settings.rise_shares)
    family = Family("", channel, z, carriers)
    shapes = shapes_of(quantity(columns_of(problem.binned), z), shares, settings)
    return grid_of(*((replace(family, kind=kind), numbers) for kind, numbers in shapes if kind != but))


def soft_signs(problem: Problem, z: str, channel: TermChannel, carriers: tuple[Factors, ...]) -> Grid:
    """These carriers times a soft sign of a quantity, which is its sign times a rise."""
    own = problem.settings.formula
    softs = scale_of(columns_of(problem.binned)[z], own) * np.array(own.rise_shares)[:, None]
    return grid_of((Family("soft", channel, z, carriers), softs))


def modulations_of_effects(problem: Problem, effects: Iterable[str]) -> Tried:
    """The terms that effects are, each channel's shaped by a quantity."""
    terms = [parse_term(name) for name in twins_of(effects)]
    own = [[term for term in terms if term.channel == channel] for channel in CHANNELS]
    return Tried((), tuple(grid for some in own if some for grid in modulations_of(problem, some, own=True)))

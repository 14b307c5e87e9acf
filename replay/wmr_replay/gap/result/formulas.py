"""The terms of a dictionary that were found, as one formula for each channel."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of, is_one_way
from wmr_replay.gap.result.result import Estimate, Formula, FoundEffect
from wmr_replay.gap.settings.result import ReportSettings
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.slip_terms import is_slip_term
from wmr_schemas.terms import COEFFICIENT, SIGNED, Term, parse_term

ONE_WAY = {
    "v": ("rolls forwards", "rolls backwards"),
    "yaw_rate": ("turns to the left", "turns to the right"),
}
"""What a robot does whose speed has one sign, plus or minus."""
ADDED_TO = {"longitudinal": "dv_long/dt", "lateral": "dv_lat/dt", "yaw": "half_track·d(yaw_rate)/dt"}


def is_term(effect: FoundEffect) -> bool:
    """Whether an effect is a term of the torque base's dictionary."""
    return effect.name.startswith(UNNAMED_PREFIX) and not is_slip_term(effect.name)


def formulas_of(effects: Iterable[FoundEffect], binned: BinnedLog) -> tuple[Formula, ...]:
    """A formula for each channel that has terms."""
    return tuple(formula_of(own, binned) for own in by_channel(effects))


def formula_of(effects: Sequence[FoundEffect], binned: BinnedLog) -> Formula:
    """The formula of one channel: text, parity, size, and the range over which it was seen."""
    terms, columns = [parse_term(effect.name) for effect in effects], columns_of(binned)
    values = [
        e.parameters[COEFFICIENT].value * t.evaluate(columns) for e, t in zip(effects, terms, strict=True)
    ]
    names = dict.fromkeys(column for term in terms for column in term.columns)
    return Formula(
        channel=effects[0].channel,
        text=text_of(effects),
        terms=tuple(effect.name for effect in effects),
        parity=parity_of(terms),
        rms_mps2=float(np.sqrt(np.mean(np.sum(values, axis=0) ** 2))),
        visited={name: (float(columns[name].min()), float(columns[name].max())) for name in names},
    )


def unseen_parity(
    formulas: Iterable[Formula], binned: BinnedLog, settings: ReportSettings
) -> tuple[str, ...]:
    """Notes on the speeds of formulas that took one sign alone: there, odd and even are the same."""
    read, notes = {name for formula in formulas for name in formula.parity}, []
    for name, ways in ONE_WAY.items():
        speed = columns_of(binned)[name]
        if name in read and is_one_way(speed, settings.one_way):
            way = ways[int(np.sum(speed * np.abs(speed)) < 0)]
            notes.append(
                f"the robot only {way}: this log does not show whether the formula "
                f"is odd or even in {name}; what holds a robot back is odd"
            )
    return tuple(notes)


def text_of(effects: Iterable[FoundEffect]) -> str:
    """The formulas of all terms among the effects, with units and 95 % intervals."""
    return "; ".join(map(whole_text, by_channel(effects)))


def short_text_of(effects: Iterable[FoundEffect], settings: ReportSettings) -> str:
    """The same in a line or two: long ones without intervals, and of the longest the first terms alone."""
    short = settings.sentence_intervals
    texts = (
        whole_text(own) if len(own) <= short else short_text(own, settings.sentence_terms)
        for own in by_channel(effects)
    )
    return "; ".join(texts)


def by_channel(effects: Iterable[FoundEffect]) -> list[list[FoundEffect]]:
    """The terms among the effects, those of each channel together."""
    terms = [effect for effect in effects if is_term(effect)]
    channels = dict.fromkeys(effect.channel for effect in terms)
    return [[effect for effect in terms if effect.channel == channel] for channel in channels]


def whole_text(own: Sequence[FoundEffect]) -> str:
    """The formula of one channel."""
    parity = parity_text(own)
    return f"{ADDED_TO[own[0].channel]} += {summed(own, intervals=True)}" + (f" ({parity})" if parity else "")


def short_text(own: Sequence[FoundEffect], most_terms: int) -> str:
    """The first terms of a channel, which explain most, how many more there are, and what they all read."""
    terms = [parse_term(effect.name) for effect in own]
    parts = [f"{ADDED_TO[own[0].channel]} += {summed(own[:most_terms], intervals=False)}"]
    about = [parity] if (parity := parity_text(own)) else []
    if more := len(own[most_terms:]):
        parts.append(f"{more} more {'terms' if more > 1 else 'term'}")
        about = ["of " + ", ".join(dict.fromkeys(c for term in terms for c in term.columns)), *about]
    return " + ".join(parts) + (f" ({'; '.join(about)})" if about else "")


def parity_text(own: Sequence[FoundEffect]) -> str:
    """Odd, even or mixed in which speeds and torques; empty where it reads none."""
    signs = parity_of([parse_term(effect.name) for effect in own])
    return ", ".join(f"{sign} in {name}" for name, sign in signs.items())


def summed(own: Sequence[FoundEffect], *, intervals: bool) -> str:
    """The terms as a sum: from the second on, the sign of a coefficient stands before it."""
    texts: list[str] = []
    for effect in own:
        coefficient = effect.parameters[COEFFICIENT]
        if negative := bool(texts) and coefficient.value < 0:
            low, high = coefficient.ci95
            coefficient = replace(coefficient, value=-coefficient.value, ci95=(-high, -low))
        text = term_text(parse_term(effect.name), coefficient, intervals=intervals)
        texts += [f" {'-' if negative else '+'} {text}"] if texts else [text]
    return "".join(texts)


def term_text(term: Term, coefficient: Estimate, *, intervals: bool) -> str:
    """A term with its coefficient and unit, and the interval."""
    low, high = coefficient.ci95
    unit = "" if coefficient.unit == "1" else f" {coefficient.unit}"
    between = f" ({low:.3g} to {high:.3g})" if intervals else ""
    product = "" if term.factors == ("1",) else "·" + "·".join(term.factors)
    return f"{coefficient.value:.3g}{unit}{between}{product}"


def parity_of(terms: Sequence[Term]) -> dict[str, str]:
    """Odd, even or mixed in each signed quantity of a sum of terms; a term without it is even in it."""
    found = {}
    for column in SIGNED:
        if any(column in term.columns for term in terms):
            signs = {term.parity.get(column, "even") for term in terms}
            found[column] = signs.pop() if len(signs) == 1 else "mixed"
    return found

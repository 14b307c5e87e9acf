"""The drive: manoeuvres chosen one after the other, so that the effects least separated so far gain most.

Over a finite library and a finite time: each step takes the manoeuvre that lowers

    Σ weight_ij / (1 + D_ij/wanted)

by most per second; then single manoeuvres are exchanged while that lowers it further (Fedorov, Theory of
Optimal Experiments, 1972). D is the T-criterion of :mod:`.information`. A pair that is separated already
counts little, so that the sum is led by the worst pair (a smooth maximin, cf. Atkinson and Fedorov,
Biometrika 62 (1975) 289, for several rival models).
"""

from dataclasses import dataclass

import numpy as np

from wmr_replay.excite.bounds import Bounds, Limits
from wmr_replay.excite.confounded import check_names, drivable, is_same, reason_against
from wmr_replay.excite.information import Columns, expected_bic, gram, problem_of, separations
from wmr_replay.excite.manoeuvres import Manoeuvre, library
from wmr_replay.excite.profile import Profile, joined, rest
from wmr_replay.excite.question import Question
from wmr_replay.excite.settings import ExciteSettings
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

EXCHANGE_GAIN = 1e-6
"""Relative gain below which an exchange is none; rounding."""


class NotSeparable(InvalidSetting):
    """No drive within the bounds tells the effects apart; the message says why, and what would."""


@dataclass(frozen=True)
class Chosen:
    """A manoeuvre of the drive with its beginning, and by pair the expected drop of the deviance that it
    contributes alone.
    """

    start_s: float
    manoeuvre: Manoeuvre
    contribution: dict[tuple[str, str], float]


@dataclass(frozen=True)
class Separation:
    """Expected BIC of ``rival`` less that of ``missing`` after the drive; ``rival`` empty: of nothing.

    ``seconds_needed`` is how long such driving takes to reach what is wanted.
    """

    missing: str
    rival: str
    expected_bic: float
    seconds_needed: float


@dataclass(frozen=True, eq=False)
class Design:
    """A drive, its manoeuvres in order, what separates after it (the weakest first), and its limits."""

    profile: Profile
    chosen: tuple[Chosen, ...]
    separations: tuple[Separation, ...]
    rest_of_library: tuple[Separation, ...]
    limits: Limits

    @property
    def weakest(self) -> Separation:
        """The pair that is told apart least."""
        return self.separations[0]


def design(
    question: Question,
    bounds: Bounds | None = None,
    duration_s: float = 90.0,
    settings: ExciteSettings | None = None,
) -> Design:
    """The drive of at most ``duration_s`` that answers the question within the bounds.

    Raises NotSeparable where no drive can, with what else would tell the effects apart, and InvalidSetting
    for unknown names and bounds that leave nothing to drive.
    """
    settings, bounds = settings or ExciteSettings(), bounds or Bounds()
    check_names(question.names)
    reason = reason_against(question)
    if reason:
        raise NotSeparable(f"no drive separates them: {reason}")
    limits = Limits(bounds, question.extension.base, settings)
    offered = [m for m in library(limits) if m.duration_s <= duration_s]
    if not offered:
        raise InvalidSetting(
            f"no manoeuvre fits into {duration_s:g} s within these bounds: allow more area, torque or time"
        )
    asked = question.names or drivable()
    others = tuple(n for n in drivable() if n not in asked and not is_beside(n, question))
    columns = Columns.of((*asked, *others), question, settings)
    grams = np.stack([gram(m.profile, question, columns, settings) for m in offered])
    choice = Choice(
        offered, grams, columns, weights_of(columns, asked, question, settings), duration_s, settings
    )
    picked = exchanged(choice, greedy(choice, []))
    return assembled(choice, spread(picked), len(asked), question, limits)


def is_beside(name: str, question: Question) -> bool:
    """Whether an effect is in the model already, or left open by its calibration."""
    return name in question.extension.effects or name in question.nuisance


def weights_of(columns: Columns, asked: tuple[str, ...], question: Question, settings: ExciteSettings) -> F64:
    """Weights (e, e) of the pairs (missing, rival); on the diagonal, of an effect against nothing.

    Those that were asked for against each other have the largest. They have 1 against the rest of the
    library, and so has every other pair where any of the library may be missing. Exactly confounded pairs
    have none.
    """
    n, k = len(columns.names), len(asked)
    weights = np.zeros((n, n))
    weights[: n if question.library else k] = 1.0
    weights[:k, :k] = settings.primary_weight if question.names else 1.0
    for i, a in enumerate(columns.names):
        for j, b in enumerate(columns.names):
            if i != j and is_same(a, b, question):
                weights[i, j] = 0.0
    return weights


@dataclass(frozen=True, eq=False)
class Choice:
    """What is chosen from: manoeuvres with their Gram matrices, the pairs' weights, and the time there is."""

    offered: list[Manoeuvre]
    grams: F64
    columns: Columns
    weights: F64
    duration_s: float
    settings: ExciteSettings

    def cost(self, G: F64) -> float:
        """Σ weight_ij / (1 + D_ij/wanted)."""
        return float(np.sum(self.weights / (1 + separations(G, self.columns) / self.settings.wanted_bic)))

    def left_s(self, picked: list[int]) -> float:
        """The time that is left."""
        return self.duration_s - self.settings.rest_s - sum(self.offered[k].duration_s for k in picked)

    def fitting(self, seconds: float) -> list[int]:
        """Places of the manoeuvres that take no longer."""
        return [k for k, m in enumerate(self.offered) if m.duration_s <= seconds]

    def total(self, picked: list[int]) -> F64:
        """The Gram matrix of what is picked."""
        return np.asarray(self.grams[picked].sum(axis=0))


def greedy(choice: Choice, picked: list[int]) -> list[int]:
    """``picked`` and further manoeuvres, until none fits into the time that is left or helps."""
    while fitting := choice.fitting(choice.left_s(picked)):
        total = choice.total(picked)
        now = choice.cost(total)
        gains = [(now - choice.cost(total + choice.grams[k])) / choice.offered[k].duration_s for k in fitting]
        best = fitting[int(np.argmax(gains))]
        if max(gains) * choice.offered[best].duration_s < choice.settings.least_gain * now and picked:
            return picked
        picked = [*picked, best]
    return picked


def exchanged(choice: Choice, picked: list[int]) -> list[int]:
    """The same with single manoeuvres exchanged while that lowers the cost (Fedorov's exchange)."""
    for _ in range(choice.settings.exchange_rounds):
        before = picked
        for k in dict.fromkeys(picked):
            others = [*picked]
            others.remove(k)
            total, fitting = choice.total(others), choice.fitting(choice.left_s(others))
            costs = [choice.cost(total + choice.grams[other]) for other in fitting]
            best = fitting[int(np.argmin(costs))]
            if min(costs) < choice.cost(choice.total(picked)) * (1 - EXCHANGE_GAIN):
                picked = greedy(choice, [*others, best])
        if picked == before:
            break
    return picked


def spread(picked: list[int]) -> list[int]:
    """The same, repeated ones apart: every part of the drive shows every kind, as hold-out tests need."""
    seen: dict[int, int] = {}
    rounds = []
    for place, k in enumerate(picked):
        seen[k] = seen.get(k, 0) + 1
        rounds.append((seen[k], place, k))
    return [k for _, _, k in sorted(rounds)]


def assembled(choice: Choice, order: list[int], n_asked: int, question: Question, limits: Limits) -> Design:
    """The drive as a whole, simulated once more, with what it is to separate. Raises NotSeparable."""
    settings, columns = choice.settings, choice.columns
    pieces = [choice.offered[k] for k in order]
    profile = joined([*(piece.profile for piece in pieces), rest(settings.rest_s)])
    D = separations(gram(profile, question, columns, settings), columns)
    n_rows = len(problem_of(profile, question, settings).binned)
    found = separations_of(
        D, expected_bic(D, columns, n_rows), columns, profile.duration_s, question, settings
    )
    asked = set(columns.names[:n_asked])
    inside = tuple(s for s in found if s.missing in asked and (s.rival in asked or not s.rival))
    worst = [s for s in inside if s.seconds_needed > settings.most_duration_factor * choice.duration_s]
    if worst and not question.library:
        raise NotSeparable(why_not(worst[0], limits, choice.duration_s))
    rest_of = tuple(s for s in found if s not in inside and (question.library or s.missing in asked))
    starts = np.concatenate([[0.0], np.cumsum([piece.duration_s for piece in pieces])])
    pairs = [(s.missing, s.rival) for s in inside]
    chosen = tuple(
        Chosen(float(start), piece, contribution(choice.grams[k], columns, pairs))
        for start, piece, k in zip(starts, pieces, order, strict=False)
    )
    return Design(profile, chosen, inside, rest_of, limits)


def separations_of(
    D: F64, bic: F64, columns: Columns, length_s: float, question: Question, settings: ExciteSettings
) -> list[Separation]:
    """Every pair that is not exactly confounded, the weakest first."""
    found = []
    for i, missing in enumerate(columns.names):
        for j, rival in enumerate(columns.names):
            if i == j or not is_same(missing, rival, question):
                short = settings.wanted_bic - float(bic[i, j] - D[i, j])
                needed = length_s * short / max(float(D[i, j]), 1e-12)
                found.append(Separation(missing, "" if i == j else rival, float(bic[i, j]), needed))
    return sorted(found, key=lambda s: s.expected_bic)


def contribution(G: F64, columns: Columns, pairs: list[tuple[str, str]]) -> dict[tuple[str, str], float]:
    """What one manoeuvre separates by itself."""
    D, place = separations(G, columns), {name: k for k, name in enumerate(columns.names)}
    return {(a, b): float(D[place[a], place[b or a]]) for a, b in pairs}


def why_not(worst: Separation, limits: Limits, duration_s: float) -> str:
    """Why a pair is not told apart, in words."""
    rival = worst.rival or "nothing at all"
    return (
        f"no drive of {duration_s:g} s within these bounds tells {worst.missing} from {rival}: some "
        f"{worst.seconds_needed:.0f} s would be needed. Allow more speed, torque ({limits.torque_nm:.2g} N·m "
        "a wheel now) or area, or measure more precise poses"
    )

"""Candidates for the next effect: the best of a scan, fitted in full and ranked."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from wmr_replay.gap.estimation.diffusion import calm_or_same, calmed
from wmr_replay.gap.estimation.held_sideways import with_likelier_skids
from wmr_replay.gap.estimation.own_form import freedom_of, has_own_form, with_own_form
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, evaluate, fit_model, gauss_newton
from wmr_replay.gap.evidence.answer import LATE, answer_p
from wmr_replay.gap.evidence.channels import seen_in_one_channel
from wmr_replay.gap.evidence.excitation import DEAD_ZONE, large_ones_lose_nothing, times_the_disturbance
from wmr_replay.gap.evidence.holdout import Proof
from wmr_replay.gap.evidence.significance import wald_p
from wmr_replay.gap.model.candidates import LOCAL, candidate_of, declaration_of
from wmr_replay.gap.model.extension import Extension, Parameters, weight
from wmr_replay.gap.scan.misfit import OF_THE_DRIVES
from wmr_replay.gap.scan.scan import scan, scan_terms
from wmr_replay.gap.scan.score import ScoredCandidate, penalised_gain
from wmr_replay.gap.search.starts import best_start, search_edges

Hints = tuple[tuple[str, Parameters], ...]
"""Effects by name and parameters."""
ANSWERED = "no more than an answer to the disturbance makes"
"""A gate that lags and gains fail."""
ONE_CHANNEL = "seen in one of the channels alone"
"""A gate that lags fail: torques that act late do so ahead and in turning."""
HIDING = (ANSWERED, ONE_CHANNEL)
"""What explains a lag or a gain in its place: another effect may be behind it."""
SAME_IN_PART = {"torque_bias_common": "wheel_coulomb", "yaw_damping": "scrub_torque"}
"""The friction that is the same as an effect on some drives: one that never reverses, or turns slowly."""


@dataclass(frozen=True, eq=False)
class FittedCandidate:
    """A scored candidate fitted in full beside the effects found before.

    ``gain`` is the drop of the deviance, ``score`` the gain less its price, ``p_value`` corrected for
    everything scanned, ``correlation`` the R² with the other effects. ``failed`` names the gate that it does
    not pass. ``alternatives`` are (name, BIC difference).
    """

    scored: ScoredCandidate
    fit: Fit
    gain: float
    score: float
    p_value: float
    correlation: float = 0.0
    proof: Proof | None = None
    failed: str = ""
    alternatives: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.scored.name


def fit_candidates(
    problem: Problem, current: Fit, *, terms: bool, hints: Hints = (), without: tuple[str, ...] = ()
) -> tuple[FittedCandidate, ...]:
    """The best candidates fitted, the best first; of the dictionary's ``terms``, or of the library.

    ``hints`` are effects, seen in other modes, at which a fit may start. Lags and gains that an
    answer to the disturbance makes, and lags of one channel, hide what is missing: the others are ranked
    again ``without`` them, and stand first.
    """
    fitted = ranked_and_fitted(problem, current, terms=terms, hints=hints, without=without)
    hiding = tuple(one for one in fitted if one.failed in HIDING)
    names = {one.name for one in hiding}
    if not names:
        return fitted
    without = (*without, *names, *(LATE if names & set(LATE) else ()))
    others = fit_candidates(problem, current, terms=terms, hints=hints, without=without)
    return (*(one for one in others if one.failed not in HIDING), *hiding)


def ranked_and_fitted(
    problem: Problem, current: Fit, *, terms: bool, hints: Hints = (), without: tuple[str, ...] = ()
) -> tuple[FittedCandidate, ...]:
    """The best candidates but those ``without``, ranked at the diffusion that the best one leaves; with a
    lasting effect among the ``hints``, at what that one leaves.
    """
    own, budget, price = problem.settings.candidates, problem.settings.budget, problem.settings.scan
    new = [hint for hint in hints if hint[0] not in (*current.extension.effects, *without)]
    hinted = [hinted_fit(problem, current, *hint) for hint in new]
    tried = [pair for pair in hinted if pair[0].name not in LOCAL]
    if not tried:
        tried = [*hinted, *best_fitted(problem, current, terms=terms, without=without)]
    if not tried:
        return ()
    best, seen = min(tried, key=lambda pair: pair[1].deviance + price_of(problem, *pair))
    noise = seen.noise
    ranked = rank_at(problem, current, noise, terms=terms, without=without)
    if best.name not in [one.name for one in ranked[: own.most_fitted]]:
        ranked = [best, *ranked]
    least = own.promising * max(penalised_gain(one, price) for one in ranked)
    promising = [
        one
        for one in ranked[: own.most_fitted]
        if one.gain > own.least_gain and penalised_gain(one, price) >= least
    ]
    promising = promising or ranked[:1]
    known = {one.name: fit for one, fit in tried}
    for one in explaining(problem, current, tried):
        if one.name not in [other.name for other in promising]:
            promising.append(one)
            there = known[one.name]
            known[one.name] = fit_model(
                problem, there.extension, there.noise, budget.base_diffusion, budget.ranked_steps
            )
    started = [best_start(problem, current, one) for one in promising]
    rough = [(one, roughly(problem, with_candidate(current, one), noise, one.name)) for one in started]
    rough = [
        (one, nearer(fit, known[one.name], one.name) if one.name in known else fit) for one, fit in rough
    ]
    rough.sort(key=lambda pair: pair[1].deviance + price_of(problem, *pair))
    n_names = len({one.name for one in ranked})
    out = []
    for (one, fit), in_full in zip(rough, fitted_in_full(problem, rough), strict=True):
        if in_full:
            edged = search_edges(problem.all_fitted() if one.name in LOCAL else problem, fit, one.name)
            fit = fit_model(problem, edged, noise, budget.ranked_diffusion, budget.ranked_steps)  # noqa: PLW2901
            fit = with_likelier_skids(fit, one.name)  # noqa: PLW2901
        if one.name in known and one.name not in LOCAL:
            fit = min(fit, known[one.name], key=lambda f: f.deviance)  # noqa: PLW2901
        if not is_ruled_out(problem, fit, one.name):
            out.append(assessed(problem, current, one, fit, n_names))
    out = with_own_forms(problem, current, sorted(out, key=lambda a: -a.score), n_names)
    return compare_in_fine_bins(problem, tuple(out))


def explaining(
    problem: Problem, current: Fit, tried: Iterable[tuple[ScoredCandidate, Fit]]
) -> list[ScoredCandidate]:
    """The lasting ones of the candidates that were tried whose fits are worth their price.

    The disturbance that the best one leaves may be no measure of them: they may act on the other channel.
    """
    worth = (one for one, fit in tried if fit.deviance + price_of(problem, one, fit) < current.deviance)
    return [one for one in worth if one.name not in LOCAL]


def with_own_forms(
    problem: Problem, current: Fit, ranked: list[FittedCandidate], n_names: int
) -> list[FittedCandidate]:
    """Where the best candidate has a form of its own, as a friction with another speed of sign change, it and
    all that share that freedom in their likeliest forms, the best first. Other effects have no such freedom:
    against them, the candidate has the usual form. But a bias is the same as a friction on a drive that never
    reverses, where a wheel inside a bend turns slowly and the usual form alone tells them apart. And a scrub
    that winds up before it slides is a yaw damping in slow turns.
    """
    free = freedom_of(SAME_IN_PART.get(ranked[0].name, ranked[0].name)) if ranked else ""
    if not free or ranked[0].fit.deviance >= current.deviance:
        return ranked
    again = (
        assessed(problem, current, one.scored, with_own_form(one.fit, one.name), n_names)
        if freedom_of(one.name) == free
        else one
        for one in ranked
    )
    return sorted(again, key=lambda a: -a.score)


def fitted_in_full(problem: Problem, rough: list[tuple[ScoredCandidate, Fit]]) -> list[bool]:
    """Which of the roughly fitted candidates, the best first, are fitted in full: a few, and lasting ones
    that are about as good as the last of them. On a drive that never reverses a bias and a dry friction are
    the same, and only fits of one kind show it.
    """
    settings = problem.settings
    costs = [fit.deviance + price_of(problem, one, fit) for one, fit in rough]
    few = min(settings.budget.fully_fitted, len(costs))
    close = [cost <= costs[few - 1] + settings.candidates.close for cost in costs]
    return [i < few or (close[i] and one.name not in LOCAL) for i, (one, _) in enumerate(rough)]


def nearer(fit: Fit, other: Fit, name: str) -> Fit:
    """The likelier of two fits of an effect at the first one's diffusion.

    A scan with calm disturbances clips most of what a large effect does, and takes it for a small one.
    """
    again = roughly(fit.problem, other.extension, fit.noise, name)
    return min(fit, again, key=lambda f: f.deviance)


def roughly(problem: Problem, extension: Extension, noise: Diffusion, name: str) -> Fit:
    """The candidate ``name`` fitted at a fixed diffusion; when and where traction is lost, from all rows."""
    steps = problem.settings.budget.candidate_steps
    if name not in LOCAL:
        return gauss_newton(problem, extension, noise, steps)
    return evaluate(problem, gauss_newton(problem.all_fitted(), extension, noise, steps).extension, noise)


def hinted_fit(
    problem: Problem, current: Fit, name: str, parameters: Parameters
) -> tuple[ScoredCandidate, Fit]:
    """An effect fitted from where it was seen, with calm disturbances: those that its absence asks for would
    hide it.
    """
    settings = problem.settings
    n_tried = settings.scan.most_cells**2 // 2 if name in LOCAL else 1
    scored = ScoredCandidate(name, dict(parameters), 0.0, n_tried)
    calm = calm_or_same(current.noise, settings.diffusion)
    fit = fit_model(problem, with_candidate(current, scored), calm, settings.budget.best_diffusion)
    return replace(scored, gain=current.deviance - fit.deviance), fit


def best_fitted(
    problem: Problem, current: Fit, *, terms: bool, without: tuple[str, ...] = ()
) -> list[tuple[ScoredCandidate, Fit]]:
    """The best candidate of a scan with its fit, and that of a scan with calm disturbances.

    A slow disturbance does what a lasting effect does: where the diffusion explains it already, a scan shows
    little. The candidate of the calm scan is fitted from its disturbances and from the current ones: from
    either, a few iterations may not lead to the other.
    """
    settings = problem.settings
    own, price = settings.candidates, settings.scan
    least = own.least_score_later if current.keys else own.least_score
    ranked = rank(problem, current, current.noise, terms=terms, without=without)
    if not ranked:  # a lag and a delay, which a calibration looks for alone, may both be ruled out
        return []
    chosen = [best for best in ranked[:1] if penalised_gain(best, price) >= least]
    calm = calmed(current.noise, settings.diffusion)
    if calm is not None:
        other = rank_at(problem, current, calm, terms=terms, without=without)[0]
        new = other.name not in [one.name for one in chosen]
        chosen += [other] if penalised_gain(other, price) >= least and new else []
    started = [best_start(problem, current, one) for one in chosen]
    from_noise = [(one, current.noise) for one in started]
    if calm is not None:
        from_noise += [(one, calm) for one in started if one.name == other.name]
    fits: dict[str, tuple[ScoredCandidate, Fit]] = {}
    for one, noise in from_noise:
        fit = fitted_from(problem, current, one, noise)
        if one.name not in fits or fit.deviance < fits[one.name][1].deviance:
            fits[one.name] = one, fit
    return [*fits.values()]


def fitted_from(problem: Problem, current: Fit, scored: ScoredCandidate, noise: Diffusion) -> Fit:
    """A scan's best candidate fitted with the disturbances from ``noise`` on; a slope with likelier skids."""
    fit = fit_model(problem, with_candidate(current, scored), noise, problem.settings.budget.best_diffusion)
    return with_likelier_skids(fit, scored.name)


def rank_at(
    problem: Problem, current: Fit, noise: Diffusion, *, terms: bool, without: tuple[str, ...] = ()
) -> list[ScoredCandidate]:
    """The candidates of a scan at another diffusion than the current fit's, the best first."""
    steps = problem.settings.budget.last_steps if current.extension.effects else 0
    here = gauss_newton(problem, current.extension, noise, steps)
    return rank(problem, here, noise, terms=terms, without=without)


def rank(
    problem: Problem, current: Fit, noise: Diffusion, *, terms: bool, without: tuple[str, ...] = ()
) -> list[ScoredCandidate]:
    """The candidates of a scan at the diffusion ``noise`` but those ``without``, the best first."""
    if terms:
        scored = scan_terms(problem, current.extension, noise, current.psi)
    else:
        scored = scan(problem, current.extension, noise, current.psi).scored
    price = problem.settings.scan
    left = (one for one in scored if one.name not in without)
    return sorted(left, key=lambda one: penalised_gain(one, price), reverse=True)


def assessed(
    problem: Problem, current: Fit, scored: ScoredCandidate, fit: Fit, n_names: int
) -> FittedCandidate:
    """Gain, score and significance of a fitted candidate.

    p is the largest of the likelihood ratio's, the Wald test's and, of lags and gains, that against an answer
    to the disturbance, corrected for everything scanned: each of the ``n_names`` has an equal share of the
    level, and within it each time and place (weighted Bonferroni). It is 1 for a lag of one channel. A base
    model may hold an answer: its controller answers on other logs, too.
    """
    gain = current.deviance - fit.deviance
    by_ratio = float(chdtrc(len(scored.parameters), max(gain, 0.0)))
    n_tried, level = n_names * scored.n_tried, problem.settings.significance.level
    p_value = max(by_ratio, wald_p(problem, fit, scored.name)) * n_tried
    named = not (problem.settings.scan.held_too and scored.name in OF_THE_DRIVES)
    by_answer = answer_p(problem, current.extension, fit, scored.name) * n_tried if named else 0.0
    failed = ANSWERED if p_value <= level < by_answer else ""
    if not failed and p_value <= level and seen_in_one_channel(problem, fit, scored.name):
        failed, p_value = ONE_CHANNEL, 1.0
    score = gain - price_of(problem, scored, fit)
    p_value = float(min(max(p_value, by_answer), 1.0))
    return FittedCandidate(scored, fit, gain, score, p_value, failed=failed)


def compare_in_fine_bins(
    problem: Problem, fitted: tuple[FittedCandidate, ...]
) -> tuple[FittedCandidate, ...]:
    """The same, the two best compared in bins of half the length where they are close.

    Lag and delay differ within a bin.
    """
    close = problem.settings.candidates.close
    if len(fitted) < 2 or fitted[0].score - fitted[1].score > close or fitted[0].score < 0:
        return fitted
    costs = fine_costs(problem, fitted[:2])
    first, second = (fitted[0], fitted[1]) if costs[0] <= costs[1] else (fitted[1], fitted[0])
    second = replace(second, score=first.score - abs(costs[0] - costs[1]))
    return (first, second, *fitted[2:])


def fine_costs(problem: Problem, fitted: Iterable[FittedCandidate]) -> list[float]:
    """Deviance and price of each in bins of half the length."""
    finer, steps = problem.finer(), problem.settings.budget.last_steps
    fits = [(a, gauss_newton(finer, a.fit.extension, a.fit.noise, steps)) for a in fitted]
    return [fit.deviance + price_of(problem, a.scored, a.fit) for a, fit in fits]


def is_ruled_out(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether its fit rules an effect out: at an end of what it may be, an answer to the disturbance, a slip
    that lasts as only a load does, or a size beside which the motion runs away.
    """
    if name == "slip_interval":
        interval = fit.extension.effects[name]
        return interval["end_s"] - interval["start_s"] > problem.settings.candidates.longest_slip_s
    if not np.isfinite(fit.psi[problem.train]).all():
        return True
    return is_at_an_end(problem, fit, name) or only_answers(problem, fit, name)


def is_at_an_end(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a load step lies so near an end of the log that only one side is seen, as of a payload.

    So is a response to the torques that is fitted at its bound: it says that torques move nothing.
    """
    if declaration_of(name).acts_on == "robot":
        bounds, values = candidate_of(name).bounds, fit.extension.effects[name]
        return any(value in bounds[key] for key, value in values.items())
    if name != "load_step":
        return False
    t_s, one_side = problem.binned.t_s, problem.settings.candidates.one_side
    share = (fit.extension.effects[name]["t0_s"] - t_s[0]) / (t_s[-1] - t_s[0])
    return not one_side <= share <= 1 - one_side


def only_answers(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a dead zone holds back no efforts but those that answer the disturbance, as any dead zone of a
    controlled robot seems to: nothing that is missing hides behind it. One as narrow as the answers does, but
    for one that is far wider than those ahead, or in turning; one that is not much wider does unless large
    efforts clearly lose as much.
    """
    if name != DEAD_ZONE:
        return False
    own, (least, most) = problem.settings.excitation, times_the_disturbance(fit)
    if least < own.narrow * own.least_ratio and most < own.far_wider * own.least_ratio:
        return True
    return large_ones_lose_nothing(problem, fit, own.clear_answers if least < own.least_ratio else 0.0)


def with_candidate(current: Fit, scored: ScoredCandidate) -> Extension:
    """The current model with the candidate in it."""
    return current.extension.with_effect(scored.name, scored.parameters)


def price_of(problem: Problem, scored: ScoredCandidate, fit: Fit) -> float:
    """BIC's price ln n of each parameter, and 2 ln of the times and places where it was looked for."""
    n = seen_parameters(problem, fit, scored.name) + has_own_form(fit, scored.name)
    n += scored.name == "slope" and fit.extension.held_sideways
    return float(n * np.log(3 * problem.train.sum()) + 2 * np.log(scored.n_tried))


def seen_parameters(problem: Problem, fit: Fit, name: str) -> int:
    """How many parameters of an effect the log can show.

    A patch that is crossed once shows three: its two ends on the path and the loss.
    """
    parameters = fit.extension.effects[name]
    if name != "low_friction_patch":
        return len(parameters)
    acts = weight(name, parameters, problem.binned)
    inside = acts > problem.settings.slip.half
    crossings = int(inside[0]) + int(np.sum(~inside[:-1] & inside[1:]))
    return 4 if crossings > 1 else 3

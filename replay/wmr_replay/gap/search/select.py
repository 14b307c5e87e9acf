"""Which effects are missing: forward selection by significance, then the gates for each."""

from collections.abc import Collection
from dataclasses import dataclass, replace

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model, gauss_newton, keys_of
from wmr_replay.gap.evidence.answer import LATE, beyond_answer
from wmr_replay.gap.evidence.excitation import gain_in_manoeuvres, too_calm_for
from wmr_replay.gap.evidence.one_place import skids_at_one_place, tyres_are_assumed
from wmr_replay.gap.evidence.sideways_arm import is_sideways_one_way
from wmr_replay.gap.evidence.significance import correlation, rows_that_show
from wmr_replay.gap.evidence.spread import may_be_nothing
from wmr_replay.gap.model.candidates import (
    BY_NAME,
    CONFOUNDED_FORMS,
    EVERY,
    LOCAL,
    candidate_of,
    own_candidates,
)
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.work import work_on
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import (
    IN_PARAMETERS,
    OF_THE_DRIVES,
    gain_as_inertia,
    gain_is_rest,
    is_rest,
    negligible,
)
from wmr_replay.gap.search.begun import Begun, fitted_on_the_whole
from wmr_replay.gap.search.between_forms import with_forms_between
from wmr_replay.gap.search.eliminate import (
    REST,
    Stages,
    eliminate,
    exchange_rivals,
    fit_without,
    may_be_a_rest,
)
from wmr_replay.gap.search.fit_candidates import (
    HIDING,
    FittedCandidate,
    Hints,
    fit_candidates,
    price_of,
)
from wmr_replay.gap.search.other_medium import with_other_medium
from wmr_replay.gap.search.same_loss import with_both_forms
from wmr_replay.gap.search.two_as_one import two_as_one
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_replay.gap.settings.search import SelectionSettings

FURTHER_EFFECTS = "further effects"
"""What a long log's search leaves out where it has found some."""


@dataclass(frozen=True, eq=False)
class Selection:
    """The effects found, in order, and the fitted candidates of every stage.

    ``base`` is the base model's fit, ``fit`` that of the extended model; ``refused`` says why the log cannot
    carry the verdict, ``dropped`` are effects that failed a gate beside the others, ``rests`` those that the
    base model holds here because it may leave as much. ``not_named`` are the effects that a formula means,
    each with why it is not named.
    """

    base: Fit
    fit: Fit
    found: tuple[FittedCandidate, ...]
    stages: tuple[tuple[FittedCandidate, ...], ...]
    refused: str = ""
    dropped: tuple[FittedCandidate, ...] = ()
    rests: tuple[FittedCandidate, ...] = ()
    not_named: tuple[tuple[str, str], ...] = ()


def select(problem: Problem, extension: Extension, options: GapOptions) -> Selection:
    """:func:`forward_selection`, then :func:`confirm`."""
    return confirm(problem, forward_selection(problem, extension, options), options)


def forward_selection(
    problem: Problem,
    extension: Extension,
    options: GapOptions,
    *,
    terms: bool = True,
    hints: Hints = (),
    begun: Begun | None = None,
    without: tuple[str, ...] = (),
) -> Selection:
    """One effect after the other while the best candidate is significant.

    With ``terms``, terms of the dictionary are tried where no effect of the library is significant. ``hints``
    are effects at which a fit may start; what is ``begun`` stands in front; those ``without`` are left out.
    A calibration that has found as many as it holds goes on with the drives' lag and delay.
    """
    base = current = base_fit(problem, extension)
    stages, rests = [] if begun is None else fitted_on_the_whole(problem, base, begun), []
    found = [stage[0] for stage in stages]
    current = found[-1].fit if found else base
    calibrating = problem.settings.scan.held_too
    while True:
        is_full = len(stages) >= options.max_effects + uncounted(problem, found)
        if is_full and (not calibrating or {*LATE} <= current.extension.effects.keys()):
            break
        if found and not work_on(problem.binned.log.pose).allows(FURTHER_EFFECTS):
            break
        left_out = (*without, *all_but(LATE)) if is_full else without
        fitted = fit_candidates(problem, current, terms=False, hints=hints, without=left_out)
        fitted = tuple(with_gain_as_inertia(one, problem.settings.misfit) for one in fitted)
        fitted = with_rests_alone(problem, fitted)
        if shows_rest(problem, extension, current, fitted):
            rests.append(replace(fitted[0], failed=REST))
            current = holding(problem, fitted[0])
            base = holding_too(problem, base, current) if found else current
            continue
        stage = next_stage(problem, base, current, found, fitted, terms=terms and not is_full)
        stages.append(stage)
        if not stage or stage[0].failed:
            break
        best = stage[0]
        others = tuple((a.name, best.score - a.score) for a in stage[1:] if 0 < a.score <= best.score)
        found.append(replace(best, alternatives=others))
        current = best.fit
    return Selection(base, current, tuple(found), tuple(stages), rests=tuple(rests))


def all_but(names: Collection[str]) -> tuple[str, ...]:
    """Every effect, users' own too, but those of these names."""
    return tuple(one.name for one in (*EVERY, *own_candidates()) if one.name not in names)


def uncounted(problem: Problem, found: list[FittedCandidate]) -> int:
    """How many of the effects found are none of the few that a calibration holds: those that stand for the
    robot's parameters, and those of its drives.
    """
    calibrating = problem.settings.scan.held_too
    return sum(one.name in (*IN_PARAMETERS, *OF_THE_DRIVES) for one in found) if calibrating else 0


def base_fit(problem: Problem, extension: Extension) -> Fit:
    """The base model with its diffusion, which starts at the prior."""
    return fit_model(problem, extension, None, problem.settings.budget.base_diffusion)


def with_gain_as_inertia(candidate: FittedCandidate, own: MisfitSettings) -> FittedCandidate:
    """A drive gain beside a payload as a payload and a yaw inertia, where that is a rest of the base model.
    Else the candidate.

    Held as a gain, a rest would change the payload.
    """
    extension = candidate.fit.extension
    if candidate.name != "drive_gain" or not gain_is_rest(extension, own):
        return candidate
    same = gain_as_inertia(extension)
    scored = replace(candidate.scored, name="yaw_inertia", parameters=dict(same.effects["yaw_inertia"]))
    return replace(candidate, scored=scored, fit=replace(candidate.fit, extension=same))


def with_rests_alone(problem: Problem, fitted: tuple[FittedCandidate, ...]) -> tuple[FittedCandidate, ...]:
    """The candidates, the best first, rests by those of their parameters alone that make an effect.

    A medium that hardly brakes the way ahead is a rest by that; what it would brake of turns may be another
    effect, which it hides if it is held.
    """
    alone = tuple(as_rest_alone(problem, one) for one in fitted)
    if alone == fitted:
        return fitted
    return tuple(sorted(alone, key=lambda one: (one.failed in HIDING, -one.score)))


def as_rest_alone(problem: Problem, candidate: FittedCandidate) -> FittedCandidate:
    """A rest with its parameters that need not be left out; any other candidate as it is."""
    name, extension = candidate.name, candidate.fit.extension
    absent = candidate_of(name).absent
    if extension.effects[name].items() >= absent.items():
        return candidate
    if not is_rest(name, extension, problem.settings.misfit):
        return candidate
    extension = extension.with_effect(name, {**extension.effects[name], **absent})
    keys = tuple(key for key in keys_of(extension) if key not in {(name, side) for side in absent})
    fit = gauss_newton(
        problem, extension, candidate.fit.noise, problem.settings.budget.ranked_steps, keys=keys
    )
    less = fit.deviance - candidate.fit.deviance
    return replace(candidate, fit=fit, gain=candidate.gain - less, score=candidate.score - less)


def shows_rest(
    problem: Problem, extension: Extension, current: Fit, fitted: tuple[FittedCandidate, ...]
) -> bool:
    """Whether what explains most, and significantly, is no more than the base model leaves, and there are
    few such rests so far. Such a rest hides what explains less.
    """
    own, held = problem.settings.misfit, len(current.extension.known) - len(extension.known)
    if not fitted or held >= own.most_rests or fitted[0].score <= 0:
        return False
    significant = fitted[0].p_value <= problem.settings.significance.level
    return significant and is_rest(fitted[0].name, fitted[0].fit.extension, own)


def holding(problem: Problem, rest: FittedCandidate) -> Fit:
    """The model with a rest that acts and is no finding."""
    extension, name = rest.fit.extension, rest.name
    known = (*extension.known, (name, extension.effects[name]))
    return fit_model(problem, replace(extension.without(name), known=known), rest.fit.noise)


def confirm(problem: Problem, selection: Selection, options: GapOptions) -> Selection:
    """Keep the effects that pass the needed-ness, hold-out, placebo, tolerance, excitation and size gates.

    An effect that may only answer the disturbance, or be none, hides others: they are tested again without
    it. Where none of them passes, the log cannot carry a verdict.
    """
    base, stages, refused = selection.base, selection.stages, ""
    dropped: list[FittedCandidate] = []
    current, found = exchange_rivals(problem, selection.fit, list(selection.found), stages)
    current, found = two_as_one(problem, current, found)
    while found:
        fit, kept = eliminate(problem, base, current, found, options, dropped)
        open_ones = {f.name: reason for f in kept if (reason := left_open(f.name, problem, fit))}
        open_ones = open_ones or rest_as_likely(problem, base, kept, stages)
        if kept and not open_ones:
            fit, both = with_both_forms(problem, fit, tuple(kept))
            both = tuple(beyond_answers(problem, fit, effect) for effect in both)
            both = tuple(with_forms_between(problem, fit, effect) for effect in both)
            fit, both = with_other_medium(problem, fit, both)
            return replace(selection, fit=fit, found=both, dropped=tuple(dropped))
        refused = refused or next(iter(open_ones.values()), "")
        found = [f for f in found if f.name not in open_ones] if open_ones else []
        for name in open_ones:
            current = fit_without(problem, base, current, name)
    return replace(selection, fit=base, found=(), refused=refused, dropped=tuple(dropped))


def left_open(name: str, problem: Problem, fit: Fit) -> str:
    """Why the log cannot carry the verdict ``name``, an effect of the model ``fit``; empty where it can."""
    if calm := too_calm_for(name, problem, fit):
        return calm
    for reason in (
        skids_at_one_place(name, problem, fit),
        tyres_are_assumed(name, problem),
        is_sideways_one_way(name, problem, fit),
    ):
        if reason:
            return reason
    if may_be_nothing(problem, fit, name):
        return (
            f"{name} would explain part of it, but its size may be 0: noise, contact modes, the tyres' creep "
            "and the form of the effect leave that much open"
        )
    return ""


def rest_as_likely(
    problem: Problem, base: Fit, kept: list[FittedCandidate], stages: Stages
) -> dict[str, str]:
    """By name of an effect that is found alone, why it may be another one that is about as likely, and that
    is no more than the base model leaves; empty where there is none.
    """
    if len(kept) != 1 or not stages:
        return {}
    (found,) = kept
    near = {name for name, worse in found.alternatives if worse < problem.settings.selection.strong}
    near -= {name for name in near if {found.name, name} in CONFOUNDED_FORMS}
    rests = (
        one.name
        for one in stages[0]
        if one.name in near and may_be_a_rest(problem, one.fit, base, one.name, beside=set())
    )
    rest = next(rests, "")
    said = (
        f"{found.name} would explain part of it, but so would {rest}, of which the base model leaves as much"
    )
    return {found.name: said} if rest else {}


def beyond_answers(problem: Problem, fit: Fit, effect: FittedCandidate) -> FittedCandidate:
    """The effect, nearer to those alternatives that an answer to the disturbance may put behind it."""
    if not effect.alternatives:
        return effect
    near = (
        (name, beyond_answer(problem, fit, effect.name, name, worse)) for name, worse in effect.alternatives
    )
    return replace(effect, alternatives=tuple(sorted(near, key=lambda one: one[1])))


def holding_too(problem: Problem, base: Fit, current: Fit) -> Fit:
    """The base model with the rests that the current model holds beside its effects."""
    extension = replace(base.extension, known=current.extension.known)
    return fit_model(problem, extension, base.noise, problem.settings.budget.without_diffusion)


def next_stage(
    problem: Problem,
    base: Fit,
    current: Fit,
    found: list[FittedCandidate],
    fitted: tuple[FittedCandidate, ...],
    *,
    terms: bool,
) -> tuple[FittedCandidate, ...]:
    """The library's candidates for the next effect, which are ``fitted``, the first one tested.

    The dictionary's terms take their place where none of the library is significant, a disturbance is left
    that something may explain, and a term passes.
    """
    settings = problem.settings
    above = tuple(one for one in fitted if not is_rest(one.name, one.fit.extension, problem.settings.misfit))
    if len(above) < len(fitted):  # a term would describe the same rest
        return first_tested(problem, base, current, above, found)
    stage = first_tested(problem, base, current, fitted, found)
    significant = stage and stage[0].p_value <= settings.significance.level and stage[0].score > 0
    left = calmed(current.noise, settings.diffusion, settings.selection.something_left)
    if terms and not significant and left is not None:
        others = first_tested(problem, base, current, fit_candidates(problem, current, terms=True), found)
        if others and not others[0].failed:
            return others
    return stage


def first_tested(
    problem: Problem,
    base: Fit,
    current: Fit,
    stage: tuple[FittedCandidate, ...],
    found: list[FittedCandidate],
) -> tuple[FittedCandidate, ...]:
    """The stage, its best significant candidate first, with the significance and remainder gates applied to
    that one.
    """
    if not stage:
        return ()
    level = problem.settings.significance.level
    significant = [c for c in stage if c.p_value <= level and c.score > 0]
    first = next((c for c in significant if explains_its_own(problem, c, stage[0])), None)
    if first is None:
        return (replace(stage[0], failed=stage[0].failed or "not significant"), *stage[1:])
    stage = (first, *(c for c in stage if c is not first))
    first = replace(first, correlation=correlation(problem, first.fit, first.name))
    naming = not problem.settings.scan.held_too
    if found and naming and first.gain < remainder(problem, base, current, first, found):
        first = replace(first, failed="a remainder of what is found already")
    if gain_in_manoeuvres(current, first.fit) < 0:
        first = replace(first, failed="makes manoeuvres less likely")
    return (first, *stage[1:])


def explains_its_own(problem: Problem, candidate: FittedCandidate, best: FittedCandidate) -> bool:
    """Whether a significant candidate explains something beside the one of the best score, if that is another
    one, which is not significant: less of the same is no reason to name it.
    """
    margin, budget = problem.settings.formula.margin, problem.settings.budget
    if candidate is best or best.failed or best.score - candidate.score < margin:
        return True
    both = best.fit.extension.with_effect(candidate.name, candidate.fit.extension.effects[candidate.name])
    fit = fit_model(problem, both, best.fit.noise, budget.without_diffusion)
    return best.fit.deviance - fit.deviance - price_of(problem, candidate.scored, fit) > margin


def is_slight(name: str, extension: Extension, own: SelectionSettings, misfit: MisfitSettings) -> bool:
    """Whether an effect of the library is small beside what matters in practice."""
    if name not in BY_NAME:
        return False
    size = BY_NAME[name].size_of(extension.effects[name])
    relevant = BY_NAME[name].declaration.relevant
    return size < (own.slight * relevant if relevant else negligible(name, extension, misfit))


def remainder(
    problem: Problem, base: Fit, current: Fit, candidate: FittedCandidate, found: list[FittedCandidate]
) -> float:
    """What the wrong form of the effects found may leave for a candidate, in units of deviance.

    A share of their largest gain, for one that is correlated with them, or slight. A local candidate is held
    against their gain in its time or place.
    """
    own, name = problem.settings.selection, candidate.name
    if name in LOCAL:
        rows = rows_that_show(problem, candidate.fit, name)
        return own.remainder_share * float((base.row_deviance - current.row_deviance)[rows].sum())
    if candidate.correlation <= own.correlated and not is_slight(
        name, candidate.fit.extension, own, problem.settings.misfit
    ):
        return 0.0
    confounded = [f.gain for f in found if {f.name, name} in CONFOUNDED_FORMS]
    by_form = own.confounded_share * max(confounded, default=0.0)
    return max(own.remainder_share * max(f.gain for f in found), by_form)

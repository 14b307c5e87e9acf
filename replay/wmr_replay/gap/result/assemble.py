"""From a selection to everything that a result holds."""

from wmr_replay.gap.estimation.path_error import window_errors
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.excitation import excitation_ratios
from wmr_replay.gap.evidence.holdout import held_out_errors, windows_within
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.detectable import minimum_detectable, unseen
from wmr_replay.gap.result.effects import extended_model, found_effects
from wmr_replay.gap.result.locate import locate
from wmr_replay.gap.result.metrics import gap_metric
from wmr_replay.gap.result.result import CandidateScore, FoundEffect, GapResult, Verdict
from wmr_replay.gap.result.sentence import sentence_of
from wmr_replay.gap.result.traces import traces_of
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.search.select import Selection
from wmr_schemas.effects import UNNAMED_PREFIX


def assemble(problem: Problem, selection: Selection, model: BaseModel, options: GapOptions) -> GapResult:
    """The result of a selection on ``problem``, with verdict, gaps, places and detectable sizes."""
    fit, base, binned = selection.fit, selection.base, problem.binned
    scanned = scan(problem, fit.extension, fit.noise, fit.psi)
    detectable = minimum_detectable(scanned, options.gates.detectable)
    effects = found_effects(problem, selection)
    hidden = unseen(detectable)
    verdict, notes = verdict_of(problem, effects, selection, hidden)
    at_floor = problem.filtered(base.extension, fit.noise, keep=True)
    trained = windows_within(problem, problem.train)
    errors = [(held_out_errors(problem, m), window_errors(binned, m.extension, trained)) for m in (base, fit)]
    return GapResult(
        verdict=verdict,
        sentence=sentence_of(verdict, effects, notes),
        effects=effects if verdict in ("named", "ambiguous", "unnamed") else (),
        where=locate(
            binned, base.extension.rows(binned), at_floor.states, at_floor.innovations, base.noise, fit.noise
        ),
        position=gap_metric(errors, "position", "m", options),
        yaw=gap_metric(errors, "yaw", "rad", options),
        modes=options.modes,
        base=model.source,
        unnameable=model.unnameable,
        minimum_detectable=detectable,
        model=extended_model(model, effects, fit.noise, binned),
        seed=options.seed,
        notes=notes,
        traces=traces_of(problem, base, fit),
        candidates=scores_of(selection),
    )


def scores_of(selection: Selection) -> tuple[CandidateScore, ...]:
    """The candidates of every stage, the best first."""
    return tuple(
        CandidateScore(stage, one.name, float(one.gain), float(one.score), float(one.p_value), one.failed)
        for stage, candidates in enumerate(selection.stages)
        for one in candidates
    )


def verdict_of(
    problem: Problem, effects: tuple[FoundEffect, ...], selection: Selection, hidden: tuple[str, ...]
) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict, and notes that say why it is no firmer.

    ``hidden`` are the effects of a relevant size that the log would not have shown.
    """
    settings = problem.settings
    if any(effect.name.startswith(UNNAMED_PREFIX) for effect in effects):
        return "unnamed", ()
    if effects:
        close = [
            f"{e.name} and {a.name} explain the log almost equally well"
            for e in effects
            for a in e.alternatives
            if a.delta_bic < settings.report.ambiguous_bic
        ]
        return ("ambiguous", tuple(close)) if close else ("named", ())
    if selection.refused:
        return "not_enough_excitation", (selection.refused,)
    calm = calm_note(problem, selection)
    if calm:
        return "not_enough_excitation", (calm,)
    if len(hidden) > settings.detectable.most_unseen:
        return "not_enough_excitation", ("the log would not have shown " + ", ".join(hidden),)
    return "nothing_missing", ()


def calm_note(problem: Problem, selection: Selection) -> str:
    """Why nothing found does not mean nothing missing; empty where it does."""
    least = problem.settings.excitation.least_ratio
    ahead, turning = excitation_ratios(problem, selection.fit.extension, selection.fit.noise)
    if min(ahead, turning) >= least:
        return ""
    what, ratio, sd = (
        ("longitudinal acceleration", ahead, selection.fit.noise.long_sd_mps2)
        if ahead < turning
        else ("turning", turning, selection.fit.noise.yaw_sd_mps2)
    )
    return (
        f"the {what} that the torques ask for varies by only {ratio:.1f} times a disturbance of {sd:.2g} "
        f"m/s² that no candidate explains (at least {least:g} times are needed)"
    )

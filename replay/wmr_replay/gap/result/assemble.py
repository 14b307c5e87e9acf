"""From a selection to everything that a result holds."""

from collections.abc import Iterator
from functools import reduce
from itertools import chain

from wmr_replay.gap.estimation.path_error import window_errors
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.answer import LATE, answered_score
from wmr_replay.gap.evidence.holdout import held_out_errors, windows_within
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.against import with_curves, with_formula_curves
from wmr_replay.gap.result.detectable import beyond_rests, minimum_detectable, unseen
from wmr_replay.gap.result.effects import extended_model, found_effects
from wmr_replay.gap.result.formulas import formulas_of, unseen_parity
from wmr_replay.gap.result.in_doubt import in_doubt, within_the_base
from wmr_replay.gap.result.in_other_words import in_other_words
from wmr_replay.gap.result.locate import locate, marked, placed
from wmr_replay.gap.result.metrics import gap_metric, with_slip_gaps
from wmr_replay.gap.result.place_reach import crossed_once
from wmr_replay.gap.result.result import CandidateScore, GapResult, Where
from wmr_replay.gap.result.sentence import sentence_of
from wmr_replay.gap.result.traces import residual, traces_of
from wmr_replay.gap.result.undecided import skidding_note, slip_or_loss
from wmr_replay.gap.result.unexplained import unexplained
from wmr_replay.gap.result.verdict import (
    less_than_slipping_note,
    slipping_note,
    verdict_of,
    what_to_drive,
)
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.scan.turning_in_doubt import doubts
from wmr_replay.gap.search.eliminate import Stages
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import Selection


def assemble(problem: Problem, selection: Selection, model: BaseModel, options: GapOptions) -> GapResult:
    """The result of a selection on ``problem``, with verdict, gaps, places and detectable sizes."""
    fit, base, binned = selection.fit, selection.base, problem.binned
    scanned = scan(problem, fit.extension, fit.noise, fit.psi)
    points = {name: value for name, (value, _) in scanned.unit_information.items() if name in LATE}
    answers = {name: answered_score(problem, fit, name, value) for name, value in points.items()}
    detectable = minimum_detectable(scanned, options.gates.detectable, answers)
    effects = found_effects(problem, selection)
    verdict, notes = verdict_of(problem, effects, selection, unseen(detectable))
    where = located(problem, base, fit)
    if verdict == "nothing_missing":
        left = unexplained(problem, selection, options.seed)
        if left is not None:
            verdict, where, notes = "unnamed", marked(where, left), (placed(left),)
        elif undecided := slip_or_loss(problem, base):
            verdict, notes = "not_enough_excitation", undecided
        elif doubt := in_doubt(problem, selection, model, options):
            verdict, notes = "not_enough_excitation", (doubt,)
    elif verdict == "not_enough_excitation" and not selection.refused:
        notes = (*filter(None, (within_the_base(problem, selection, model, options),)), *notes)
    sentence = sentence_of(verdict, effects, notes, options.gates.report)
    in_modes: tuple[str, ...] = ()
    if verdict in ("named", "ambiguous"):
        notes = (*notes, *crossed_once(binned, fit), *less_than_slipping_note(selection))
        notes = (*notes, *in_other_words(effects, base.extension, options.gates.report))
    if verdict in ("nothing_missing", "not_enough_excitation"):
        in_modes = (*slipping_note(problem), *skidding_note(problem, detectable))
    trained = windows_within(problem, problem.fold(0).train)
    errors = [(held_out_errors(problem, m), window_errors(binned, m.extension, trained)) for m in (base, fit)]
    traces = traces_of(problem, base, fit)
    gaps = gap_metric(errors, "position", "m", options), gap_metric(errors, "yaw", "rad", options)
    position, yaw = with_slip_gaps(problem, traces, *gaps)
    formulas = formulas_of(effects, binned)
    notes = (*notes, *unseen_parity(formulas, binned, options.gates.report))
    formulas = with_formula_curves(
        formulas,
        traces,
        lambda one: residual(problem, reduce(Extension.without, one.terms, fit.extension), base),
        options.gates.shown,
    )
    effects = with_curves(
        effects,
        traces,
        lambda name: residual(problem, fit.extension.without(name), base),
        options.gates.shown,
    )
    return GapResult(
        verdict=verdict,
        sentence=sentence,
        effects=effects if verdict in ("named", "ambiguous", "unnamed") else (),
        where=where,
        position=position,
        yaw=yaw,
        modes=options.modes,
        base=model.source,
        unnameable=model.unnameable,
        minimum_detectable=beyond_rests(detectable, fit.extension, options.gates.misfit),
        model=extended_model(model, effects, fit, binned),
        seed=options.seed,
        notes=(*notes, *in_modes, *doubts(model.misfit, options.gates.misfit), *what_to_drive(verdict)),
        traces=traces,
        candidates=scores_of(selection),
        formulas=formulas,
    )


def located(problem: Problem, base: Fit, fit: Fit) -> Where:
    """Where the base model disagrees with the log, at the extended model's diffusion."""
    binned, at_floor = problem.binned, problem.filtered(base.extension, fit.noise, keep=True)
    rows = base.extension.rows(binned)
    return locate(binned, rows, at_floor.states, at_floor.innovations, base.noise, fit.noise)


def scores_of(selection: Selection) -> tuple[CandidateScore, ...]:
    """The candidates of every stage, the best first; where nothing was found, the rests in front of all."""
    rests = () if selection.found else selection.rests
    by_stage = chain(((0, one) for one in rests), staged(selection.stages))
    return tuple(
        CandidateScore(stage, one.name, float(one.gain), float(one.score), float(one.p_value), one.failed)
        for stage, one in by_stage
    )


def staged(stages: Stages) -> Iterator[tuple[int, FittedCandidate]]:
    """Each candidate with its stage."""
    return ((stage, one) for stage, candidates in enumerate(stages) for one in candidates)

"""From a selection to the result that ``gap.json``, timeline, report and plots are made of."""

from dataclasses import replace

import numpy as np
from scipy.special import ndtri, stdtrit

from wmr_replay.gap.model.confounds import separate_with
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.against import with_curves
from wmr_replay.gap.result.metrics import paired_reduction, rms
from wmr_replay.gap.result.result import (
    Alternative,
    CandidateScore,
    Detectable,
    Estimate,
    FoundEffect,
    GapMetric,
    GapResult,
    HeldOutGap,
    TrainGap,
    Where,
)
from wmr_replay.gap.result.sentence import sentence_of
from wmr_replay.gap.result.shown_by import shown_by
from wmr_replay.gap.wheel_speed.base import Base
from wmr_replay.gap.wheel_speed.disagreement import Disagreement, disagreement
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import Fit
from wmr_replay.gap.wheel_speed.evidence import folds_of
from wmr_replay.gap.wheel_speed.held_out import held_out_gaps, pose_noise
from wmr_replay.gap.wheel_speed.predict import DECLARED, Parameter, Problem, composed
from wmr_replay.gap.wheel_speed.proof import Proof, proof_of
from wmr_replay.gap.wheel_speed.remarks import remarks_on
from wmr_replay.gap.wheel_speed.scan import Score
from wmr_replay.gap.wheel_speed.select import Named, Selection, same_in_any_motion
from wmr_replay.gap.wheel_speed.units import held_out_bins
from wmr_replay.gap.wheel_speed.verdict import said_of, verdict_of
from wmr_replay.gap.wheel_speed.whereabouts import locate, slip_velocities, traces_of
from wmr_replay.gap.wheel_speed.windows import Gaps, Windows, gaps_of, windows_of
from wmr_schemas.arrays import F64
from wmr_schemas.model_file import Effect, Model, NoiseModel, Odometry

EDGE_SD_S, EDGE_SD_M = 0.15, 0.1
"""Standard deviations that the unknown form of an edge adds to a time [s] and a place [m]."""
SAME_LENGTH_S = 0.05
"""Windows whose length differs from the wanted one by less are said to be of that length."""


def assemble(selection: Selection, base: Base, options: GapOptions) -> GapResult:
    """The result with verdict, gaps, places and detectable sizes."""
    problem = selection.problem
    pose_sd = pose_noise(problem)
    windows = windows_of(problem, options.gates.windows.window_s)
    proofs = [proof_of(problem, windows, one, pose_sd) for one in (selection.base, selection.fit)]
    effects = tuple(found_effect(problem, selection, named) for named in selection.found)
    names = tuple(named.name for named in selection.found)
    detectable = minimum_detectable(problem, selection.left, names, options)
    standing = disagreement(problem, selection.fit)
    verdict, reasons = verdict_of(problem, selection, detectable, standing)
    left = () if standing is None or not selection.found else (said_of(standing),)
    remarks = remarks_on(effects, measured=problem.record.driven_by != "command")
    held_out = held_out_bins(problem, 0)
    traces = traces_of(problem, windows, selection.base, selection.fit, pose_sd, held_out.astype(float))
    effects = with_curves(
        effects,
        traces,
        lambda name: slip_velocities(problem, without(selection, name)),
        options.gates.shown,
        by_wheels=True,
    )
    return GapResult(
        verdict=verdict,
        sentence=sentence_of(verdict, effects, reasons, options.gates.report),
        effects=effects if verdict in ("named", "ambiguous", "unnamed") else (),
        where=where_of(problem, selection, options, standing),
        position=metric(proofs, "position", "m", windows.seconds, options),
        yaw=metric(proofs, "yaw", "rad", windows.seconds, options),
        modes="ideal" if options.modes == "ideal" else "identified",
        base=base.source,
        unnameable=base.unnameable,
        minimum_detectable=detectable,
        model=extended_model(problem, selection, base, effects),
        seed=options.seed,
        notes=(
            *reasons,
            *remarks,
            *left,
            *short_windows(windows.seconds, options),
        ),
        traces=traces,
        candidates=tuple(
            CandidateScore(t.stage, t.name, t.gain, t.score, t.p_value, t.failed) for t in selection.tried
        ),
        base_model="wheel_speed",
        odometry=odometry(problem, (selection.base, selection.fit), options),
    )


def without(selection: Selection, name: str) -> Values:
    """The parameters of the extended model, those of one effect as in the base model."""
    values, base = dict(selection.fit.values), selection.base.values
    values.pop(name, None)
    return values | ({name: base[name]} if name in base else {})


def short_windows(seconds: float, options: GapOptions) -> tuple[str, ...]:
    """A note where the log's stretches are shorter than a window."""
    wanted = options.gates.windows.window_s
    if seconds > wanted - SAME_LENGTH_S:
        return ()
    return (f"the log's stretches are shorter than {wanted:g} s: the gap is that over {seconds:.3g} s",)


def found_effect(problem: Problem, selection: Selection, named: Named) -> FoundEffect:
    """An effect with its intervals, confounds and alternatives."""
    fit, declared = selection.fit, DECLARED[named.name]
    tail = float(-stdtrit(max(fit.n_clusters - len(fit.parameters), 5), 0.025))
    parameters = {
        one.key: estimate(problem, one, float(value), tail * float(sd))
        for one, value, sd in zip(fit.parameters, fit.sizes, fit.sd, strict=True)
        if one.effect == named.name
    }
    close = tuple(name for name, delta in named.alternatives if delta < 10.0)
    return FoundEffect(
        name=named.name,
        channel=declared.channel,
        formula=declared.formula_of("wheel_speed"),
        parameters=parameters,
        confound_class=same_in_any_motion(problem, named.name),
        alternatives=tuple(
            Alternative(name, delta, separate_with(named.name, (name,))) for name, delta in named.alternatives
        ),
        p_value=named.p_value,
        separate_with=separate_with(named.name, close),
        **shown_by(named.name)._asdict(),
    )


def estimate(problem: Problem, which: Parameter, value: float, half: float) -> Estimate:
    """A parameter with its interval; that of a time or a place counts the unknown form of an edge, and is
    clipped to the record.
    """
    declared = DECLARED[which.effect].parameters[which.key]
    if declared.role != "size":
        edge = 2 * (EDGE_SD_S if which.key.endswith("_s") else EDGE_SD_M)
        half = min(float(np.hypot(half, edge)), span_of(problem, which.key))
    least, _, most, _ = declared.domain.value
    return Estimate(value, (max(value - half, least), min(value + half, most)), declared.unit)


def span_of(problem: Problem, key: str) -> float:
    """How far a time or a place can lie from another one in the record, s or m."""
    record = problem.record
    if key.endswith("_s"):
        return float(np.ptp(record.pose_s))
    return float(np.hypot(np.ptp(record.pose[0]), np.ptp(record.pose[1])))


def where_of(
    problem: Problem, selection: Selection, options: GapOptions, standing: Disagreement | None
) -> Where:
    """Where the base model and the log disagree; a disagreement that nothing explains stands alone."""
    where = locate(problem, selection.base, selection.fit, options.gates.locate)
    if standing is None or selection.found:
        return where
    return replace(where, intervals=standing.intervals, regions=standing.regions)


def minimum_detectable(
    problem: Problem, scores: tuple[Score, ...], found_names: tuple[str, ...], options: GapOptions
) -> dict[str, Detectable]:
    """The least size of each effect that a test at the level would find in nine logs of ten."""
    own = options.gates.detectable
    z = float(-ndtri(own.level / max(len(scores), 1) / 2) - ndtri(1 - own.power))
    found = {}
    hidden = {other for name in found_names for other in same_in_any_motion(problem, name)}
    for score in sorted(scores, key=lambda one: DECLARED[one.name].number):
        if (
            score.name not in hidden
            and DECLARED[score.name].zero_is_absent
            and score.information.size
            and score.information[0, 0] > 0
        ):
            unit = next(iter(DECLARED[score.name].units.values()))
            found[score.name] = Detectable(z / float(np.sqrt(score.information[0, 0])), unit)
    return found


def metric(proofs: list[Proof], what: str, unit: str, seconds: float, options: GapOptions) -> GapMetric:
    """The gap in position or yaw, before and after."""
    attribute = f"{what}_{unit}"
    (before, train_before), (after, train_after) = (
        (getattr(p.held_out.errors, attribute), getattr(p.trained.errors, attribute)) for p in proofs
    )
    floor = getattr(proofs[1].held_out.errors, "floor_m" if unit == "m" else "floor_rad")
    return GapMetric(
        metric=f"{what}_rms_{seconds:.0f}s",
        unit=unit,
        windows=len(before),
        train=TrainGap(rms(train_before), rms(train_after)),
        held_out=HeldOutGap(rms(before), rms(after), rms(floor), *paired_reduction(before, after, options)),
    )


def odometry(problem: Problem, fits: tuple[Fit, Fit], options: GapOptions) -> Odometry:
    """The error of dead reckoning at each window's end, from the measured pose at its start; held out.

    Windows in which the robot slips are among them: an odometry is used there, too.
    """
    whole = problem.with_slip
    windows = windows_of(whole, options.gates.windows.window_s)
    before, after = (held_out_windows(problem, windows, fit) for fit in fits)
    return Odometry(
        seconds=windows.seconds,
        windows=len(before.end_m),
        position_rms_before_m=rms(before.end_m),
        position_rms_after_m=rms(after.end_m),
        position_median_before_m=median(before.end_m),
        position_median_after_m=median(after.end_m),
        yaw_rms_before_rad=rms(before.end_rad),
        yaw_rms_after_rad=rms(after.end_rad),
    )


def held_out_windows(problem: Problem, windows: Windows, fit: Fit) -> Gaps:
    """The gaps of windows, slip among them, by a model that was fitted without slip and without them."""
    whole, pose_sd = problem.with_slip, pose_noise(problem)
    if not fit.parameters:
        return gaps_of(whole, windows, fit.values, pose_sd)
    return held_out_gaps(whole, windows, folds_of(problem, fit), pose_sd)


def median(values: F64) -> float:
    """Median; NaN of an empty array."""
    return float(np.median(values)) if len(values) else float("nan")


def extended_model(
    problem: Problem, selection: Selection, base: Base, effects: tuple[FoundEffect, ...]
) -> Model:
    """The base model with the effects found, as a file holds it."""
    fit = selection.fit
    sds = {(one.effect, one.key): float(sd) for one, sd in zip(fit.parameters, fit.sd, strict=True)}
    new = tuple(
        Effect(
            effect.name,
            {key: p.value for key, p in effect.parameters.items()},
            {key: sds[effect.name, key] for key in effect.parameters},
        )
        for effect in effects
    )
    return Model(
        robot=base.robot,
        robot_sd=base.robot_sd,
        noise=noise_model(problem, fit),
        effects=merged(base.effects, new),
    )


def merged(base: tuple[Effect, ...], new: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """The effects of both models, those of one name composed as in the fit, with the new sds."""
    found = {effect.name: effect for effect in base}
    for effect in new:
        old = found.get(effect.name)
        known = {} if old is None else old.parameters
        values = {k: composed(effect.name, k, known.get(k), v) for k, v in effect.parameters.items()}
        found[effect.name] = replace(effect, parameters=values)
    return tuple(found.values())


def noise_model(problem: Problem, fit: Fit) -> NoiseModel:
    """Noise of a pose, and densities of the slip velocities."""
    position, yaw = pose_noise(problem)
    return NoiseModel(
        position_sd_m=position,
        yaw_sd_rad=yaw,
        slip_longitudinal_mps_rthz=fit.noises[0].density,
        slip_lateral_mps_rthz=fit.noises[1].density,
        slip_yaw_radps_rthz=fit.noises[2].density,
    )

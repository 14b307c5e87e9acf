"""The workflow: base model → locate → name → prove → extended model."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import bootstrap, wilcoxon
from scipy.stats import t as student

from wmr_replay.gap.base import base_of
from wmr_replay.gap.calibrate import calibrate_on_log
from wmr_replay.gap.confounds import confound_class, separate_with
from wmr_replay.gap.detectable import minimum_detectable, unseen
from wmr_replay.gap.dictionary import form_of
from wmr_replay.gap.drive import Drive, drive_of
from wmr_replay.gap.excitation import LEAST_RATIO, liveliness
from wmr_replay.gap.extension import Extension
from wmr_replay.gap.kalman import Diffusion
from wmr_replay.gap.modes import identified_modes
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.predict import WINDOW_S, WindowErrors, window_errors
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.prove import held_out_errors, windows_within
from wmr_replay.gap.result import (
    Alternative,
    Estimate,
    FoundEffect,
    GapMetric,
    GapResult,
    HeldOutGap,
    TrainGap,
    Verdict,
)
from wmr_replay.gap.scan import scan
from wmr_replay.gap.select import LEVEL, LOCAL, PLACES, Selection, covariance, select
from wmr_replay.gap.sentence import sentence_of
from wmr_replay.gap.traces import traces_of
from wmr_replay.gap.where import locate
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.model_file import Effect, Model, NoiseModel
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack

Progress = Callable[[str, float], None]
AMBIGUOUS_BIC = 10.0
SELF_CALIBRATED = ("payload", "drive_gain", "yaw_inertia")
MUCH_SLIP = 0.12
EDGE_SD_S, EDGE_SD_M = 0.3, 0.15
SWITCH_S = 0.3
"""How well an identifier knows when a mode begins or ends."""


@dataclass(frozen=True, eq=False)
class BaseModel:
    """The model that the log is held against, and where it came from."""

    robot: RobotParameters
    effects: tuple[Effect, ...]
    source: str
    unnameable: tuple[str, ...] = ()

    @property
    def extension(self) -> Extension:
        """Without what is still to be found."""
        known = {effect.name: dict(effect.parameters) for effect in self.effects}
        return Extension(base_of(self.robot), {}, self.robot.wheel_radius_m or 1.0, known)


def analyse(
    log: Log, base: Model | None = None, options: GapOptions | None = None, progress: Progress | None = None
) -> GapResult:
    """What the model ``base`` (default: the log's own nominal parameters) lacks to explain ``log``.

    Raises InvalidSignal where the log has no torques or is too short. The modes are the identifier's,
    ideal, or those of ``log.mode``, as ``options.modes`` says; the log's mode is read in the last case only.
    """
    options, tell = options or GapOptions(), progress or (lambda _stage, _share: None)
    tell("base model", 0.0)
    model = base_model(log, base, options)
    tell("naming", 0.1)
    problem, selection = search(replace(log, robot=model.robot), model.extension, options, tell)
    tell("proving", 0.8)
    return report(problem, selection, model, options)


def base_model(log: Log, base: Model | None, options: GapOptions) -> BaseModel:
    """The model file's, else the log's own, else one calibrated on the log."""
    own = log.robot.known()
    if base is not None:
        robot = RobotParameters.from_values(own | base.robot.known(), "model")
        if robot.alpha is not None and robot.half_track_m is not None:
            return BaseModel(robot, base.effects, "model file")
        log = replace(log, robot=robot)
    elif log.robot.alpha is not None and log.robot.half_track_m is not None:
        return BaseModel(log.robot, (), "metadata record")
    fitted = calibrate_on_log(log, options)
    effects = base.effects if base is not None else ()
    return BaseModel(fitted.robot, effects, "calibrated on the log", SELF_CALIBRATED)


def search(log: Log, extension: Extension, options: GapOptions, tell: Progress) -> tuple[Problem, Selection]:
    """The selection, with modes found together with the effects where the identifier is to say them."""
    if options.modes != "identified":
        problem = Problem.of(drive_of(log, log.mode if options.modes == "given" else None))
        return problem, select(problem, extension, options)
    return search_with_modes(log, extension, options, tell)


def search_with_modes(
    log: Log, extension: Extension, options: GapOptions, tell: Progress
) -> tuple[Problem, Selection]:
    """The identifier takes a missing effect for slip, so what shows with the base model's modes, proven or
    not, is a hint: with it the modes are identified anew, and the selection is made from the start. Where
    nothing shows and much is called slipping, the hint comes from slipping taken for ideal. The most likely
    answer with a proven effect stands, else the most likely.
    """
    first = identified_modes(log, extension)
    problem = Problem.of(identified_drive(log, first))
    tell("naming", 0.2)
    answers = [(problem, select(problem, extension, options))]
    hint = suggestion(extension, answers[0][1])
    if not hint.effects and np.mean(problem.drive.mode >= 2) > MUCH_SLIP:
        without = Problem.of(identified_drive(log, without_slip(first)))
        hint = suggestion(extension, select(without, extension, options, provisional=True))
    if hint.effects:
        tell("naming", 0.5)
        problem = Problem.of(identified_drive(log, identified_modes(log, hint)))
        answers.append((problem, select(problem, extension, options)))
    return min(answers, key=lambda answer: (not answer[1].found, answer[1].fit.deviance))


def suggestion(extension: Extension, selection: Selection) -> Extension:
    """What is significant in a selection and holds throughout; what acts in an interval or a place is for the
    identifier to say.
    """
    effects = {k: v for k, v in selection.fit.extension.effects.items() if k not in LOCAL}
    for stage in selection.stages:
        lasting = [tried for tried in stage if tried.lead.name not in LOCAL]
        best = lasting[0] if lasting else None
        if best is not None and best.p_value <= LEVEL and best.score > 0 and best.lead.name not in effects:
            effects[best.lead.name] = best.fit.extension.effects[best.lead.name]
    return replace(extension, effects=effects)


def identified_drive(log: Log, track: ModeTrack) -> Drive:
    """The drive by modes that an identifier said, which knows their changes to ``SWITCH_S`` only."""
    return drive_of(log, track, margin_s=SWITCH_S)


def without_slip(track: ModeTrack) -> ModeTrack:
    """The same, slipping taken for ideal: a missing effect may look like slip to an identifier."""
    return ModeTrack(track.t_ns, (track.mode % 2).astype(np.int8))


def report(problem: Problem, selection: Selection, model: BaseModel, options: GapOptions) -> GapResult:
    """Everything that a result holds."""
    fit, base, drive = selection.fit, selection.base, problem.drive
    scanned = scan(problem, fit.extension, fit.noise, fit.psi)
    detectable = minimum_detectable(scanned)
    effects = found_effects(problem, selection, options.modes)
    verdict, notes = verdict_of(problem, effects, selection, unseen(detectable))
    at_floor = problem.passed(base.extension, fit.noise, keep=True)
    trained = windows_within(problem, problem.train)
    errors = [
        (held_out_errors(problem, m), window_errors(drive, m.extension, trained, problem.variances))
        for m in (base, fit)
    ]
    return GapResult(
        verdict=verdict,
        sentence=sentence_of(verdict, effects, notes),
        effects=effects if verdict in ("named", "ambiguous", "unnamed") else (),
        where=locate(
            drive, base.extension.rows(drive), at_floor.states, at_floor.innovations, base.noise, fit.noise
        ),
        position=metric(errors, "position", "m"),
        yaw=metric(errors, "yaw", "rad"),
        modes=options.modes,
        base=model.source,
        unnameable=model.unnameable,
        minimum_detectable=detectable,
        model=extended_model(model, effects, fit.noise, drive),
        seed=options.seed,
        notes=notes,
        traces=traces_of(problem, base, fit),
    )


def found_effects(problem: Problem, selection: Selection, modes: str) -> tuple[FoundEffect, ...]:
    """The effects with intervals, classes and alternatives."""
    if not selection.found:
        return ()
    fit = selection.fit
    V, n_blocks = covariance(problem, fit)
    V = V + np.diag([place_variance(name, key) for name, key in fit.keys])
    width = student.isf(0.025, max(n_blocks - len(V), 5)) * np.sqrt(np.diag(V))
    names = tuple(tried.lead.name for tried in selection.found)
    effects = []
    for tried in selection.found:
        name = tried.lead.name
        form = form_of(name)
        parameters = {
            key: Estimate(float(value), (float(value - w), float(value + w)), form.parameters[key])
            for (owner, key), value, w in zip(fit.keys, fit.values, width, strict=True)
            if owner == name
        }
        alternatives = tuple(Alternative(other, delta) for other, delta in tried.alternatives)
        close = tuple(a.name for a in alternatives if a.delta_bic < AMBIGUOUS_BIC)
        effects.append(
            FoundEffect(
                name,
                form.channel,
                form.formula,
                parameters,
                confound_class(names, name, identified=modes == "identified"),
                alternatives,
                tried.p_value,
                separate_with(name, close),
            )
        )
    return tuple(effects)


def place_variance(name: str, key: str) -> float:
    """What the unknown form of an edge adds to the variance of a time [s²] or a place [m²]."""
    local = name in (*LOCAL, "load_step") and key in PLACES
    return (EDGE_SD_S if key.endswith("_s") else EDGE_SD_M) ** 2 if local else 0.0


def verdict_of(
    problem: Problem, effects: tuple[FoundEffect, ...], selection: Selection, hidden: tuple[str, ...]
) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict, and notes that say why it is no firmer."""
    if any(effect.name.startswith(UNNAMED_PREFIX) for effect in effects):
        return "unnamed", ()
    if effects:
        close = [
            f"{e.name} and {a.name} explain the log almost equally well"
            for e in effects
            for a in e.alternatives
            if a.delta_bic < AMBIGUOUS_BIC
        ]
        return ("ambiguous", tuple(close)) if close else ("named", ())
    if selection.refused:
        return "not_enough_excitation", (selection.refused,)
    calm = calm_note(problem, selection)
    if calm:
        return "not_enough_excitation", (calm,)
    if len(hidden) >= 5:
        return "not_enough_excitation", ("the log would not have shown " + ", ".join(hidden),)
    return "nothing_missing", ()


def calm_note(problem: Problem, selection: Selection) -> str:
    """Why nothing found does not mean nothing missing; empty where it does."""
    ahead, turning = liveliness(problem, selection.fit.extension, selection.fit.noise)
    if min(ahead, turning) >= LEAST_RATIO:
        return ""
    what, ratio, sd = (
        ("longitudinal acceleration", ahead, selection.fit.noise.long_sd_mps2)
        if ahead < turning
        else ("turning", turning, selection.fit.noise.yaw_sd_mps2)
    )
    return (
        f"the {what} that the torques ask for varies by only {ratio:.1f} times a disturbance of {sd:.2g} "
        f"m/s² that no candidate explains (at least {LEAST_RATIO:g} times are needed)"
    )


def metric(errors: list[tuple[WindowErrors, WindowErrors]], what: str, unit: str) -> GapMetric:
    """One of the two gaps, before and after."""
    (before, train_before), (after, train_after) = errors
    attribute = f"position_{unit}" if what == "position" else f"yaw_{unit}"
    b, a = getattr(before, attribute), getattr(after, attribute)
    floor = before.floor_m if what == "position" else before.floor_rad
    return GapMetric(
        metric=f"{what}_rms_{WINDOW_S:.0f}s",
        unit=unit,
        windows=len(b),
        train=TrainGap(rms(getattr(train_before, attribute)), rms(getattr(train_after, attribute))),
        held_out=HeldOutGap(rms(b), rms(a), rms(floor), *paired(b, a)),
    )


def rms(values: F64) -> float:
    """Root mean square, NaN of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def paired(before: F64, after: F64) -> tuple[tuple[float, float], float]:
    """95 % interval of the reduction of the root mean square over windows, and Wilcoxon's one-sided p."""
    if len(before) < 3 or np.all(before == after):
        return (0.0, 0.0), 1.0

    def reduction(b: F64, a: F64, axis: int = -1) -> F64:
        return np.asarray(1 - np.sqrt(np.mean(a**2, axis=axis) / np.mean(b**2, axis=axis)))

    found = bootstrap(
        (before, after), reduction, paired=True, vectorized=True, n_resamples=999, method="percentile", rng=0
    )
    interval = (float(found.confidence_interval.low), float(found.confidence_interval.high))
    return interval, float(wilcoxon(np.log(before) - np.log(after), alternative="greater").pvalue)


def extended_model(
    model: BaseModel, effects: tuple[FoundEffect, ...], noise: Diffusion, drive: Drive
) -> Model:
    """The base with the effects found, as a file holds it."""
    new = tuple(
        Effect(
            e.name,
            {key: p.value for key, p in e.parameters.items()},
            {key: (p.ci95[1] - p.ci95[0]) / 3.92 for key, p in e.parameters.items()},
        )
        for e in effects
    )
    return Model(
        robot=model.robot,
        noise=noise_model(noise, drive.noise_sd),
        effects=(*model.effects, *new),
    )


def noise_model(noise: Diffusion, noise_sd: F64) -> NoiseModel:
    """Pose noise, and the disturbances' density at low frequency, s √(2 τ)."""
    long = noise.long_sd_mps2 * np.sqrt(2 * noise.long_tau_s)
    yaw = noise.yaw_sd_mps2 * np.sqrt(2 * noise.yaw_tau_s)
    return NoiseModel(float(noise_sd[0]), float(noise_sd[2]), float(long), float(long), float(yaw))

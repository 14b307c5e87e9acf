"""From a selection to everything that a result holds."""

from dataclasses import replace

import numpy as np
from scipy.stats import bootstrap, wilcoxon
from scipy.stats import t as student

from wmr_replay.effects.efforts import combined
from wmr_replay.gap.estimation.binned_log import Drive
from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.estimation.path_error import WINDOW_S, WindowErrors, window_errors
from wmr_replay.gap.estimation.problem import Problem, noise_model
from wmr_replay.gap.evidence.detectable import minimum_detectable, unseen
from wmr_replay.gap.evidence.excitation import LEAST_RATIO, liveliness
from wmr_replay.gap.evidence.holdout import held_out_errors, windows_within
from wmr_replay.gap.evidence.locate import locate
from wmr_replay.gap.evidence.significance import covariance
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.candidates import declaration_of, is_place
from wmr_replay.gap.model.confounds import confound_class, separate_with
from wmr_replay.gap.model.extension import WEIGHTS
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import (
    Alternative,
    Estimate,
    FoundEffect,
    GapMetric,
    GapResult,
    HeldOutGap,
    TrainGap,
    Verdict,
)
from wmr_replay.gap.result.sentence import sentence_of
from wmr_replay.gap.result.traces import traces_of
from wmr_replay.gap.search.scan import scan
from wmr_replay.gap.search.select import Selection
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.model_file import Effect, Model

AMBIGUOUS_BIC = 10.0
EDGE_SD_S, EDGE_SD_M = 0.3, 0.15


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
        position=metric(errors, "position", "m", options.seed),
        yaw=metric(errors, "yaw", "rad", options.seed),
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
        form = declaration_of(name)
        parameters = {
            key: Estimate(float(value), interval(problem.drive, name, key, value, w), form.units[key])
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


def interval(drive: Drive, name: str, key: str, value: float, width: float) -> tuple[float, float]:
    """About the value; times and places no further than the log and its path go."""
    low, high = float(value - width), float(value + width)
    if not is_place(name, key):
        return low, high
    x_m, y_m = drive.pose[:, 0], drive.pose[:, 1]
    across_m = float(np.hypot(np.ptp(x_m), np.ptp(y_m)))
    spans = {"x_m": (x_m.min(), x_m.max()), "y_m": (y_m.min(), y_m.max()), "radius_m": (0.0, across_m)}
    first, last = spans.get(key, (drive.t_s[0], drive.t_s[-1]))
    return max(low, min(float(first), float(value))), min(high, max(float(last), float(value)))


def place_variance(name: str, key: str) -> float:
    """What the unknown form of an edge adds to the variance of a time [s²] or a place [m²]."""
    return (EDGE_SD_S if key.endswith("_s") else EDGE_SD_M) ** 2 if is_place(name, key) else 0.0


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


def metric(errors: list[tuple[WindowErrors, WindowErrors]], what: str, unit: str, seed: int) -> GapMetric:
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
        held_out=HeldOutGap(rms(b), rms(a), rms(floor), *paired(b, a, seed)),
    )


def rms(values: F64) -> float:
    """Root mean square, NaN of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def paired(before: F64, after: F64, seed: int) -> tuple[tuple[float, float], float]:
    """95 % interval of the reduction of the root mean square over windows, and Wilcoxon's one-sided p."""
    if len(before) < 3 or np.all(before == after):
        return (0.0, 0.0), 1.0

    def reduction(b: F64, a: F64, axis: int = -1) -> F64:
        return np.asarray(1 - np.sqrt(np.mean(a**2, axis=axis) / np.mean(b**2, axis=axis)))

    found = bootstrap(
        (before, after),
        reduction,
        paired=True,
        vectorized=True,
        n_resamples=999,
        method="percentile",
        rng=seed,
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
        noise=noise_model(drive, noise),
        effects=joined(model.effects, new),
    )


def joined(base: tuple[Effect, ...], new: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """The effects of both. Of two of a name, what acts throughout adds up, as it does in the filter; a new
    stiffness stands for the old one; what acts in a time or place stays by itself.
    """
    found, others = {effect.name: effect for effect in base}, []
    for effect in new:
        old = found.get(effect.name)
        if old is not None and effect.name in WEIGHTS:
            others.append(effect)
        elif old is None or effect.name == "undeclared_skid":
            found[effect.name] = effect
        else:
            sums = {key: combined(key, old.parameters.get(key), v) for key, v in effect.parameters.items()}
            found[effect.name] = replace(effect, parameters=sums)
    return (*found.values(), *others)

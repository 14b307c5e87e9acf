"""How a robot differs from one calibration log to another, which a fit of all logs together does not show.

Each log is fitted alone. Of sizes x_k with standard deviations s_k the moment estimate of the variance
between logs is τ² = max(0, var(x) − mean(s²)) (DerSimonian and Laird 1986); the parameters of another log lie
about the common fit with sd² + τ² (1 + 1/K). Few logs show few ways of driving: what scrubbing adds to the
track is held no better than its form is known. An effect that the base model does not hold lies about 0,
with the τ² of Σ x²/(s² + τ²) = K, or 0 (Paule and Mandel 1982): that is its misfit. One log may hardly show
it, another one well.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.wheel_speed.candidates import PLACES, candidates_of, parameters_of
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import Fit, inverse, refit
from wmr_replay.gap.wheel_speed.predict import DECLARED, Problem
from wmr_replay.gap.wheel_speed.scan import scan
from wmr_schemas.arrays import F64

LEAST_LOGS = 2
HALVINGS = 40
"""Of the interval that holds a variance between logs. Numerics: to a millionth of a millionth."""
SCRUB_SD = 0.06
"""Standard deviation of what scrubbing adds to the track, as a share, on another drive. Physics: another day
has another ground, load and pressure of the tyres. Judgement: up to .09 on 36 logs of strangers' skid-steered
and tracked robots with nothing hidden."""
SIDES_SD = 0.03
"""By how much of it the sides differ in turns to one side. Physics: as well as dry friction is known."""
TURNING_SD = 0.03
"""Standard deviation of the slip ahead in turns (``turning_slip``) on another drive, s/m, by the share that
scrubbing adds to the track. Judgement: MuJoCo's skid-steered robot, whose track is 2.2 times that of its
wheels, has .05 to .11 on four of 30 logs with nothing hidden."""
SCRUBS = 0.2
"""A robot of whose track scrubbing adds this share, or more, has the deviations of one that scrubs; of less,
in proportion. Judgement: strangers' tracks are wider by .01 without scrubbing, and by .2 to .75 with it."""
TURNING_SD_OF_ONE = 0.05
"""Standard deviation of the slip ahead in turns of a robot that scrubs, of a calibration on one log, s/m.
Judgement: 0 to .2 on 26 logs with nothing hidden; one robot has 0 on one drive and .15 on another."""
CREEP_SD_OF_ONE = 0.02
"""The same of the creep sideways (``lateral_slip``), s. Judgement: .03 to .08 on these, often with none
proven in the calibration."""
MOVES_SD_OF_ONE = 0.05
"""The same of how far the centre of rotation moves along the robot, in half-tracks. Judgement: up to .15, in
turns on the spot, where tyres creep least."""
CENTRE_SD = 0.01
"""Standard deviation of how far the centre of rotation moves along the robot from drive to drive, as a share
of the half-track: tyres creep sideways under what casters and pads do. Judgement: .011 on 56 logs of MuJoCo's
two-wheeled robots with nothing hidden, calibrated on another drive."""


def each_log(problem: Problem) -> list[Problem]:
    """The problem of each log alone."""
    log_of_bin = problem.record.log_of[problem.bins.stretch]
    return [replace(problem, fitted=problem.fitted & (log_of_bin == k)) for k in np.unique(log_of_bin)]


def fitted_alone(problem: Problem, fitted: Fit) -> list[tuple[Problem, Fit]]:
    """Each log with the common parameters fitted to it; none where there are too few logs."""
    alone = each_log(problem)
    if len(alone) < LEAST_LOGS:
        return []
    return [(one, refit(one, fitted.parameters, fitted.values, fitted.noises)) for one in alone]


def sd_of_another_log(
    problem: Problem, fitted: Fit, alone: list[tuple[Problem, Fit]], form_sd: float = 0.0
) -> F64:
    """Standard deviations (p,) of the parameters of another log about the common fit. One log does not show
    how far the centre of rotation moves. ``form_sd`` is what is not known of the track by the turn, a share.
    """
    scrubbing = of_scrubbing(problem, fitted, n_logs=max(len(alone), 1), form_sd=form_sd)
    scrub_sd = np.array([scrubbing.get(one.effect, 0.0) for one in fitted.parameters])
    if not alone:
        moves_m = CENTRE_SD * problem.chassis.half_track_m
        centre = np.array([moves_m * (one.effect == "icr_offset") for one in fitted.parameters])
        return np.asarray(np.sqrt(fitted.sd**2 + centre**2 + scrub_sd**2))
    sizes = np.stack([one.sizes for _, one in alone])
    own = np.stack([one.sd for _, one in alone])
    between = np.maximum(np.var(sizes, axis=0, ddof=1) - np.mean(own**2, axis=0), 0.0)
    return np.asarray(np.sqrt(fitted.sd**2 + between * (1 + 1 / len(alone)) + scrub_sd**2))


def misfit_between(problem: Problem, fitted: Fit, alone: list[tuple[Problem, Fit]]) -> dict[str, float]:
    """Sizes by effect that single logs show beside the base model, and what a robot that scrubs does; two
    components by their length.
    """
    sizes: dict[str, list[tuple[F64, F64]]] = {}
    for part, own in alone:
        wanted = tuple(one for one in candidates_of(part.record) if may_differ(one.name, own))
        for score in scan(part, own, wanted):
            size, variance = np.array(list(score.start.values())), np.diag(inverse(score.information))
            if np.all(variance > 0):
                sizes.setdefault(score.name, []).append((size, variance))
    found = {name: variance_between(*map(np.array, zip(*each, strict=True))) for name, each in sizes.items()}
    misfit = {name: float(np.sqrt(square)) for name, square in found.items() if square > 0}
    for name, least in of_scrubbing(problem, fitted, n_logs=max(len(alone), 1)).items():
        if least > 0 and name not in fitted.values:
            misfit[name] = max(misfit.get(name, 0.0), least)
    return misfit


def variance_between(sizes: F64, variances: F64) -> float:
    """τ² about 0 of sizes (K, k) of components that are known to ``variances`` (K, k), summed over the
    components.
    """
    low, high = np.zeros(sizes.shape[1]), np.square(sizes).max(axis=0)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        more = np.sum(sizes**2 / (variances + middle), axis=0) > len(sizes)
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return float(low.sum())


def of_scrubbing(problem: Problem, fitted: Fit, n_logs: int, form_sd: float = 0.0) -> dict[str, float]:
    """Standard deviations, by effect, of what scrubbing otherwise does on another drive."""
    wider = max(fitted.values.get("effective_track", {}).get("ratio", 0.0), 0.0)
    found = {
        "effective_track": float(np.hypot(SCRUB_SD * wider, form_sd * (1 + wider) * (wider > 0))),
        "pose_lever_arm": sides_apart_m(problem, fitted),
        "turning_slip": TURNING_SD * wider,
    }
    if n_logs >= LEAST_LOGS:
        return found
    scrubs = min(wider / SCRUBS, 1.0)
    return {
        **found,
        "icr_offset": MOVES_SD_OF_ONE * scrubs * problem.chassis.half_track_m,
        "lateral_slip": CREEP_SD_OF_ONE * scrubs,
        "turning_slip": TURNING_SD_OF_ONE * scrubs,
    }


def sides_apart_m(problem: Problem, own: Fit) -> float:
    """How far the centre of rotation moves sideways where scrubbing widens one side's half-track by
    ``SIDES_SD`` more than the other's, as it does in turns to one side: a lever arm is the same motion.
    """
    wider = max(own.values.get("effective_track", {}).get("ratio", 0.0), 0.0)
    return SIDES_SD * wider * problem.chassis.half_track_m


def may_differ(name: str, own: Fit) -> bool:
    """Whether an effect acts always, in proportion to its parameters, and is not held."""
    declared = DECLARED[name]
    lasting = declared.extent == "always" and declared.zero_is_absent and not declared.search.grid
    return lasting and name not in PLACES and name not in own.values


def misfit_sd(misfit: dict[str, float]) -> Values:
    """The misfit as standard deviations of each of an effect's parameters."""
    return {
        name: {one.key: size for one in parameters_of(name)}
        for name, size in misfit.items()
        if name in DECLARED and name not in PLACES
    }

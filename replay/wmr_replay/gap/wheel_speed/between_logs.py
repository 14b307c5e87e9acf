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
from wmr_replay.gap.wheel_speed.rolling import WIDE_TURNS
from wmr_replay.gap.wheel_speed.scan import scan
from wmr_schemas.arrays import F64

LEAST_LOGS = 2
HALVINGS = 40
"""Of the interval that holds a variance between logs. Numerics: to a millionth of a millionth."""
SCRUB_SD = 0.03
"""Standard deviation of what scrubbing adds to the track, as a share, on another drive. Physics: dry friction
has no track of its own; the form of slip in turns is known as well (``FORM_SD``)."""
SCRUB_SD_OF_ONE = 0.06
"""The same of a calibration on one log. Physics: another day has another ground, load and pressure of the
tyres. Judgement: a stranger's skid-steered and tracked robots, up to .09 on 18 logs with nothing hidden."""
SCRUB_SD_OF_A_FORM = 0.12
"""The same where one log does not show how it goes by the turn (``wide_turn_scrub``). Judgement: between the
widest turn and one on the spot it differs by a quarter to a half on these two."""
TURNING_SD = 0.03
"""Standard deviation of the slip ahead in turns (``turning_slip``) on another drive, s/m, by the share that
scrubbing adds to the track. Judgement: MuJoCo's skid-steered robot, whose track is 2.2 times that of its
wheels, has .05 to .11 on four of 30 logs with nothing hidden."""
TURNING_SD_OF_ONE = 0.15
"""The same of a calibration on one log. Judgement: strangers' four robots that scrub, of .2 to .47, slip by 0
to .2 s/m on 26 logs with nothing hidden, and one of them by 0 on one drive and by .15 on another."""
CREEP_SD_OF_ONE = 0.06
"""Standard deviation of the creep sideways (``lateral_slip``) on another drive, s, by that share, of a
calibration on one log. Judgement: tyres that scrub creep by .1 to .15 s of it, on these two robots."""
MOVES_SD_OF_ONE = 0.15
"""Standard deviation of how far the centre of rotation moves along the robot, in half-tracks, by that share,
of a calibration on one log. Judgement: .3 of it in turns on the spot, where tyres creep least, on the
skid-steered one."""
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


def sd_of_another_log(problem: Problem, fitted: Fit, alone: list[tuple[Problem, Fit]]) -> F64:
    """Standard deviations (p,) of the parameters of another log about the common fit. One log does not show
    how far the centre of rotation moves.
    """
    scrubbing = of_scrubbing(problem, fitted, n_logs=max(len(alone), 1))
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


def of_scrubbing(problem: Problem, fitted: Fit, n_logs: int) -> dict[str, float]:
    """Standard deviations, by effect, of what scrubbing otherwise does on another drive."""
    wider = max(fitted.values.get("effective_track", {}).get("ratio", 0.0), 0.0)
    found = {"pose_lever_arm": sides_apart_m(problem, fitted), "turning_slip": TURNING_SD * wider}
    if n_logs >= LEAST_LOGS:
        return {**found, "effective_track": SCRUB_SD * wider}
    by_turn = SCRUB_SD_OF_ONE if WIDE_TURNS in fitted.values else SCRUB_SD_OF_A_FORM
    return {
        **found,
        "effective_track": by_turn * wider,
        "icr_offset": MOVES_SD_OF_ONE * wider * problem.chassis.half_track_m,
        "lateral_slip": CREEP_SD_OF_ONE * wider,
        "turning_slip": TURNING_SD_OF_ONE * wider,
    }


def sides_apart_m(problem: Problem, own: Fit) -> float:
    """How far the centre of rotation moves sideways where scrubbing widens one side's half-track by
    ``SCRUB_SD`` more than the other's, as it does in turns to one side: a lever arm is the same motion.
    """
    wider = max(own.values.get("effective_track", {}).get("ratio", 0.0), 0.0)
    return SCRUB_SD * wider * problem.chassis.half_track_m


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

"""Calibrating the wheel-speed base: wheel scales, effective track, centre of rotation, pose delay, noise."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import problem_of
from wmr_replay.gap.wheel_speed.assemble import noise_model, odometry
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.between_logs import fitted_alone, misfit_between, sd_of_another_log
from wmr_replay.gap.wheel_speed.candidates import CALIBRATED, absent, parameters_of
from wmr_replay.gap.wheel_speed.estimate import Fit, fit
from wmr_replay.gap.wheel_speed.evidence import matters, p_value
from wmr_replay.gap.wheel_speed.modes import ideal_only
from wmr_replay.gap.wheel_speed.plausible import logs_apart
from wmr_replay.gap.wheel_speed.predict import DECLARED, Parameter, Problem
from wmr_replay.gap.wheel_speed.rolling import WIDE_TURNS
from wmr_replay.gap.wheel_speed.seen_slipping import slipping_left
from wmr_replay.gap.wheel_speed.select import base_fit, fitted_with
from wmr_replay.gap.wheel_speed.verdict import too_short_a_way
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log

OF_TYRES = ("lateral_slip", WIDE_TURNS)
"""How tyres creep sideways while they grip, and how what they scrub goes by the turn: with the calibrated
effects where a log proves it."""


class Calibration(NamedTuple):
    """The calibrated model, and remarks."""

    model: Model
    notes: tuple[str, ...]


def calibrate_wheel_speeds(
    logs: Sequence[Log], robot: RobotParameters, options: GapOptions | None = None
) -> Calibration:
    """The effects of :data:`CALIBRATED` on ``logs`` with standard deviations, the tyres' creep, and the
    odometry's error before and after, held out. Of several logs the deviations between them are part of the
    standard deviations, and what single logs show beside is the misfit. What the motion does not show is
    left out, with a note.

    Raises InvalidSignal where wheel speeds, lengths or driving are too few.
    """
    options = options or GapOptions()
    base = base_of(robot, None)
    problem = problem_of(logs, base, options, "wheel_speed")
    if reason := too_short_a_way(problem):
        raise InvalidSignal("wheel speed", reason)
    apart = logs_apart(problem)
    if options.modes == "identified":
        problem = ideal_only(problem, {})
    fitted, unseen = calibrated(problem)
    for name in OF_TYRES:
        fitted = with_tyres(problem, fitted, name)
    alone = fitted_alone(problem, fitted)
    sd = sd_of_another_log(problem, fitted, alone, form_left(problem, fitted))
    model = Model(
        robot=base.robot,
        noise=noise_model(problem, fitted),
        effects=tuple(
            effect_of(fitted, sd, name) for name in (*CALIBRATED, *OF_TYRES) if name in fitted.values
        ),
        odometry=odometry(problem, (base_fit(problem), fitted), options),
        misfit=misfit_between(problem, fitted, alone) | slipping_left(problem, fitted),
    )
    notes = (f"the driving does not show {name}; it is left out" for name in unseen)
    return Calibration(model, (*apart, *notes))


def calibrated(problem: Problem) -> tuple[Fit, tuple[str, ...]]:
    """The fit of what the motion shows, and what it does not: an sd beyond ``most_sd`` of a useful size."""
    names, unseen = list(CALIBRATED), list[str]()
    while names:
        parameters = tuple(one for name in names for one in parameters_of(name))
        fitted = fit(problem, parameters, {name: absent(name) for name in names})
        vague = {
            one.effect: float(sd) / (DECLARED[one.effect].relevant or 1.0)
            for one, sd in zip(parameters, fitted.sd, strict=True)
        }
        worst = max(vague, key=lambda name: vague[name])
        if np.isfinite(vague[worst]) and vague[worst] < problem.settings.gates.most_vague:
            return fitted, tuple(unseen)
        names.remove(worst)
        unseen.append(worst)
    raise InvalidSignal("wheel speed", "the driving shows neither the wheels' scale nor the track")


def with_tyres(problem: Problem, fitted: Fit, name: str) -> Fit:
    """The fit with an effect of the tyres, where the log proves one that matters: those of a skid-steered
    robot creep and scrub in every turn. Held in the base model it is no noise that drowns everything else,
    and no other track on another drive.
    """
    own = problem.settings.gates
    creeping = fitted_with(problem, fitted, name, {})
    if fitted.minus_two_log - creeping.minus_two_log < problem.settings.terms.least_better:
        return fitted
    proven = p_value(creeping, name, 1) < own.level and matters(creeping, name, (), own.least_relevant)
    return creeping if proven else fitted


def form_left(problem: Problem, fitted: Fit) -> float:
    """How far the track may differ by the turn, as a share, where the fit does not hold how it goes by it."""
    if WIDE_TURNS in fitted.values:
        return 0.0
    trial = fitted_with(problem, fitted, WIDE_TURNS, {})
    sd = float(trial.sd[trial.parameters.index(Parameter(WIDE_TURNS, "ratio"))])
    return float(np.hypot(trial.values[WIDE_TURNS]["ratio"], sd)) / 2


def effect_of(fitted: Fit, sd: F64, name: str) -> Effect:
    """An effect with its standard deviation, as a model file holds it."""
    mine = [
        (one.key, v, s)
        for one, v, s in zip(fitted.parameters, fitted.sizes, sd, strict=True)
        if one.effect == name
    ]
    return Effect(name, {key: float(v) for key, v, _ in mine}, {key: float(s) for key, _, s in mine})

"""Calibrating the base model on a log: α, yaw gain, stiffness and noise, with standard deviations."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.covariance import robust_covariance
from wmr_replay.gap.estimation.diffusion import fit_diffusion, noise_model
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, gauss_newton
from wmr_replay.gap.estimation.sticking import Sticking, rough_sticking, windows_of
from wmr_replay.gap.estimation.swing_disturbance import with_swings
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack

PARAMETERS = ("payload", "yaw_inertia", "cornering_stiffness")
"""Effects that stand for parameters of the robot."""
SWIVELS = "swivel_friction"
BY_WEIGHT = (("scrub_torque", "d0_mps2"), ("support_friction", "d0_mps2"))
"""Sizes that grow with the weight on the axle and fall with the yaw inertia."""
START_ALPHA = {"payload": {"mass_ratio": 0.0}, "yaw_inertia": {"ratio": 0.0}}
"""α and α_yaw are fitted as a payload and a yaw inertia, from none of either."""


class Calibration(NamedTuple):
    """The calibrated model, the last fit of its parameters on the log, every row fitted, and the robot that
    this fit started from.
    """

    model: Model
    problem: Problem
    fit: Fit
    start: RobotParameters

    @property
    def holding(self) -> Extension:
        """The calibrated model and what it holds, with nothing to be fitted."""
        return held_by(self.model.robot, self.fit.extension)


def calibrate(log: Log, robot: RobotParameters, options: GapOptions | None = None) -> Model:
    """``robot`` with the log's α, α_yaw and, where it skids for 3 s or more, G_x/ε; their standard
    deviations; the noise.

    Fits the same prediction errors as the gap analysis, over the whole log: α = α₀/(1 + p) and so on, with
    standard deviations by the delta method. Raises InvalidSignal where the torques do not move the robot, or
    without ``half_track_m``.
    """
    return calibrate_on_log(replace(log, robot=robot), options or GapOptions()).model


def calibrate_on_log(log: Log, options: GapOptions) -> Calibration:
    """See :func:`calibrate`; the log carries the robot."""
    robot = with_rough_alpha(log, options.gates)
    return in_rounds(log, robot, Extension(base_of(robot), {}, robot.wheel_radius_m or 1.0), options)


def sticking(rolling: Calibration, log: Log, options: GapOptions) -> Calibration | None:
    """The calibration with a dry friction that holds the robot in yaw; None where the log shows none."""
    start = rough_sticking(rolling.problem.binned, rolling.model.robot, options.gates.sticking)
    if start is None or not sticks(start, rolling):
        return None
    return in_rounds(log, start.robot, start.holding, options)


def swivelling(rolling: Calibration, log: Log, options: GapOptions) -> Calibration | None:
    """The calibration with casters whose swivels hold the direction of motion; None where none swings.

    As a column beside a model that knows none, that friction is hardly seen: it starts from a small one.
    """
    if not any(rolling.problem.settings.diffusion.swings):
        return None
    robot, s0 = rolling.model.robot, options.gates.sticking.swivels_mps2
    known = ((SWIVELS, {"s0_mps2": s0}),)
    return in_rounds(log, robot, Extension(base_of(robot), {}, robot.wheel_radius_m or 1.0, known), options)


def in_rounds(log: Log, robot: RobotParameters, holding: Extension, options: GapOptions) -> Calibration:
    """The modes identified and the parameters fitted in turns, with the effects that ``holding`` has."""
    noise, start = None, robot
    for _ in range(options.gates.calibration.rounds):
        track = modes_for(log, robot, holding, options)
        problem = Problem.of(bin_log(log, options.gates, track)).all_fitted()
        unfitted = beside(to_calibrate(problem, robot), holding)
        options = replace(options, gates=with_swings(problem, unfitted))
        problem = problem.under(options.gates)
        noise, fit = fit_parameters(problem, unfitted, noise)
        start = robot
        robot, sd = calibrated(start, problem, fit)
        holding = held_by(robot, fit.extension)
    held = fit.extension.with_forms(tuple(Effect(name, dict(size)) for name, size in holding.known))
    known = noise_model(problem.binned, fit.noise)
    model = Model(robot=robot, robot_sd=sd, noise=known, effects=held)
    return Calibration(model, problem, fit, start)


def beside(unfitted: Extension, holding: Extension) -> Extension:
    """What is to be fitted, with the effects that ``holding`` has: these are fitted, too."""
    return replace(unfitted, effects={**unfitted.effects, **dict(holding.known)}).as_in(holding)


def held_by(robot: RobotParameters, fitted: Extension) -> Extension:
    """A calibrated robot with what was fitted beside its parameters."""
    held = beside_parameters(fitted)
    return Extension(base_of(robot), {}, robot.wheel_radius_m or 1.0, tuple(held.items())).as_in(fitted)


def sticks(start: Sticking, rolling: Calibration) -> bool:
    """Whether friction that holds the robot in yaw makes the log surely likelier than none."""
    problem = rolling.problem
    unfitted = beside(to_calibrate(problem, start.robot), start.holding)
    _, fit = fit_parameters(problem, unfitted, None)
    return bool(rolling.fit.deviance - fit.deviance > problem.settings.sticking.least_gain)


def modes_for(log: Log, robot: RobotParameters, holding: Extension, options: GapOptions) -> ModeTrack | None:
    """The modes that the options ask for; None for ideal rolling throughout."""
    if options.modes == "identified":
        log, model = replace(log, robot=robot), replace(holding, base=base_of(robot))
        return likely_modes(log, model, options.gates, nothing_missing=True)
    return log.mode if options.modes == "given" else None


def to_calibrate(problem: Problem, robot: RobotParameters) -> Extension:
    """The base model with the effects that stand for the parameters to be fitted."""
    binned, effects = problem.binned, dict(START_ALPHA)
    skidding_s = float(binned.step_s[binned.mode == ContactMode.SKIDDING].sum())
    known = robot.cornering_stiffness_over_epsilon is not None and robot.mass_kg is not None
    if known and skidding_s >= problem.settings.calibration.least_skid_s:
        effects["cornering_stiffness"] = {"ratio": 0.0}
    return Extension(base_of(robot), effects, robot.wheel_radius_m or 1.0)


def fit_parameters(problem: Problem, extension: Extension, noise: Diffusion | None) -> tuple[Diffusion, Fit]:
    """Diffusion and parameters in turns, twice."""
    iterations = problem.settings.calibration.iterations
    noise = fit_diffusion(problem, extension, noise, iterations)
    extension = gauss_newton(problem, extension, noise, iterations).extension
    noise = fit_diffusion(problem, extension, noise, iterations)
    return noise, gauss_newton(problem, extension, noise, iterations)


def calibrated(
    robot: RobotParameters, problem: Problem, fit: Fit
) -> tuple[RobotParameters, dict[str, float]]:
    """The robot with the fitted ratios applied, and the standard deviations by the delta method; none of what
    the log does not move.
    """
    spread = np.sqrt(np.diag(robust_covariance(problem, fit)[0]))
    sds = {name: s for (name, _), s in zip(fit.keys, spread, strict=True)}
    extension = fit.extension
    ahead, turning = fitted_ratios(extension)
    alpha, alpha_yaw = extension.base.alpha / ahead, extension.base.alpha_yaw / turning
    sd = {"alpha": alpha * sds["payload"] / ahead, "alpha_yaw": alpha_yaw * sds["yaw_inertia"] / turning}
    changed = replace(robot, alpha=alpha, alpha_yaw=alpha_yaw)
    if (inertia_kgm2 := inertia_of(robot, alpha_yaw)) is not None:
        changed = replace(changed, yaw_inertia_kgm2=inertia_kgm2)
        sd["yaw_inertia_kgm2"] = inertia_kgm2 * sds["yaw_inertia"] / turning
    before = robot.cornering_stiffness_over_epsilon
    if "cornering_stiffness" in extension.effects and before is not None:
        ratio = extension.effects["cornering_stiffness"]["ratio"]
        changed = replace(changed, cornering_stiffness_over_epsilon=before * (1 + ratio))
        sd["cornering_stiffness_over_epsilon"] = before * sds["cornering_stiffness"]
    return changed, {key: float(value) for key, value in sd.items() if value > 0}


def inertia_of(robot: RobotParameters, alpha_yaw: float) -> float | None:
    """The yaw inertia about the axle that α_yaw says in place of a stated one, l²/(r α_yaw), drives included;
    None where none is stated, or without the wheels' radius.

    A data sheet's may be about the centre of mass, and knows nothing of gears; what a centre of mass ahead of
    the axle turns goes by it.
    """
    if robot.yaw_inertia_kgm2 is None or robot.wheel_radius_m is None or robot.half_track_m is None:
        return None
    return robot.half_track_m**2 / (robot.wheel_radius_m * alpha_yaw)


def beside_parameters(fitted: Extension) -> dict[str, dict[str, float]]:
    """What was fitted beside the robot's parameters, as it is with these.

    A payload and a yaw inertia, which become α and α_yaw, had changed what the weight on tyres and supports
    turns.
    """
    ahead, turning = fitted_ratios(fitted)
    held = {name: dict(size) for name, size in fitted.effects.items() if name not in PARAMETERS}
    for name, key in BY_WEIGHT:
        if name in held:
            held[name][key] *= ahead / turning
    return held


def fitted_ratios(extension: Extension) -> tuple[float, float]:
    """By how much mass and yaw inertia are larger than where the fit started."""
    effects = extension.effects
    return 1 + effects["payload"]["mass_ratio"], 1 + effects["yaw_inertia"]["ratio"]


def with_rough_alpha(log: Log, settings: GateSettings) -> RobotParameters:
    """The log's robot with a first α and α_yaw where they are unknown.

    The slope of the speed's change over 0.5 s against the mean of the torques. Raises InvalidSignal without
    ``half_track_m``, and where the slope is not positive.
    """
    robot = log.robot
    if robot.half_track_m is None:
        raise InvalidSignal("robot", "half_track_m is needed to calibrate a base model")
    if robot.alpha is not None:
        return robot
    windows = windows_of(bin_log(log, settings), robot, settings.calibration.rough_s)
    ahead = slope(windows.left_nm + windows.right_nm, windows.v_change_mps2)
    turning = slope(windows.right_nm - windows.left_nm, windows.w_change_mps2)
    if not ahead > 0:
        raise InvalidSignal(
            "torque", "does not move the robot as a driven wheel would: check signs and --map"
        )
    return replace(robot, alpha=ahead, alpha_yaw=turning if turning > 0 else ahead)


def slope(x: F64, y: F64) -> float:
    """Slope of the line of least squares through (x, y), (n,) each; 0 where x does not vary."""
    varied = x - x.mean()
    return float(varied @ y / max(float(varied @ varied), np.finfo(float).tiny))

"""Calibrating the base model on a log: α, yaw gain, stiffness and noise, with intervals."""

from dataclasses import replace

import numpy as np
from scipy.stats import linregress

from wmr_replay.gap.estimation.binned_log import drive_of
from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.estimation.modes import identified_modes
from wmr_replay.gap.estimation.problem import Problem, fit_noise, noise_model
from wmr_replay.gap.estimation.refit import gauss_newton
from wmr_replay.gap.evidence.significance import covariance
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log

ROUGH_S = 0.5
SKID_SECONDS = 3.0
ROUNDS = 3
START_ALPHA = {"payload": {"mass_ratio": 0.0}, "yaw_inertia": {"ratio": 0.0}}


def calibrate(log: Log, robot: RobotParameters, options: GapOptions | None = None) -> Model:
    """``robot`` with what the log says of α, α_yaw and, where it skids for 3 s or more, G_x/ε; their standard
    deviations; the noise.

    The same prediction errors as in the gap analysis, over the whole log; α = α₀/(1 + p) and so on, the
    standard deviations by the delta method. Raises InvalidSignal where the torques do not move the robot.
    """
    options = options or GapOptions()
    known = replace(log, robot=robot)
    return calibrate_on_log(known, options)


def calibrate_on_log(log: Log, options: GapOptions) -> Model:
    """See :func:`calibrate`; the log carries the robot."""
    robot = with_rough_start(log)
    noise: Diffusion | None = None
    sd: dict[str, float] = {}
    for _ in range(ROUNDS):
        track = log.mode if options.modes == "given" else None
        if options.modes == "identified":
            track = identified_modes(replace(log, robot=robot), Extension(base_of(robot)))
        drive = drive_of(log, track)
        problem = replace(Problem.of(drive), train=np.ones(len(drive), bool))
        skids = float(drive.step_s[drive.mode == 1].sum()) >= SKID_SECONDS
        effects = dict(START_ALPHA)
        if skids and robot.cornering_stiffness_over_epsilon is not None and robot.mass_kg is not None:
            effects["cornering_stiffness"] = {"ratio": 0.0}
        extension = Extension(base_of(robot), effects, robot.wheel_radius_m or 1.0)
        noise, _ = fit_noise(problem, extension, noise, 6)
        extension = gauss_newton(problem, extension, noise, 6).extension
        noise, _ = fit_noise(problem, extension, noise, 6)
        fit = gauss_newton(problem, extension, noise, 6)
        spread = np.sqrt(np.diag(covariance(problem, fit)[0]))
        sds = {name: s for (name, _), s in zip(fit.keys, spread, strict=True)}
        robot, sd = calibrated(robot, fit.extension, sds)
    assert noise is not None
    return Model(robot=robot, robot_sd=sd, noise=noise_model(drive, noise))


def calibrated(
    robot: RobotParameters, extension: Extension, sds: dict[str, float]
) -> tuple[RobotParameters, dict[str, float]]:
    """The robot with the fitted ratios applied, and standard deviations."""
    ahead = 1 + extension.effects["payload"]["mass_ratio"]
    turning = 1 + extension.effects["yaw_inertia"]["ratio"]
    alpha, alpha_yaw = extension.base.alpha / ahead, extension.base.alpha_yaw / turning
    changed = replace(robot, alpha=alpha, alpha_yaw=alpha_yaw)
    sd = {"alpha": alpha * sds["payload"] / ahead, "alpha_yaw": alpha_yaw * sds["yaw_inertia"] / turning}
    if "cornering_stiffness" in extension.effects:
        ratio = extension.effects["cornering_stiffness"]["ratio"]
        before = robot.cornering_stiffness_over_epsilon or 0.0
        changed = replace(changed, cornering_stiffness_over_epsilon=before * (1 + ratio))
        sd["cornering_stiffness_over_epsilon"] = before * sds["cornering_stiffness"]
    return changed, {key: float(value) for key, value in sd.items()}


def with_rough_start(log: Log) -> RobotParameters:
    """α and α_yaw to begin with, where they are unknown: the slope of speed changes over half a second
    against the torques' mean.
    """
    robot = log.robot
    if robot.half_track_m is None:
        raise InvalidSignal("robot", "half_track_m is needed to calibrate a base model")
    if robot.alpha is not None:
        return robot
    drive = drive_of(log)
    every = max(2, round(ROUGH_S / float(np.median(drive.step_s[1:]))))
    t_s, pose = drive.t_s[::every], drive.pose[::every]
    effort = drive.torque.means(t_s, Extension(base_of(replace(robot, alpha=1.0))).input_effects())
    middle = (pose[1:, 2] + pose[:-1, 2]) / 2
    moved = np.diff(pose, axis=0) / np.diff(t_s)[:, None]
    speed = moved[:, 0] * np.cos(middle) + moved[:, 1] * np.sin(middle)
    between = (effort[:, 1:-1] + effort[:, 2:]) / 2
    step_s = np.diff((t_s[1:] + t_s[:-1]) / 2)
    ahead = linregress(between.sum(axis=0), np.diff(speed) / step_s).slope
    turning = linregress(between[1] - between[0], robot.half_track_m * np.diff(moved[:, 2]) / step_s).slope
    if not ahead > 0:
        raise InvalidSignal(
            "torque", "does not move the robot as a driven wheel would: check signs and --map"
        )
    return replace(robot, alpha=float(ahead), alpha_yaw=float(turning) if turning > 0 else float(ahead))

"""Dry friction that holds a robot in yaw while its torques try to turn it: wide tyres, skids under load.

A tyre of some width grips along a line, which must slide before the robot turns. Up to there the torques of a
controller grow and nothing turns, so that a fit that knows no friction finds an α_yaw far too small, and a
friction beside that α_yaw one far too small. Both together are found where the robot does turn, by least
squares over short windows:

    l·Δyaw_rate/Δt = α_yaw·(τ_R − τ_L) − d₀ sgn(yaw_rate) − c·v·yaw_rate
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.effects.efforts import InputEffects
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings.filter import StickingSettings
from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

SCRUB = "scrub_torque"


class Windows(NamedTuple):
    """Short windows of a log (m,): speed ahead v and l·yaw_rate [m/s], means over each; how fast they change
    [m/s²]; and the mean torque of the left and of the right wheel [N·m].
    """

    v_mps: F64
    w_mps: F64
    v_change_mps2: F64
    w_change_mps2: F64
    left_nm: F64
    right_nm: F64


class Sticking(NamedTuple):
    """Where a calibration starts from: a robot, and a model of it that holds a friction in yaw."""

    robot: RobotParameters
    holding: Extension


def rough_sticking(binned: BinnedLog, robot: RobotParameters, own: StickingSettings) -> Sticking | None:
    """With the α_yaw and d₀ of the windows in which the robot turns; None where too few do, or either is too
    small.
    """
    windows = windows_of(binned, robot, own.window_s)
    turns = np.abs(windows.w_mps) > own.turning_mps
    if turns.sum() < own.least_windows:
        return None
    v, w, _, change, left, right = (column[turns] for column in windows)
    columns = np.stack([right - left, -np.sign(w), -v * w], axis=1)
    (alpha_yaw, d0, _), *_ = np.linalg.lstsq(columns, change, rcond=None)
    if not (alpha_yaw > 0 and d0 > own.least_mps2):
        return None
    robot = replace(robot, alpha_yaw=float(alpha_yaw))
    known = ((SCRUB, {"d0_mps2": float(d0)}),)
    radius_m = robot.wheel_radius_m or 1.0
    return Sticking(
        robot, Extension(base_of(robot), {}, radius_m, known, friction_speed_mps=own.sign_change_mps)
    )


def windows_of(binned: BinnedLog, robot: RobotParameters, window_s: float) -> Windows:
    """Windows of ``window_s`` of the binned log."""
    every = max(2, round(window_s / float(np.median(binned.step_s[1:]))))
    t_s, pose = binned.t_s[::every], binned.pose[::every]
    left, right = binned.torque.means(t_s, InputEffects())
    moved = np.diff(pose, axis=0) / np.diff(t_s)[:, None]
    middle = (pose[1:, 2] + pose[:-1, 2]) / 2
    v = moved[:, 0] * np.cos(middle) + moved[:, 1] * np.sin(middle)
    w = (robot.half_track_m or 0.0) * moved[:, 2]
    step_s = np.diff((t_s[1:] + t_s[:-1]) / 2)
    v_mean, w_mean = ((one[1:] + one[:-1]) / 2 for one in (v, w))
    left_nm, right_nm = ((one[1:-1] + one[2:]) / 2 for one in (left, right))
    return Windows(v_mean, w_mean, np.diff(v) / step_s, np.diff(w) / step_s, left_nm, right_nm)

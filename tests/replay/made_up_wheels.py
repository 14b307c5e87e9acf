"""Drives of a robot by wheel speeds, integrated step by step at 1 ms: an oracle that shares no code with the
analysis.
"""

from collections.abc import Callable, Mapping

import numpy as np

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import CommandTrack, Log, PoseTrack, WheelSpeedTrack

RADIUS_M, HALF_TRACK_M, STEP_S = 0.1, 0.25, 1e-3
LEAD_S = 0.5
"""The wheels turn before the first pose, from which times of effects count."""
ROBOT = RobotParameters(wheel_radius_m=RADIUS_M, half_track_m=HALF_TRACK_M)
Parameters = Mapping[str, Mapping[str, float]]


def reference(t_s, seed):
    """Smooth speeds of the wheels' rims: sums of slow sines."""
    rng = np.random.default_rng(seed)

    def wave(size):
        phase, period = rng.uniform(0, 2 * np.pi, 4), rng.uniform(3.0, 11.0, 4)
        return size * np.sin(2 * np.pi * t_s[:, None] / period + phase).sum(axis=1) / 2

    v, w = 0.5 + wave(0.6), wave(0.8)
    return np.stack([v - HALF_TRACK_M * w, v + HALF_TRACK_M * w]) / RADIUS_M


def of(effects: Parameters, name: str, key: str) -> float:
    """A parameter, 0 where the effect is absent."""
    return effects.get(name, {}).get(key, 0.0)


def motion(t_s, wheels, effects: Parameters):
    """Poses (n, 3) of the axle's middle by Euler's rule, at the times ``t_s`` of the wheels (2, n)."""
    scale, apart = of(effects, "wheel_scale", "ratio"), of(effects, "wheel_scale_difference", "ratio")
    left = RADIUS_M * wheels[0] * (1 + scale) * (1 - apart)
    right = RADIUS_M * wheels[1] * (1 + scale) * (1 + apart)
    if "slip_interval" in effects:
        p = effects["slip_interval"]
        since_s = t_s - LEAD_S
        lost = np.where((since_s >= p["start_s"]) & (since_s < p["end_s"]), 1 - p["loss"], 1.0)
        left, right = left * lost, right * lost
    w, v = (right - left) / 2, (right + left) / 2
    wide = np.abs(v) / np.maximum(np.abs(v) + 3 * np.abs(w), 1e-9)
    w = w / (1 + of(effects, "wide_turn_scrub", "ratio") * (wide - 0.5))
    w = w / (HALF_TRACK_M * (1 + of(effects, "effective_track", "ratio")))
    v = v * (1 - of(effects, "turning_slip", "s_per_m") * np.abs(w) * HALF_TRACK_M)
    v = v - of(effects, "slip_ratio", "seconds") * np.gradient(v, STEP_S)
    lat = -of(effects, "icr_offset", "offset_m") * w - of(effects, "lateral_slip", "seconds") * v * w
    drift = of(effects, "slope_slip", "x_mps"), of(effects, "slope_slip", "y_mps")
    yaw = np.concatenate([[0.0], np.cumsum(w[:-1])]) * STEP_S
    x = np.cumsum((v * np.cos(yaw) - lat * np.sin(yaw) + drift[0]) * STEP_S)
    y = np.cumsum((v * np.sin(yaw) + lat * np.cos(yaw) + drift[1]) * STEP_S)
    return np.column_stack([x, y, yaw])


def seen(t_s, poses, effects: Parameters, at_s):
    """What a pose sensor says at the times ``at_s``."""
    late = at_s - of(effects, "pose_delay", "delay_s")
    x, y, yaw = (np.interp(late, t_s, column) for column in poses.T)
    a, b = of(effects, "pose_lever_arm", "x_m"), of(effects, "pose_lever_arm", "y_m")
    x, y = x + np.cos(yaw) * a - np.sin(yaw) * b, y + np.sin(yaw) * a + np.cos(yaw) * b
    turned = of(effects, "heading_misalignment", "angle_rad")
    turned = turned + of(effects, "yaw_drift", "rate_radps") * (at_s - LEAD_S)
    return np.column_stack([x, y, yaw + turned])


def drive(
    effects: Parameters,
    *,
    seconds: float = 60.0,
    noise: tuple[float, float] = (0.0, 0.0),
    seed: int = 0,
    spin: Callable | None = None,
    lag_s: float = 0.0,
) -> Log:
    """A log of poses at 50 Hz and wheel speeds at 100 Hz: the mean since the one before, as of encoders.

    ``spin(t_s)`` is added to what the encoders say of the right wheel, rad/s: it spins and does not drive.
    With ``lag_s`` the reference is the command, held for 50 ms, and the wheels follow it.
    """
    t_s = np.arange(0, seconds, STEP_S)
    wheels = wanted = reference(t_s, seed)
    if lag_s:
        wanted = wheels[:, (np.arange(len(t_s)) // 50) * 50]
        wheels = np.empty_like(wanted)
        at = wanted[:, 0]
        for k in range(len(t_s)):
            wheels[:, k] = at
            at = at + (wanted[:, k] - at) * STEP_S / lag_s
    poses = motion(t_s, wheels, effects)
    at_s = np.arange(LEAD_S, seconds - 0.5, 0.02)
    rng = np.random.default_rng(seed + 1)
    pose = seen(t_s, poses, effects, at_s)
    pose = pose + rng.normal(0, 1, (len(at_s), 3)) * [noise[0], noise[0], noise[1]]
    said = wheels.copy()
    if spin is not None:
        said[1] += spin(t_s)
    angle = np.concatenate([np.zeros((2, 1)), np.cumsum(said, axis=1) * STEP_S], axis=1)
    rows = np.arange(10, len(t_s), 10)
    speeds = (angle[:, rows] - angle[:, rows - 10]) / (10 * STEP_S)
    wheel_ns = np.round(rows * STEP_S * NS_PER_S).astype(np.int64)
    command_ns = np.round(t_s[::50] * NS_PER_S).astype(np.int64)
    commands = CommandTrack(command_ns, *np.ascontiguousarray(wanted[:, ::50])) if lag_s else None
    return Log(
        PoseTrack(np.round(at_s * NS_PER_S).astype(np.int64), *np.ascontiguousarray(pose.T)),
        robot=ROBOT,
        wheels=WheelSpeedTrack(wheel_ns, *np.ascontiguousarray(speeds)),
        commands=commands,
    )

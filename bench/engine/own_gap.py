"""The engine's own gap to a motion: how far it ends from it when it replays the torques."""

import mujoco
import numpy as np

from engine.drive import RATE_HZ, SETTLE_S, Motion, Plant
from engine.effects import Hidden

WINDOW_S = 4.0
BEFORE_S = 0.5
"""Torques that a motor with memory has seen before a window."""


def own_gap_m(spec: mujoco.MjSpec, motion: Motion, window_s: float = WINDOW_S) -> float:
    """Root mean square of the position's error at the end of windows, each from the motion at its start.

    The motion is that of the axle's middle, from which the windows start, and of the site ``pose``.
    """
    plant = Plant(Hidden(spec, {}))
    for _ in range(round(SETTLE_S * RATE_HZ)):
        plant.step(0.0, 0.0)
    settled, steps, before = plant.data.qpos.copy(), round(window_s * RATE_HZ), round(BEFORE_S * RATE_HZ)
    errors = []
    for start in range(before, len(motion.t_s) - steps, steps):
        for row in range(start - before, start):
            plant.step(float(motion.left_nm[row]), float(motion.right_nm[row]))
        placed(plant, settled, motion, start)
        for row in range(start, start + steps):
            plant.step(float(motion.left_nm[row]), float(motion.right_nm[row]))
        x, y, _ = plant.pose()
        errors.append(np.hypot(x - motion.x_m[start + steps], y - motion.y_m[start + steps]))
    return float(np.sqrt(np.mean(np.square(errors))))


def placed(plant: Plant, settled: np.ndarray, motion: Motion, row: int) -> None:
    """Put the plant where the motion is, at its speeds, the suspension at rest."""
    data, yaw = plant.data, motion.yaw_rad[row]
    data.qpos[:], data.qvel[:] = settled, 0.0
    data.qpos[:2] = motion.x_m[row], motion.y_m[row]
    data.qpos[3:7] = np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)
    ahead, left = motion.v_long_mps[row], motion.v_lat_mps[row]
    data.qvel[:2] = (
        ahead * np.cos(yaw) - left * np.sin(yaw),
        ahead * np.sin(yaw) + left * np.cos(yaw),
    )
    data.qvel[5] = motion.yaw_rate_radps[row]
    data.qvel[plant.wheels] = motion.left_radps[row], motion.right_radps[row]
    plant.forward()

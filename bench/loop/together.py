"""Pairs of logs with torques and wheel speeds, whose hidden resistance stands in the recorded torques.

A robot with a resistance moves as one without it whose torques are smaller by what the resistance takes. So
the torques of a simulated log are raised by just that, and the log is one of a robot with the resistance.
"""

from dataclasses import replace

import numpy as np
from encoder_modes import true_modes
from encoders.logs import made
from encoders.split import part

from loop.pair import Pair
from wmr_replay.gap import GapOptions, analyse
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log
from wmr_synth import SimulatedLog

SIZES = {
    "rolling_resistance": {"c0_mps2": 0.2},
    "viscous_drag": {"c1_per_s": 0.2},
    "aerodynamic_drag": {"c2_per_m": 0.2},
    "scrub_torque": {"d0_mps2": 0.15},
    "yaw_damping": {"d1_per_s": 0.6},
    "slope": {"grade_x_mps2": 0.3, "grade_y_mps2": -0.2},
}
EFFECTS = tuple(SIZES)
LATER = 4_000
SOFT_MPS = 0.02


def pair(split: str, effect: str, noise: str, seed: int, cell: int, seconds: tuple[float, float]) -> Pair:
    """Two drives of a robot by two families of a part of the split, on wet and icy ground."""
    families = part(split).families
    chassis = ("differential", "skid-steer")[cell % 2]
    logs = [
        made(
            families[(cell + k) % len(families)],
            chassis,
            noise,
            seed,
            torques="together",
            duration_s=seconds[k],
            calibrated=True,
        )
        for k in range(2)
    ]
    sizes = SIZES.get(effect, {})
    first, other = (raised(simulated, effect, sizes) for simulated in logs)
    base = Model(robot=logs[0].log.robot)
    true = replace(base, effects=(Effect(effect, sizes),)) if effect else base
    t_s = (other.pose.t_ns - other.pose.t_ns[0]) / NS_PER_S
    return Pair(
        replace(first, mode=None),
        replace(other, mode=None),
        base,
        true,
        true_modes(logs[1]),
        t_s,
        "auto",
        lambda log, model: analyse(log, model, GapOptions(modes="identified")),
    )


def raised(simulated: SimulatedLog, effect: str, sizes: dict[str, float]) -> Log:
    """The log with the torques of a robot that has the resistance."""
    log, truth = simulated.log, simulated.truth
    t_ns = log.torque.t_ns

    def at(column: F64) -> F64:
        return np.interp(t_ns, truth.t_ns + (log.pose.t_ns[0] - truth.t_ns[0]), column)

    v, w = at(truth.v_long_mps), at(truth.yaw_rate_radps) * log.robot.half_track_m
    yaw, none = at(np.unwrap(truth.yaw_rad)), np.zeros(len(t_ns))
    ahead, turning = {
        "rolling_resistance": lambda c0_mps2: (c0_mps2 * np.tanh(v / SOFT_MPS), none),
        "viscous_drag": lambda c1_per_s: (c1_per_s * v, none),
        "aerodynamic_drag": lambda c2_per_m: (c2_per_m * v * np.abs(v), none),
        "scrub_torque": lambda d0_mps2: (none, d0_mps2 * np.tanh(w / SOFT_MPS)),
        "yaw_damping": lambda d1_per_s: (none, d1_per_s * w),
        "slope": lambda grade_x_mps2, grade_y_mps2: (
            -grade_x_mps2 * np.cos(yaw) - grade_y_mps2 * np.sin(yaw),
            none,
        ),
        "": lambda: (none, none),
    }[effect](**sizes)
    mean, half = ahead / (2 * log.robot.alpha), turning / (2 * log.robot.alpha_yaw_or_alpha)
    torque = replace(
        log.torque, left_nm=log.torque.left_nm + mean - half, right_nm=log.torque.right_nm + mean + half
    )
    return replace(log, torque=torque)

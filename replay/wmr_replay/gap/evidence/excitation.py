"""Excitation gate: do the torques vary enough for a verdict?

Under feedback, torques that hardly vary answer the disturbance, and any effect on the inputs may seem to
explain it. So the acceleration that the torques command must vary by several times the remaining disturbance.
"""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.candidates import declaration_of
from wmr_replay.gap.model.dynamics import Row
from wmr_replay.gap.model.extension import Extension

DEAD_ZONE = "torque_deadzone"


def excitation_ratios(problem: Problem, extension: Extension, noise: Diffusion) -> tuple[float, float]:
    """Standard deviation of α Σu over the disturbance's ahead, and of α_yaw Δu over that in yaw."""
    rows, base = extension.rows(problem.binned)[problem.train], extension.base
    ahead = base.alpha * float(np.std(rows[:, Row.RIGHT] + rows[:, Row.LEFT]))
    turning = base.alpha_yaw * float(np.std(rows[:, Row.RIGHT] - rows[:, Row.LEFT]))
    return ahead / noise.long_sd_mps2, turning / noise.yaw_sd_mps2


def answers_disturbance(name: str, problem: Problem, extension: Extension, noise: Diffusion) -> bool:
    """Whether an effect on small efforts acts on no others than those that answer the disturbance.

    A controller compensates a disturbance by efforts of its size. They move nothing, and so a dead zone of
    that size seems to hold them back.
    """
    width_nm = extension.effects[name].get("threshold_nm") if name == DEAD_ZONE else None
    if width_nm is None:
        return False
    base, least = extension.base, problem.settings.excitation.least_ratio
    ahead, turning = 2 * base.alpha * width_nm, 2 * base.alpha_yaw * width_nm
    return min(ahead / noise.long_sd_mps2, turning / noise.yaw_sd_mps2) < least


def too_calm_for(name: str, problem: Problem, extension: Extension, noise: Diffusion) -> str:
    """Why the log cannot carry the verdict ``name``; empty where it can.

    An effect on both channels needs one channel in full and two thirds of the other.
    """
    declaration = declaration_of(name)
    if not declaration.needs_excitation:
        return ""
    own = problem.settings.excitation
    ahead, turning = excitation_ratios(problem, extension, noise)
    channel = declaration.channel
    by_channel = {"longitudinal": ahead, "yaw": turning, "lateral": turning, "measurement": turning}
    ratio = by_channel.get(channel, min(ahead, turning))
    both = channel not in by_channel and max(ahead, turning) >= own.least_ratio
    needed = own.least_other_ratio if both else own.least_ratio
    if ratio >= needed:
        return ""
    what = "longitudinal acceleration" if ratio == ahead else "turning"
    return (
        f"{name} would explain part of it, but the {what} that the torques ask for varies by only "
        f"{ratio:.1f} times the disturbance (at least {needed:g} are needed)"
    )

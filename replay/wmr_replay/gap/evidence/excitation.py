"""Whether the drive was lively enough for a verdict.

Where torques hardly change but to answer the disturbance, a feedback controller makes them depend on it, and
any effect on the inputs may seem to explain it. So the acceleration that the torques ask for must vary by
several times the disturbance that remains.
"""

import numpy as np

from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.candidates import declaration_of
from wmr_replay.gap.model.dynamics import Row
from wmr_replay.gap.model.extension import Extension

LEAST_RATIO, LEAST_OF_THE_OTHER = 3.0, 2.0


def liveliness(problem: Problem, extension: Extension, noise: Diffusion) -> tuple[float, float]:
    """Standard deviation of α Σu over the disturbance's, and of α_yaw Δu over its own."""
    rows, base = extension.rows(problem.drive)[problem.train], extension.base
    ahead = base.alpha * float(np.std(rows[:, Row.RIGHT] + rows[:, Row.LEFT]))
    turning = base.alpha_yaw * float(np.std(rows[:, Row.RIGHT] - rows[:, Row.LEFT]))
    return ahead / noise.long_sd_mps2, turning / noise.yaw_sd_mps2


def too_calm_for(name: str, problem: Problem, extension: Extension, noise: Diffusion) -> str:
    """Why the log cannot carry the verdict ``name``; empty where it can. What acts on both channels asks for
    one in full and for two thirds of the other.
    """
    declaration = declaration_of(name)
    if not declaration.needs_excitation:
        return ""
    ahead, turning = liveliness(problem, extension, noise)
    channel = declaration.channel
    asked = {"longitudinal": ahead, "yaw": turning, "lateral": turning, "measurement": turning}
    ratio = asked.get(channel, min(ahead, turning))
    both = channel not in asked and max(ahead, turning) >= LEAST_RATIO
    needed = LEAST_OF_THE_OTHER if both else LEAST_RATIO
    if ratio >= needed:
        return ""
    what = "longitudinal acceleration" if ratio == ahead else "turning"
    return (
        f"{name} would explain part of it, but the {what} that the torques ask for varies by only "
        f"{ratio:.1f} times the disturbance (at least {needed:g} are needed)"
    )

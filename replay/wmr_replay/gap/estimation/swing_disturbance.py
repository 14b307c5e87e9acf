"""The disturbance while swivel casters may be swinging round, as a calibration log shows it.

A caster that swings pushes the robot aside for some tenths of a second, by as much as the torques turn it.
One level of disturbance for the whole drive would drown what the torques do everywhere else, and the torques
of a controller answer the pushes, so that α_yaw is found too small. So v_long and w walk at random in those
steps by q w m/s per √s, w the share of :mod:`wmr_replay.gap.model.caster_swings`, q one number ahead and one
in yaw. They belong to the robot: a log that is analysed has those of its base model.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.caster_swings import swings
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.model_file import NoiseModel


def with_swings(problem: Problem, extension: Extension) -> GateSettings:
    """The problem's settings with the q of the greatest likelihood; with 0 where that gains too little."""
    settings, own = problem.settings, problem.settings.swing
    calm = problem.under(replace(settings, diffusion=settings.diffusion.with_swings((0.0, 0.0))))
    free = problem.under(replace(settings, diffusion=settings.diffusion.with_free_swings(own)))
    iterations = settings.budget.base_diffusion
    calm_noise = fit_diffusion(calm, extension, iterations=iterations)
    start = calm_noise.with_swings(free.settings.diffusion.swings)
    noise = fit_diffusion(free, extension, start, iterations)
    gain = calm.deviance(extension, calm_noise) - free.deviance(extension, noise)
    if gain < own.least_gain:
        return calm.settings
    return replace(settings, diffusion=settings.diffusion.with_swings(noise.swings_mps2_rthz))


def calm_share(problem: Problem, extension: Extension) -> float:
    """Share of the log in which no caster swings, 1 where none adds to the disturbance: in a fit swings weigh
    nothing, neither what the torques ask for meanwhile nor what answers them.
    """
    if not any(problem.settings.diffusion.swings):
        return 1.0
    return 1.0 - float(np.mean(swings(problem.binned, extension.base.half_track_m)))


def with_known_swings(settings: GateSettings, noise: NoiseModel) -> GateSettings:
    """The settings with the q that a model file holds; the same where it has none."""
    ahead, turning = noise.swing_longitudinal_mps2_rthz, noise.swing_yaw_mps2_rthz
    if not ahead and not turning:
        return settings
    known = settings.diffusion.with_swings((ahead or 0.0, turning or 0.0))
    return replace(settings, diffusion=known)

"""Skidding and slipping that make the log less likely than rolling are taken back.

A filter bank sees every lateral velocity. Tyres of many robots, and those of physics engines, creep sideways
by a few mm/s in each turn while they grip: with a precise pose that is called skidding for most of the drive.
A skid of the model moves sideways by far more, and the disturbance that makes up for the difference drowns
what the torques do.
"""

import numpy as np

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.modes import bin_identified, identified_modes
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.relabel import with_mode_at, without_skid
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack


def likely_modes(
    log: Log,
    extension: Extension,
    settings: GateSettings,
    noise: Diffusion | None = None,
    *,
    nothing_missing: bool = False,
) -> ModeTrack:
    """The identifier's modes with the extended model, without those that rolling explains better.

    Every skid is doubted; slipping where the robot is said to slip most of the time. With
    ``nothing_missing``, as on a calibration log, all slipping is: no effect makes rolling less likely then.
    So is that of a calibrated robot of unknown masses, of which nobody knows what its slipping loses.
    ``noise`` is where the diffusion starts (default: the prior's median).
    """
    track = identified_modes(log, extension, settings)
    seen = Problem.of(bin_identified(log, track, settings)).all_fitted()
    seen = without_unlikely(seen, seen.relabelled(without_skid(track)), seen.binned.skids, extension, noise)
    slips = seen.binned.slips
    unknown = bool(extension.misfit) and log.robot.slip_shares is None
    if nothing_missing or unknown or np.mean(slips) > settings.modes.most_slip:
        rolling = seen.relabelled(with_mode_at(seen.binned, slips, ContactMode.IDEAL))
        seen = without_unlikely(seen, rolling, slips, extension, noise)
    return track if seen.binned.track is None else seen.binned.track


def without_unlikely(
    seen: Problem, other: Problem, rows: Bool, extension: Extension, noise: Diffusion | None = None
) -> Problem:
    """``seen`` with the modes of ``other`` wherever its own are less likely, interval by interval.

    ``rows`` (n,) are those in which the two differ. Each labelling has the diffusion that it needs. An
    interval is judged by the sum of −2 log likelihood over its rows and those next to its ends. What is left
    must make the whole log likelier: a skid that is taken back needs a lateral disturbance everywhere.
    """
    if not np.any(rows):
        return seen
    own, noise = deviances(seen, extension, noise)
    less, noise = deviances(other.all_fitted(), extension, noise)
    excess = own - less
    edges = np.flatnonzero(np.diff(rows, prepend=False, append=False)).reshape(-1, 2)
    margin, least = seen.binned.margin, seen.settings.modes.least_doubt
    unlikely = np.zeros(len(rows), bool)
    for start, end in edges:
        unlikely[start:end] = excess[max(start - margin, 0) : end + margin].sum() > least
    if not np.any(unlikely):
        return seen
    mode, rest = np.where(unlikely, other.binned.mode, seen.binned.mode), seen
    for kind in np.unique(mode[unlikely]):
        track = with_mode_at(rest.binned, unlikely & (mode == kind), ContactMode(int(kind)))
        rest = rest.relabelled(track).all_fitted()
    return rest if deviances(rest, extension, noise)[0].sum() < own.sum() else seen


def deviances(problem: Problem, extension: Extension, start: Diffusion | None) -> tuple[F64, Diffusion]:
    """−2 log likelihood of each row (n,) at the diffusion that the labels need, and that diffusion.

    Labellings that are compared need about the same: it is searched from ``start``, another one's.
    """
    noise = fit_diffusion(problem, extension, start, problem.settings.budget.base_diffusion)
    return problem.filtered(extension, noise).deviance, noise

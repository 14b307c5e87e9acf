"""A loss of traction that the contact modes show, of a calibrated robot whose masses are not known.

What slipping takes of α follows from the robot's masses. Where these are unknown, a loss cannot be told from
the model's slipping by its size. But a robot that rolled on its calibration log, and slips on this one, lost
traction: where slipping is far likelier than rolling, that is the finding, in the time of the likeliest slip,
or in the place of several.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from wmr_replay.gap.estimation.likely_modes import deviances, likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.estimation.relabel import with_mode_at, with_slipping
from wmr_replay.gap.evidence.one_place import TYRES
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import SKID
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate, price_of
from wmr_replay.gap.search.same_loss import with_both_forms
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.slip_doubts import joined_runs
from wmr_schemas.modes import ContactMode

SLIP, PATCH = "slip_interval", "low_friction_patch"
MADE_UP_FOR = {SKID, TYRES}
"""Effects that make up for a loss of traction which nothing describes."""
Slip = tuple[int, int, float]
"""Rows [first, last) and by how much slipping is likelier there than rolling, in −2 log likelihood."""
LESS = "explains less than the robot's slipping"
"""Why an effect is not named beside it."""


class Loss(NamedTuple):
    """A loss of traction: the problem in which its rows do not slip, the base model there, and its fit."""

    problem: Problem
    base: Fit
    found: FittedCandidate

    @property
    def size(self) -> float:
        """The share of the traction that is lost."""
        return self.found.fit.extension.effects[self.found.name]["loss"]


def with_seen_slipping(problem: Problem, selection: Selection) -> tuple[Problem, Selection] | None:
    """The selection with the loss of traction that the modes show, where no other effect explains more; those
    that explain less are dropped. None without one, and where the robot is not calibrated, its masses are
    known, or it slipped on its calibration log.
    """
    misfit = selection.base.extension.misfit
    known = problem.binned.log.robot.slip_shares is not None
    if known or not misfit or SLIP in misfit:
        return None
    problem = with_modes_of_base(problem, selection.base.extension)
    slips = seen_slips(problem, selection.fit.extension, selection.fit.noise)
    explained = max((one.gain for one in selection.found if one.name not in MADE_UP_FOR), default=0.0)
    if explained >= max((gain for _, _, gain in slips), default=0.0):
        return None
    loss = likeliest_loss(problem, selection.base, slips)
    return None if loss is None else (loss.problem, with_loss(selection, loss))


def with_loss(selection: Selection, loss: Loss) -> Selection:
    """The selection that says the loss alone."""
    fit, found = with_both_forms(loss.problem, loss.found.fit, (loss.found,))
    others = [replace(one, failed=LESS) for one in selection.found if one.name not in MADE_UP_FOR]
    failed = {one.name: one for one in others}
    first, *rest = selection.stages or ((),)
    tried = tuple(failed.get(one.name, one) for one in first if one.name != found[0].name)
    return replace(
        selection,
        base=loss.base,
        fit=fit,
        found=found,
        stages=((*found, *tried), *rest),
        refused="",
        dropped=(*selection.dropped, *others),
    )


def with_modes_of_base(problem: Problem, extension: Extension) -> Problem:
    """The problem with the base model's modes where it has a slip or skid: the modes of another model, with
    which nothing was proven, may hide a slip.
    """
    binned = problem.binned
    if not binned.identified or not np.any(binned.slips | binned.skids):
        return problem
    track = likely_modes(binned.log, extension, problem.settings)
    return Problem.of(bin_identified(binned.log, track, problem.settings)).all_fitted()


def slipping_left(problem: Problem, fit: Fit) -> dict[str, float]:
    """The loss that a calibration log shows, where the robot slips on it; empty where it rolls, or skids and
    holds ahead.
    """
    loss = likeliest_loss(problem, fit, seen_slips(problem, fit.extension, fit.noise))
    return {} if loss is None else {SLIP: loss.size}


def seen_slips(problem: Problem, extension: Extension, noise: Diffusion | None = None) -> list[Slip]:
    """The slips that are far likelier than rolling, each with the skids next to it; the longer the log, the
    likelier they must be.

    Slipping and rolling have the diffusion that each of them needs.
    """
    binned, own = problem.binned, problem.settings.slip
    rows = np.asarray(binned.slips | binned.skids)
    if not binned.identified or not np.any(rows):
        return []
    rolling = problem.relabelled(with_mode_at(binned, rows, ContactMode.IDEAL))
    slipping, noise = deviances(problem.all_fitted(), extension, noise)
    excess = deviances(rolling.all_fitted(), extension, noise)[0] - slipping
    least = own.seen_gain * np.sqrt(max(1.0, (binned.t_s[-1] - binned.t_s[0]) / own.seen_in_s))
    found = []
    for first, last in joined_runs(binned, rows):
        gain = float(excess[max(first - binned.margin, 0) : last + binned.margin].sum())
        if gain > least and binned.t_s[last - 1] - binned.t_s[first] > own.shortest_inside_s:
            found.append((first, last, gain))
    return found


def likeliest_loss(problem: Problem, base: Fit, slips: list[Slip]) -> Loss | None:
    """The loss of traction in the likeliest of the ``slips`` in which one is lost; None where none is."""
    by_gain = sorted(slips, key=lambda slip: -slip[2])[: problem.settings.slip.most_doubts]
    return next(filter(None, (loss_in(problem, base, slip, slips) for slip in by_gain)), None)


def loss_in(problem: Problem, base: Fit, slip: Slip, slips: list[Slip]) -> Loss | None:
    """The loss of traction in the time of a slip, or in the place where others of the ``slips`` are, too;
    their rows no longer slip. None where less is lost than wheels that slip lose: tyres that skid may hold
    ahead.
    """
    binned, budget = problem.binned, problem.settings.budget
    there = [one for one in slips if is_near(binned, one, slip)]
    slipping = binned.slips.copy()
    for first, last, _ in there:
        slipping[first:last] = False
    rest = problem.relabelled(with_slipping(binned, slipping))
    name, size = (PATCH, disc_of(binned, there)) if len(there) > 1 else (SLIP, time_of(binned, slip))
    size["loss"] = problem.settings.scan.most_local_loss / 2
    base = fit_model(rest, base.extension, base.noise, budget.base_diffusion)
    fit = fit_model(rest, base.extension.with_effect(name, size), base.noise, budget.base_diffusion)
    if fit.extension.effects[name]["loss"] < problem.settings.slip.least_of_unknown:
        return None
    gain = sum(one[2] for one in there)
    scored = ScoredCandidate(name, size, gain, len(slips))
    p_value = min(1.0, len(slips) * float(chdtrc(len(size), gain)))
    return Loss(rest, base, FittedCandidate(scored, fit, gain, gain - price_of(rest, scored, fit), p_value))


def time_of(binned: BinnedLog, slip: Slip) -> dict[str, float]:
    """Begin and end of a slip."""
    return {"start_s": float(binned.t_s[slip[0]]), "end_s": float(binned.t_s[slip[1] - 1])}


def disc_of(binned: BinnedLog, slips: list[Slip]) -> dict[str, float]:
    """The disc about the path of the slips."""
    path = np.concatenate([binned.pose[first:last, :2] for first, last, _ in slips])
    centre = (path.min(axis=0) + path.max(axis=0)) / 2
    radius = np.hypot(*(path - centre).T).max()
    return dict(zip(("x_m", "y_m", "radius_m"), (*centre.tolist(), float(radius)), strict=True))


def is_near(binned: BinnedLog, one: Slip, other: Slip) -> bool:
    """Whether the discs about two slips have a place in common."""
    a, b = disc_of(binned, [one]), disc_of(binned, [other])
    apart = np.hypot(a["x_m"] - b["x_m"], a["y_m"] - b["y_m"])
    return bool(apart < a["radius_m"] + b["radius_m"])

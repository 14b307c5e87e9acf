"""What an effect's size is beside everything that a calibrated base model may leave, all at once.

A rest of the base model on one drive looks like another effect on the next: pads that brake turns a little
more look like a payload where an arm of the centre of mass turns the robot all the time. So the effect is
fitted beside every rest, each at a size of mean 0 and standard deviation floor/2, with the floor of
:func:`wmr_replay.gap.scan.misfit.floor_of`: one Newton step from the model with the effect, by Ψ and the
rests' sensitivities, with one row more for each rest that says that its size is 0.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, sensitivities
from wmr_replay.gap.evidence.significance import beside, size_columns
from wmr_replay.gap.model.candidates import LIBRARY
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.misfit import floor_of, may_be_rest
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.arrays import F64


class Beside(NamedTuple):
    """An effect beside the rests: the share of its size that is left, along its parameters, and its size
    less two standard deviations, robust over blocks.
    """

    share: float
    least: float


class Rest(NamedTuple):
    """A parameter of an effect that the base model may leave, and the largest size of it that is a rest."""

    name: str
    key: str
    floor: float


def beside_rests(problem: Problem, fit: Fit, name: str) -> Beside:
    """The effect ``name`` of the model ``fit`` beside the rests of its base model."""
    moved, V = step_beside_rests(problem, fit)
    own = size_columns(fit, name)
    before = fit.values[own]
    size = max(float(np.hypot.reduce(before.tolist())), 1e-12)
    along = before / size
    left = float(along @ (before + moved[own]))
    variance = max(float(along @ V[np.ix_(own, own)] @ along), 0.0)
    return Beside(left / size, left - problem.settings.misfit.in_sd * float(np.sqrt(variance)))


def step_beside_rests(problem: Problem, fit: Fit) -> tuple[F64, F64]:
    """How far the model's parameters (q,) move beside the rests, and their covariance (q, q)."""
    own, extension = problem.settings.misfit, fit.extension
    rests = rests_of(extension, own)
    for name in dict.fromkeys(rest.name for rest in rests):
        extension = extension.with_effect(name, {one.key: 0.0 for one in rests if one.name == name})
    keys = tuple((rest.name, rest.key) for rest in rests)
    slopes = sensitivities(problem, extension, fit.noise, keys, fit.innovations)
    return beside(problem, fit, slopes, np.array([rest.floor / own.in_sd for rest in rests]))


def rests_of(extension: Extension, own: MisfitSettings) -> tuple[Rest, ...]:
    """The rests of the base model that are none of the extension's effects."""
    names = (one for one in LIBRARY if one.name not in extension.effects and may_be_rest(one.name))
    floors = ((one, floor_of(one.name, extension, own)) for one in names)
    return tuple(Rest(one.name, key, floor) for one, floor in floors if floor > 0 for key in one.free)

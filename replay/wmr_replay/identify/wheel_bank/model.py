"""The model of hypotheses about a robot with encoders, as the bank asks for it."""

from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, TURN, Bins
from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet
from wmr_replay.identify.filter_bank.model import Said, moments
from wmr_replay.identify.filter_bank.steps import Rhythm
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.start import start_wheel_hypotheses
from wmr_replay.identify.wheel_bank.states import (
    ICR,
    LATERAL,
    LN_SCALE,
    LN_TRACK,
    N_STATES,
    Known,
    WheelPrior,
    make_wheel_prior,
)
from wmr_replay.identify.wheel_bank.steps import N_ANSWERS, run_wheel_bins
from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

LEAST_SD = 0.002
"""Of every parameter in the second pass, in its own unit: tyres change by so much with their load."""


@dataclass(frozen=True, eq=False)
class WheelModel:
    """Wheel speeds move the robot, but for the slip velocities."""

    prior: WheelPrior
    doubted: F64
    """What (3, 6) may turn out to be wrong, see :func:`~.steps.run_wheel_bins`. The track is open again. The
    centre of rotation and the lateral slip are near their nominal values again: were they open, they would
    explain skids away."""
    n_answers: int = N_ANSWERS
    n_states: int = N_STATES
    least_bins: int = 1
    needs_alpha: bool = False

    def with_alpha(self, alpha: float) -> "WheelModel":
        """The same model."""
        return self

    def start(self, hypotheses: HypothesisSet, bins: Bins, n_modes: int, last: F64) -> None:
        """See :func:`~.start.start_wheel_hypotheses`."""
        start_wheel_hypotheses(hypotheses, bins, self.prior, n_modes)
        last[1:3] = bins.values[FORCE, -1], bins.values[TURN, -1]

    def run(self, hypotheses: HypothesisSet, values: F64, seconds: F64, last: F64, rhythm: Rhythm) -> Said:
        """See :func:`~.steps.run_wheel_bins`."""
        return run_wheel_bins(hypotheses, values, seconds, last, rhythm, self.doubted)

    def learned(self, hypotheses: HypothesisSet) -> "WheelModel":
        """The model with what the first pass knows of the parameters at its end."""
        mean, sd = moments(hypotheses)
        narrow = np.minimum(np.maximum(sd[LN_SCALE:], LEAST_SD), self.prior.sd)
        return replace(self, prior=WheelPrior(mean[LN_SCALE:], narrow))


def wheel_model(robot: RobotParameters, known: Known) -> WheelModel:
    """The model of a robot by its nominal dimensions and a model's ``known`` effects."""
    prior = make_wheel_prior(robot, known)
    return WheelModel(prior, doubted_of_wheels(prior))


def doubted_of_wheels(prior: WheelPrior) -> F64:
    """What (3, 6) of the parameters may turn out to be wrong, see :class:`WheelModel`."""
    doubted = np.zeros((3, len(prior.sd)))
    track = LN_TRACK - LN_SCALE
    doubted[0, track] = prior.sd[track] ** 2
    for state, usual_sd in ((ICR, WHEEL_PRIORS.usual_icr_sd_m), (LATERAL, WHEEL_PRIORS.usual_lateral_sd_s)):
        place = state - LN_SCALE
        doubted[1:, place] = prior.mean[place], min(prior.sd[place], usual_sd) ** 2
    return doubted

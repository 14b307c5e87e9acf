"""The model of hypotheses about a robot with encoders and known torques, as the bank asks for it."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, TURN, Bins
from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, log_prior_of_level, normalise
from wmr_replay.identify.filter_bank.model import Said, moments
from wmr_replay.identify.filter_bank.steps import Rhythm
from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS
from wmr_replay.identify.joint_bank.states import (
    AHEAD,
    ALPHA,
    AROUND,
    BETA,
    DRAG,
    DRAG_TURN,
    N_STATES,
    JointPrior,
    make_joint_prior,
)
from wmr_replay.identify.joint_bank.steps import EFFORT, EFFORT_TURN, N_ANSWERS, run_joint_bins
from wmr_replay.identify.wheel_bank.model import LEAST_SD, doubted_of_wheels
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import (
    LN_SCALE,
    S_DIFF,
    S_LAT,
    S_SUM,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
    Known,
    WheelPrior,
)
from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

LEAST_ALPHA_SHARE = 0.05
"""Of α in the second pass: a load of 5 % comes and goes within a log."""


@dataclass(frozen=True, eq=False)
class JointModel:
    """Torques drive the robot; wheel speeds are those of the ground and of slip."""

    prior: JointPrior
    doubted: F64
    """What (3, 8) may turn out to be wrong, from ``LN_SCALE`` on: the track and α are open again; the centre
    of rotation and the lateral slip are near their nominal values again, as in the wheel-speed bank."""
    n_answers: int = N_ANSWERS
    n_states: int = N_STATES
    least_bins: int = 1
    needs_alpha: bool = False

    def with_alpha(self, alpha: float) -> "JointModel":
        """The model itself: α is a state."""
        return self

    def start(self, hypotheses: HypothesisSet, bins: Bins, n_modes: int, last: F64) -> None:
        """One hypothesis for each mode and level, at the last of the bins."""
        start_hypotheses(hypotheses, bins, self.prior, n_modes)
        last[1:3] = bins.values[FORCE, -1], bins.values[TURN, -1]
        last[7:9] = bins.values[EFFORT, -1], bins.values[EFFORT_TURN, -1]

    def run(self, hypotheses: HypothesisSet, values: F64, seconds: F64, last: F64, rhythm: Rhythm) -> Said:
        """See :func:`~.steps.run_joint_bins`."""
        spinning = self.prior.spinning, self.prior.spinning_yaw
        return run_joint_bins(hypotheses, values, seconds, last, rhythm, self.doubted, spinning)

    def learned(self, hypotheses: HypothesisSet) -> "JointModel":
        """The model with what the first pass knows of the parameters at its end."""
        mean, sd = moments(hypotheses)
        wheels = slice(LN_SCALE, ALPHA)
        narrow = np.minimum(np.maximum(sd[wheels], LEAST_SD), self.prior.wheels.sd)
        least = LEAST_ALPHA_SHARE * np.abs(mean[[ALPHA, BETA]])
        alpha_sd, beta_sd = np.maximum(sd[[ALPHA, BETA]], least)
        prior = self.prior._replace(
            wheels=WheelPrior(mean[wheels], narrow),
            alpha=float(mean[ALPHA]),
            alpha_sd=float(min(alpha_sd, self.prior.alpha_sd)),
            beta=float(mean[BETA]),
            beta_sd=float(min(beta_sd, self.prior.beta_sd)),
        )
        return replace(self, prior=prior)


def joint_model(robot: RobotParameters, known: Known) -> JointModel:
    """The model of a robot by its nominal parameters and a model's ``known`` effects."""
    prior = make_joint_prior(robot, known)
    doubted = np.zeros((3, BETA + 1 - LN_SCALE))
    doubted[:, : ALPHA - LN_SCALE] = doubted_of_wheels(prior.wheels)
    doubted[0, ALPHA - LN_SCALE] = (JOINT_PRIORS.load_change_sd * prior.alpha) ** 2
    doubted[0, BETA - LN_SCALE] = (JOINT_PRIORS.load_change_sd * prior.beta) ** 2
    return JointModel(prior, doubted)


def start_hypotheses(hypotheses: HypothesisSet, bins: Bins, prior: JointPrior, n_modes: int) -> None:
    """Fill the set with one hypothesis for each mode and level, at the last of the bins."""
    levels = WHEEL_PRIORS.calm_mps
    for h, (mode, level) in enumerate(product(range(n_modes), range(len(levels)))):
        mean, covariance = hypotheses.mean[h], hypotheses.covariance[h]
        mean[:], covariance[:] = 0.0, 0.0
        mean[:3], mean[LN_SCALE:ALPHA] = bins.values[:3, -1], prior.wheels.mean
        mean[ALPHA], mean[BETA] = prior.alpha, prior.beta
        slips, skids = mode in (SLIPPING, SKIDDING_SLIPPING), mode in (SKIDDING, SKIDDING_SLIPPING)
        diagonal = np.zeros(N_STATES)
        diagonal[:3], diagonal[LN_SCALE:ALPHA] = bins.values[3:6, -1], prior.wheels.sd**2
        diagonal[[S_SUM, S_DIFF]] = (JOINT_PRIORS.start_slip_sd_mps if slips else levels[level]) ** 2
        diagonal[S_LAT] = WHEEL_PRIORS.skid_sd_mps**2 if skids else levels[level] ** 2
        diagonal[[ALPHA, BETA]] = prior.alpha_sd**2, prior.beta_sd**2
        diagonal[DRAG] = JOINT_PRIORS.drag_sd_mps2**2
        diagonal[DRAG_TURN] = (JOINT_PRIORS.turn_disturbance * JOINT_PRIORS.drag_sd_mps2) ** 2
        diagonal[AHEAD] = JOINT_PRIORS.disturbance_mps2[level] ** 2
        diagonal[AROUND] = JOINT_PRIORS.turn_disturbance**2 * diagonal[AHEAD]
        covariance[np.arange(N_STATES), np.arange(N_STATES)] = diagonal
        hypotheses.mode[h], hypotheses.level[h] = mode, level
        hypotheses.log_weight[h] = log_prior_of_level(level) - (0.0 if mode == 0 else 3.0)
    hypotheses.size[0] = n_modes * len(levels)
    normalise(hypotheses)

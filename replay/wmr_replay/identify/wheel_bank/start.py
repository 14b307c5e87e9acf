"""Initial hypotheses: the first pose, in every mode and level of elastic slip."""

from itertools import product

import numpy as np

from wmr_replay.identify.filter_bank.bins import Bins
from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, log_prior_of_level, normalise
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import (
    LN_SCALE,
    N_STATES,
    S_DIFF,
    S_LAT,
    S_SUM,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
    WheelPrior,
)


def start_wheel_hypotheses(hypotheses: HypothesisSet, bins: Bins, prior: WheelPrior, n_modes: int) -> None:
    """Fill the set with one hypothesis for each mode and level, at the last of the bins."""
    levels = WHEEL_PRIORS.calm_mps
    for h, (mode, level) in enumerate(product(range(n_modes), range(len(levels)))):
        mean, covariance = hypotheses.mean[h], hypotheses.covariance[h]
        mean[:], covariance[:] = 0.0, 0.0
        mean[:3], mean[LN_SCALE:] = bins.values[:3, -1], prior.mean
        slips, skids = mode in (SLIPPING, SKIDDING_SLIPPING), mode in (SKIDDING, SKIDDING_SLIPPING)
        diagonal = np.zeros(N_STATES)
        diagonal[:3], diagonal[LN_SCALE:] = bins.values[3:6, -1], prior.sd**2
        diagonal[[S_SUM, S_DIFF]] = WHEEL_PRIORS.slip_sd_mps**2 if slips else levels[level] ** 2
        diagonal[S_LAT] = WHEEL_PRIORS.skid_sd_mps**2 if skids else levels[level] ** 2
        covariance[np.arange(N_STATES), np.arange(N_STATES)] = diagonal
        hypotheses.mode[h], hypotheses.level[h] = mode, level
        hypotheses.log_weight[h] = log_prior_of_level(level) - (0.0 if mode == 0 else 3.0)
    hypotheses.size[0] = n_modes * len(levels)
    normalise(hypotheses)

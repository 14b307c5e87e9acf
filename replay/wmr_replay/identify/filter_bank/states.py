"""The state of one hypothesis, and its prior.

x, y, ψ, v_long, v_lat, ω; ln α; ln β with β = α_yaw/l; ln c with the skid's decay rate c/v, c = 2 G_x/(ε m);
ρ, the share of traction that slipping leaves – on slippery ground, in its place, the logarithm of what
friction carries, a wheel's largest contribution to dv_long/dt in m/s²; and disturbances of dv_long/dt in m/s²
and of dω/dt in rad/s², which no model has: Ornstein-Uhlenbeck processes, since what acts on a robot lasts.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_schemas.modes import MODES
from wmr_schemas.robot import RobotParameters

X, Y, PSI, V_LONG, V_LAT, OMEGA, LN_ALPHA, LN_BETA, LN_C, RHO, AHEAD, AROUND = range(12)
N_STATES = 12
N_MOVING = 6
"""The first six states are predicted; of the others four are parameters that drift at most, and two are
disturbances that die out."""

IDEAL, SKIDDING, SLIPPING, SKIDDING_SLIPPING = (int(mode) for mode in MODES)
"""``ContactMode`` as the integers that compiled code compares with."""
CAPPED = 1 + SKIDDING_SLIPPING
"""A hypothesis beyond the modes, slippery ground: a wheel slips while its demand exceeds what friction
carries.
"""


class Prior(NamedTuple):
    """Means and standard deviations of the parameters, and constants of the model.

    ``average_speed_mps`` NaN stands for ``auto``; ``yaw_slip_ratio`` is ρ of the yaw axis over ρ.
    """

    ln_alpha: float
    ln_alpha_sd: float
    ln_beta: float
    ln_beta_given_alpha_sd: float
    ln_c: float
    ln_c_sd: float
    rho: float
    rho_sd: float
    yaw_slip_ratio: float
    half_track_m: float
    average_speed_mps: float


def make_prior(robot: RobotParameters) -> Prior:
    """The prior of a robot, about its nominal parameters; see :class:`.priors.BankPriors`.

    Unknown parameters get a wide prior. An unknown α is NaN until :func:`with_alpha` fills it in.
    """
    shares = robot.slip_shares
    rho, yaw_share = (PRIORS.unknown_rho, PRIORS.unknown_rho) if shares is None else shares
    known_c = robot.skid_decay_mps2
    c = PRIORS.unknown_c_mps2 if known_c is None else known_c
    alpha, alpha_yaw, half_track = robot.alpha, robot.alpha_yaw_or_alpha, robot.half_track_m
    speed = robot.average_speed_mps
    known_beta = alpha_yaw is not None and half_track is not None
    return Prior(
        ln_alpha=np.nan if alpha is None else float(np.log(alpha)),
        ln_alpha_sd=PRIORS.ln_alpha_sd,
        ln_beta=float(np.log(alpha_yaw / half_track)) if known_beta else np.nan,  # type: ignore[operator]
        ln_beta_given_alpha_sd=PRIORS.ln_beta_given_alpha_sd,
        ln_c=float(np.log(min(c, PRIORS.most_c_mps2))),
        ln_c_sd=PRIORS.unknown_ln_c_sd if known_c is None else PRIORS.ln_c_sd,
        rho=rho,
        rho_sd=PRIORS.rho_sd,
        yaw_slip_ratio=yaw_share / rho,
        half_track_m=0.0 if half_track is None else half_track,
        average_speed_mps=speed if isinstance(speed, float) else np.nan,
    )


def with_alpha(prior: Prior, alpha: float) -> Prior:
    """The prior of a robot without a nominal α, once a regression has found one."""
    ln_alpha = float(np.log(alpha))
    ln_beta = ln_alpha - float(np.log(prior.half_track_m)) if prior.half_track_m > 0 else np.nan
    return prior._replace(ln_alpha=ln_alpha, ln_beta=ln_beta)

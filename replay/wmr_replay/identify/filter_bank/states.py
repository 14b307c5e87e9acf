"""The state of one hypothesis, and what is believed of it before the log is seen.

x, y, ψ, v_long, v_lat, ω; ln α; ln β with β = α_yaw/l; ln c with the skid's decay rate c/v, c = 2 G_x/(ε m);
and ρ, the share of traction that slipping leaves – on slippery ground, in its place, the logarithm of what
friction carries, a wheel's largest contribution to dv_long/dt in m/s².
"""

from typing import NamedTuple

import numpy as np

from wmr_schemas.robot import RobotParameters

X, Y, PSI, V_LONG, V_LAT, OMEGA, LN_ALPHA, LN_BETA, LN_C, RHO = range(10)
N_STATES = 10
N_MOVING = 6
"""The first six states move; the last four are parameters that drift at most."""

IDEAL, SKIDDING, SLIPPING, BOTH, CAPPED = range(5)
"""The modes, and slippery ground: there a wheel slips while its demand exceeds what friction carries."""

PRIOR_SKID_DECAY_MPS2, PRIOR_SKID_DECAY_LN_SD = 8.0, 1.5
"""Mean and spread (of the logarithm) of c for a robot of unknown stiffness or mass. The mean is the paper
robot's; the spread reaches from a fifth of it to five times as much within one standard deviation.
"""
PRIOR_SLIP_SHARE = 0.1
"""Mean of ρ for a robot of unknown masses; its standard deviation of .2 covers most robots."""


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
    """A prior about the nominal parameters: α within a factor 2 (two standard deviations), stiffness
    likewise.

    What is unknown gets a wide prior; an unknown α is NaN until :func:`with_alpha` fills it in.
    """
    shares = robot.slip_shares
    rho, yaw_share = (PRIOR_SLIP_SHARE, PRIOR_SLIP_SHARE) if shares is None else shares
    known_c = robot.skid_decay_mps2
    c = PRIOR_SKID_DECAY_MPS2 if known_c is None else known_c
    alpha, alpha_yaw, half_track = robot.alpha, robot.alpha_yaw_or_alpha, robot.half_track_m
    speed = robot.average_speed_mps
    known_beta = alpha_yaw is not None and half_track is not None
    return Prior(
        ln_alpha=np.nan if alpha is None else float(np.log(alpha)),
        ln_alpha_sd=0.5 * float(np.log(2.0)) * 1.5,
        ln_beta=float(np.log(alpha_yaw / half_track)) if known_beta else np.nan,  # type: ignore[operator]
        ln_beta_given_alpha_sd=0.05,
        ln_c=float(np.log(c)),
        ln_c_sd=PRIOR_SKID_DECAY_LN_SD if known_c is None else float(np.log(2.0)),
        rho=rho,
        rho_sd=0.2,
        yaw_slip_ratio=yaw_share / rho,
        half_track_m=0.0 if half_track is None else half_track,
        average_speed_mps=speed if isinstance(speed, float) else np.nan,
    )


def with_alpha(prior: Prior, alpha: float) -> Prior:
    """The prior of a robot without a nominal α, once a regression has found one."""
    ln_alpha = float(np.log(alpha))
    ln_beta = ln_alpha - float(np.log(prior.half_track_m)) if prior.half_track_m > 0 else np.nan
    return prior._replace(ln_alpha=ln_alpha, ln_beta=ln_beta)

"""Priors of the joint bank, every value with its reason; those of the wheels are the wheel-speed bank's."""

from dataclasses import dataclass

from wmr_replay.identify.filter_bank.priors import PRIORS


@dataclass(frozen=True)
class JointPriors:
    """Priors of the joint bank. "sd" is a standard deviation."""

    alpha_sd_share: float = PRIORS.ln_alpha_sd
    """Of α about the nominal one, as a share of it."""
    yaw_sd_share: float = 2.0
    """Of the traction in yaw about α's: masses lie at the middle of a robot or at its ends."""
    unknown_alpha: float = 10.0
    """Of α about 0 without a nominal one, (m/s²)/(N·m): it is 1 of 10 kg on wheels of 10 cm."""
    alpha_drift_share_rts: float = 0.003
    """Diffusion of α in a second as a share of it: motors warm up by some per cent in minutes."""
    load_change_sd: float = PRIORS.load_change_sd
    """Of a change of α where what was learnt is doubted: a third of the robot's mass."""
    unknown_spinning: float = 0.06
    """2 I_φ/(m r²) where mass or inertia of the wheels are unknown: wheels and gears of usual robots."""
    spinning_sd: float = 0.05
    """Of that ratio, stated or not: gears are seldom counted."""

    drag_sd_mps2: float = 0.2
    """Of what resists rolling, about 0: 2 % of the weight, and friction in gears."""
    stands_mps: float = 0.02
    """Resistance changes its sign over this speed of a wheel."""
    turn_disturbance: float = 3.0
    """Disturbances of turning over those ahead: wheels that turn a robot also scrub."""
    disturbance_mps2: tuple[float, ...] = (0.01, 0.02, 0.04, 0.08, 0.15)
    """What acts besides torques and resistance to rolling, by level of elastic slip: slopes, gears."""
    disturbance_time_s: float = 2.0
    """Its correlation time: resistance lasts as long as a run, slopes some metres."""
    timing_sd_s: float = 0.005
    """Of torques against wheel speeds of one sample: half a period of 100 Hz."""
    slip_diffusion: float = 0.002
    """Of a slipping wheel's slip velocity where it is steady, (m/s)²/s …"""
    burst_diffusion: float = 0.1
    """… and where it grows or dies out, by some dm/s within .2 s …"""
    burst_share: float = 0.2
    """… which is so in this share of a slip's time."""
    spread_mps_rts: tuple[float, float] = (0.03, 0.1)
    """What a line does not know of a slip that goes on, (m/s)/√s: alone, and while the robot skids. Friction
    divides itself between ahead and sideways, and a slip that is believed too far is never left."""
    start_slip_sd_mps: float = 0.5
    """Of it where its mode has just been supposed without a history."""
    stop_sd_mps: float = 0.05
    """What is left of a slip at the instant at which its end is supposed; it dies out within the interval."""
    least_sd_mps: float = 0.001
    """Of a change of speed in a bin: no model is truer."""
    coupling_sd: float = 1.0
    """Of the share of v_lat·ω that accelerates a robot ahead: all of it in a rigid body, a third in the
    paper's skid."""


JOINT_PRIORS = JointPriors()

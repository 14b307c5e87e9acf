"""Priors and rates of the algebraic identifier; none of them is a stiffness or a mass.

Some are the benchmark's own values (``bench/identifier.py`` on the scenarios of ``wmr_synth``) and carry no
evidence about other robots: the width of the priors of α and β, the rate of switches, and the decay rate of a
skid. Their lines say so. Where a line gives no reason, the value was chosen on development logs of the
benchmark, and no measurement of it alone is recorded.
"""

from typing import NamedTuple

from wmr_schemas.robot import RobotParameters

FACTOR_2_MEAN, FACTOR_2_SD = 1.08, 0.45
"""Mean and sd of a factor that is log-uniform from ½ to 2 (1.08 and .43). This is the benchmark's draw: it
makes the nominal α of each log wrong by such a factor.
"""
UNKNOWN_ALPHA_SD = 1.0
"""Sd in (m/s²)/(N·m) about 0, without a nominal α: α is about 1/(m r), 1 for 10 kg on wheels of 10 cm."""
UNKNOWN_YAW_GAIN_SD = 3.0
"""Sd in (rad/s²)/(N·m) about 0, without a nominal α: the α above over a half track of a third of a metre."""
MIN_HALF_TRACK_M = 0.1
"""With a nominal α and no half track, β = α/l is at most that of a half track of 10 cm."""
START_SLIPPING = 1 / 3
"""With a nominal α the three modes are equally probable at the start."""
START_SLIPPING_UNKNOWN_ALPHA = 0.02
"""Without a nominal α the first push is what α is learnt from: the robot is taken to have traction then."""


class Priors(NamedTuple):
    """Priors and rates; times in s, the rest in SI units.

    α and the yaw gain β (dω/dt = β·(effort_right − effort_left)) are normal with the mean and sd given here.
    """

    alpha: float
    alpha_sd: float
    yaw_gain: float
    yaw_gain_sd: float
    start_slipping: float = START_SLIPPING

    switch_rate_hz: float = 0.15
    """The benchmark's: its phases last 2 to 10 s, 6 s on average, which is .17 switches per second."""
    load_change_rate_hz: float = 1 / 3600
    """Once an hour: rare against switches."""
    load_change: float = 0.15
    """Relative sd of α and β after a change of load: ± 30 % at two sd."""

    traction: float = 0.1
    """Share of the traction that slipping leaves; the published numbers give .04."""
    traction_sd: float = 0.2
    """Two sd reach .5: slipping that leaves more than that looks like another α."""
    yaw_traction_diffusion: float = 0.3
    """Relative white noise of that share in yaw, in √s: the share is not estimated there."""

    log_decay: float = 1.2
    """ln of the rate in 1/s at which v_lat dies out while skidding: 3.3/s. The benchmark's robot has 8/v: it
    is that rate at 2.4 m/s, near the middle of the benchmark's speeds.
    """
    log_decay_sd: float = 1.0
    """Two sd reach from .45/s to 25/s."""
    log_decay_drift: float = 0.22
    """Wander in 1/√s: the rate goes with 1/speed, and the speed changes within a skid."""
    side_force_diffusion: float = 0.1
    """White side force relative to v·ω, in √s: what a skid obeys beyond the constant rate."""

    long_diffusion: float = 2e-3
    """White disturbance of v_long in (m/s²)/√Hz: what the model leaves out."""
    yaw_diffusion: float = 2e-3
    """The same for ω, in (rad/s²)/√Hz."""
    gain_drift: float = 5e-5
    """Relative wander of α and β in 1/√s: .3 % in an hour; load changes are hypotheses of their own."""
    free_long_diffusion: float = 1.0
    """White disturbance of v_long where no torque is known: it stands for the torque, 1 m/s within 1 s."""
    free_yaw_diffusion: float = 1.0
    """The same for ω, in (rad/s²)/√Hz."""

    jump_m: float = 1.0
    """Sd of x and y after a jump of the pose, in m."""
    jump_rad: float = 0.3
    """Sd of the yaw after a jump, in rad."""

    start_speed_mps: float = 10.0
    """Sd of v_long at the start, wide, so that the first bins decide."""
    start_lateral_mps: float = 1.0
    """Sd of v_lat where the log starts in a skid."""
    start_yaw_rate_radps: float = 2.0
    """Sd of ω at the start."""


def make_priors(robot: RobotParameters) -> Priors:
    """α and β within a factor of 2 of the nominal ones; nearly flat where these are unknown."""
    alpha, alpha_yaw, half_track_m = robot.alpha, robot.alpha_yaw_or_alpha, robot.half_track_m
    turns = alpha_yaw is not None and half_track_m is not None
    yaw_gain = alpha_yaw / half_track_m if alpha_yaw and half_track_m else 0.0
    widest = UNKNOWN_YAW_GAIN_SD if alpha_yaw is None else alpha_yaw / MIN_HALF_TRACK_M
    return Priors(
        alpha=FACTOR_2_MEAN * alpha if alpha is not None else 0.0,
        alpha_sd=FACTOR_2_SD * alpha if alpha is not None else UNKNOWN_ALPHA_SD,
        yaw_gain=FACTOR_2_MEAN * yaw_gain,
        yaw_gain_sd=FACTOR_2_SD * yaw_gain if turns else widest,
        start_slipping=START_SLIPPING if alpha is not None else START_SLIPPING_UNKNOWN_ALPHA,
    )

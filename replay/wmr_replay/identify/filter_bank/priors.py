"""Priors and thresholds of the filter bank, every value with its reason."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BankPriors:
    """Priors and thresholds of the filter bank. "sd" is a standard deviation; log weights are natural."""

    ln_alpha_sd: float = 0.5 * math.log(2.0) * 1.5
    """Of ln α about the nominal one: a factor of 2 is 4/3 of it. The benchmark draws nominal values within
    that factor, so the value is the benchmark's own and is not evidence about other robots."""
    far_ln_alpha: float = 1.2
    """A nominal α may be off by far more – another gear, an effort in other units: hypotheses about 1/3.3 and
    3.3 of it, each with the same standard deviation, reach to a factor of 5 …"""
    far_share: float = 0.03
    """… and hold so much of the prior each."""
    ln_beta_given_alpha_sd: float = 0.05
    """Of ln β where α is known: both share mass and motors, only the mass's distribution sets them apart."""
    ln_c_sd: float = 0.5 * math.log(10.0)
    """Of ln c about the nominal one: load and pressure change it by 2, data sheets are off by up to 10."""
    unknown_ln_c_sd: float = 1.5
    """Of ln c without a nominal one: a factor of 20 either way at two standard deviations."""
    unknown_c_mps2: float = 8.0
    """c = 2 G_x/(ε m) without a nominal one, in m/s². It is the value of the paper's robot, with the
    standard deviation ``unknown_ln_c_sd``; it is not evidence about other robots."""
    most_c_mps2: float = 50.0
    """Largest c. A skid that decays faster moves sideways by less than a fiftieth of a second of the lateral
    acceleration, as tyres that grip may: the two could not be told apart."""
    unknown_rho: float = 0.1
    """Share of traction that slipping leaves, where wheel and yaw inertia are unknown."""
    rho_sd: float = 0.2
    """Of that share, which lies between 0 and 1."""
    average_speed_floor_mps: float = 0.3
    """Least average speed in c/v: the paper's linear tyre model has none at standstill."""

    disturbance_time_s: float = 1.0
    """Correlation time of disturbances: between a floor's unevenness (tenths of a second at a walking pace)
    and slopes and friction that change over some metres. .4 s gives the same accuracies."""
    elastic_sideslip_s: float = 0.004
    """Lateral velocity of tyres that grip, over the lateral acceleration: some mm/s at 1 m/s² …"""
    elastic_lasts_s: float = 0.5
    """… which lasts as long as a curve does."""
    compensated_sd: float = 3.0
    """Efforts that ask for less than so many standard deviations of a disturbance may only compensate it."""
    least_half_track_m: float = 0.1
    """For turning what is known of dv_long/dt into dω/dt, where the half track is unknown or tiny."""
    longest_step_s: float = 0.05
    """Longer steps are divided: the time constant v/c of a skid is of this order at .4 m/s."""
    longest_hole_s: float = 60.0
    """Time beyond it is not predicted over: by then the pose is open anyway, and work stays bounded."""
    unknown_acceleration_diffusion: float = 0.5
    """(m/s²)²·s: velocities where no torque is known, .7 m/s within a second."""
    least_bin_sd: float = 5e-4
    """m and rad: a bin's pose is never trusted further than that, however quiet; the model is no truer."""
    least_start_speed_sd_mps: float = 0.05
    """Added to the first velocities, in m/s and rad/s: a quadratic does not follow a switch in its window."""
    alpha_known_within: float = 0.3
    """Without a nominal α the bank starts once the regression knows it to this share of itself."""

    outlier_sd: float = 5.0
    """An innovation beyond it is weighed as if it lay there: Gaussian noise exceeds it once in 2·10⁶."""
    prune_log_weight: float = -14.0
    """Below the best one, a hypothesis is dropped: 10⁻⁶ in all of 40 hypotheses would change no posterior."""
    split_log_weight: float = -9.0
    """A hypothesis below it (10⁻⁴) has no children: their prior would take them below the pruning limit."""
    merge_sd: float = 0.2
    """Means closer than this many standard deviations agree: far less than the data can tell apart."""
    merge_variance_ratio: float = 1.5
    """Variances within this ratio agree."""
    least_interval_weight: float = 0.01
    """Hypotheses of less weight do not widen the interval of α: a supposed change of load would always."""

    rolled_s: float = 10.0
    """For how long a robot rolls before it skids or slips, …"""
    rolls_seen: float = 2.0
    """… as if this had been seen so often. The log teaches the rest: from one switch in half a second to one
    a minute."""
    lost_s: float = 1.7
    """Likewise how long a skid or slip lasts: as long as a curve, a start or a patch of ground does, .5 to
    5 s, near the geometric middle of that, …"""
    ends_seen: float = 3.0
    """… as if this had been seen so often. Judgement: few enough for a log whose skids last 5 to 20 s to
    teach that."""
    across: float = 0.2
    """Share of skids and slips that lead into another mode than rolling: grip mostly comes back first.
    Judgement, between .08 of driver families to develop on and the half of the scenario ``random``."""
    starts_rolling: float = 0.9
    """How probable rolling is at the start. Judgement: a log mostly begins at rest or in grip. Without
    turning or torque, what a log begins with stays undecided for long; .6 made rolling a skid for as long."""
    learned_switches: float = 4.0
    """The second pass takes what the first has counted for so many switches at most."""

    level_change: float = 1e-3
    """Probability, at each split, that the level of disturbance has changed to a neighbouring one: ground
    changes every few minutes."""
    n_calm_levels: int = 2
    """Levels of disturbance that a log must first show to be so calm."""
    calm_level_log_prior: float = math.log(10.0)
    """Each of them is a tenth as probable as the next: a filter that believes its model too far fails."""
    load_changes_per_s: float = 1 / 3600
    """How often a robot is loaded or unloaded: once an hour."""
    load_change_sd: float = 0.3
    """Of the change of ln α and ln β by a load: a third of the robot's mass."""

    cap_below_demand_mean: float = -0.5
    """Of ln(what friction carries / what the wheel demands) where slipping begins: two thirds …"""
    cap_below_demand_sd: float = 0.5
    """… within a factor of 1.6: a torque seldom exceeds what the ground carries by much."""
    kind_prior: float = 1.0
    """Slips of either kind that are counted beforehand (Laplace's rule): the first tells little."""
    least_demand_mps2: float = 0.01
    """A wheel that is asked for less does not tell whether the ground is slippery."""
    least_cap_sd: float = 1e-3
    """Of the logarithm of a cap: it is never known better than to a thousandth."""

    surprise_chi2: float = 25.0
    """χ² of three degrees of freedom beyond which a pose may have jumped: a chance of 1.5·10⁻⁵."""
    jumps_per_s: float = 1 / 3600
    """How often a pose jumps unseen by the repair before the bank: once an hour."""
    jump_m: float = 1.0
    """Standard deviation of such a jump: larger ones are found before."""
    jump_rad: float = 0.3
    """Likewise of its turn."""
    release_sd: float = 30.0
    """Standard deviations of a bin's pose: a jump is taken out to within those of single rows."""
    jump_log_weight: float = -9.0
    """A hypothesis below it (10⁻⁴) has no child whose pose jumps."""
    jump_shows_s: float = 0.5
    """How long a jump is reported."""
    jump_probable: float = 0.5
    """Weight of the hypotheses with a jump at which it is reported."""


PRIORS = BankPriors()

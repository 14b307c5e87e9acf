"""Priors and thresholds of the wheel-speed bank, every value with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WheelPriors:
    """Priors and thresholds of the wheel-speed bank. "sd" is a standard deviation."""

    ln_scale_sd: float = 0.08
    """Of the wheels' scale: radii are known to 3 %, but a real robot's was .82 of its nominal one."""
    unknown_radius_m: float = 0.15
    """Without a nominal radius: of wheels between 3.5 and 60 cm …"""
    unknown_ln_scale_sd: float = 0.7
    """… which lie within two standard deviations."""
    ln_track_sd: float = 0.35
    """Of the effective half track: that of skid-steered robots is 1.1 to 2.6 times the geometric one."""
    unknown_half_track_m: float = 0.3
    """Without a nominal one: of a robot of .6 m."""
    unknown_ln_track_sd: float = 0.7
    """Of it without a nominal one."""
    icr_sd_m: float = 0.1
    """Offset of the centre of rotation along the robot: some centimetres to tens of them."""
    lateral_sd_s: float = 0.1
    """Lateral slip per v·ω: 0 for two driven wheels, .16 s for a skid-steered robot of 50 kg."""
    difference_sd: float = 0.02
    """Half the relative difference of the wheels: tyres wear to 1 %, and are inflated to 2 %."""
    delay_sd_s: float = 0.05
    """Delay between wheel speeds and pose: some periods of a tracker or of a bus."""

    usual_icr_sd_m: float = 0.03
    """Of an offset about the nominal one that is taken up again, as often: …"""
    usual_lateral_sd_s: float = 0.03
    """… and of the lateral slip. A first turn on ice teaches an offset of some decimetres."""

    least_known_sd: float = 0.002
    """Of what a model file says, in the effect's own unit: tyres change by so much with load and warmth."""
    doubts_per_s: float = 1 / 600
    """How often what was learnt of the track is doubted: a first turn on ice teaches a wrong one, and every
    later turn would count as slipping."""

    slip_mps: float = 0.05
    """A wheel slips from this slip velocity on …"""
    slip_share: float = 0.03
    """… or from this share of the speed on: elastic slip under traction is some per mille to per cent."""
    skid_mps: float = 0.03
    """A robot skids from this lateral velocity on, beside what its centre of rotation explains."""

    rates_per_s: tuple[tuple[float, ...], ...] = (
        (0.0, 0.025, 0.05, 0.005),
        (0.8, 0.0, 0.02, 0.6),
        (0.8, 0.02, 0.0, 0.6),
        (0.15, 0.4, 0.4, 0.0),
    )
    """Changes a second from mode to mode: ideal, skidding, slipping, both. Slip lasts about a second, grip
    many; where a wheel slips nothing holds the robot sideways, so that the two come together. Judgement."""
    first_slips: float = 0.5
    first_s: float = 10.0
    """What is known of how often ideal rolling ends before the log: a slip in 10 s. …"""
    memory_s: float = 120.0
    """… The ground of the last minutes decides."""

    hindsight_split_s: float = 0.02
    """Time between two branchings of the second pass: slips of a spinning wheel begin and end within it."""

    calm_mps: tuple[float, ...] = (0.001, 0.003, 0.006, 0.012)
    """Levels of elastic slip, standard deviations: from a hard wheel on concrete to a soft one on carpet."""
    rare_sd: float = 2.5
    """A pose further off is weighed as if it lay there: among 10⁵ poses an hour many are, and a slip that is
    told has to show in more than one."""
    rounding_time_s: float = 5.0
    """Over which the rounding of the wheels' paths is averaged: longer than a spin-up of a wheel."""
    path_m: float = 1e-4
    """Of a wheel's path in a bin, beside slip: what bounds the belief in the kinematics."""
    calm_time_s: float = 1.0
    """Correlation time of elastic slip: that of accelerations and bends."""
    slip_sd_mps: float = 0.3
    """Of a slipping wheel's slip velocity: between the threshold and the speeds of robots."""
    skid_sd_mps: float = 0.15
    """Of a skid's lateral velocity, likewise."""
    active_time_s: float = 1.0
    """Correlation time of slipping and of skidding. With it slip velocities change by some tenths of a m/s in
    some tenths of a second, as friction changes them."""
    unknown_sd_mps: float = 1.0
    """Of the slip velocities where no wheel speed is known: the robot may move in any way."""


WHEEL_PRIORS = WheelPriors()

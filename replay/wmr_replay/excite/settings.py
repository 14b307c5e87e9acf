"""Settings of the design of drives (``wmr_replay.excite``)."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ExciteSettings:
    """Simulation of a drive, and what separates two effects."""

    step_s: float = 0.01
    """Step of simulated poses and torques, s, and grid of a drive's knots. Numerics: the rate of the
    canonical log; four of them are a bin of the analysis."""

    wanted_bic: float = 40.0
    """Expected difference of BIC at which two effects count as separated. Judgement: four times what makes a
    verdict ambiguous (``ReportSettings.ambiguous_bic``), since ``gap`` also fits the disturbance, which takes
    part of an effect, and tests on parts of the log."""

    least_bic: float = 10.0
    """Expected difference below which a drive is not worth driving. Statistics: as
    ``ReportSettings.ambiguous_bic``."""

    most_duration_factor: float = 20.0
    """A pair for which more than so many times the allowed duration would be needed is refused. Judgement:
    an hour, where three minutes were allowed."""

    primary_weight: float = 10.0
    """Weight of a pair that is asked for, in units of a pair with the rest of the library, which must not
    explain the drive either. Judgement."""

    exchange_rounds: int = 3
    """Most rounds in which each manoeuvre may be exchanged for another. Numerics: a round that changes
    nothing ends it."""

    rest_s: float = 0.5
    """Standstill before each manoeuvre, s. Judgement: lets a robot settle, and a tracker catch up."""

    torque_share: float = 0.7
    """Share of the torque bound that a drive asks for by itself. Judgement: the rest answers the effect that
    is missing and the disturbance."""

    slack_m: float = 0.3
    """Distance that a drive keeps from the edge of its area, m. Judgement: a robot that follows speeds
    drifts by a few centimetres in a minute, and by more where an effect is strong."""

    least_margin_share: float = 0.15
    """The same in a small area, a share of its half width. Judgement."""

    usual_acceleration_mps2: float = 1.5
    """Acceleration that sets the torque bound where none is given, m/s². Judgement: brisk for a robot of 20
    to 50 kg, below what dry tyres carry."""

    rival_ratio: float = 1.5
    """Ratio of neighbouring sizes at which an effect that is not linear in its size is tried as a rival.
    Numerics: between them its signature is scaled."""

    rival_sizes: int = 2
    """How many sizes of an effect that is asked for are tried on either side of the plausible one; one of the
    others. Numerics: a factor of 2 either way; signatures beyond are those of the last size, scaled."""

    least_gain: float = 1e-3
    """Share of the criterion by which another manoeuvre must lower it. Judgement: less is not worth
    driving."""

    position_sd_m: float = 0.002
    """Pose noise where none is known, m. Judgement: between motion capture and satellite positioning."""

    yaw_sd_rad: float = 0.003
    """The same of the yaw, rad. Judgement."""

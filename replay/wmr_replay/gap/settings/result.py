"""Settings of what is reported: detectable sizes, where the gap lies, intervals."""

from dataclasses import dataclass


@dataclass(frozen=True)
class DetectableSettings:
    """The smallest size of an effect that a log would have shown."""

    level: float = 0.01
    """Level of the test whose power is computed. Statistics: ``SignificanceSettings.level``."""

    power: float = 0.9
    """Power at which a size counts as detectable: nine logs in ten. Statistics: the usual choice."""

    most_unseen: int = 4
    """Most effects of a relevant size that a log may miss and still be said to lack nothing. Patrol
    benchmark."""


@dataclass(frozen=True)
class LocateSettings:
    """Intervals, places and regimes of the largest prediction errors."""

    block_s: float = 2.0
    """Length of a block, s. Presentation: as in the tests."""

    cell_m: float = 1.0
    """Side of a cell on the path, m. Presentation: about a robot's length."""

    most_places: int = 5
    """Most intervals and most places that are listed. Presentation."""

    least_share: float = 0.05
    """Least share of the whole excess that a listed block or cell has. Presentation: twice an even share of a
    drive of 80 s."""

    quantile_bins: int = 5
    """Bins of equal share for speed, yaw rate and torque. Presentation."""

    heading_bins: int = 8
    """Bins of the heading, 45° each. Presentation."""


@dataclass(frozen=True)
class ShownSettings:
    """Tables for plots: an effect's residual against its variable, and the stretches that stand out."""

    bins: int = 16
    """Bins of equal counts. Presentation: a curve of an effect has one bend or two, and each bin of a minute
    has 3 s."""

    least_rows: int = 5
    """Fewest rows for each bin of such a table. Statistics: a median of fewer is one of them."""

    block_s: float = 4.0
    """Length of a stretch, s. Presentation: as long as the windows of the simulation."""

    stands_out: float = 3.0
    """Times the median stretch from which one stands out. Statistics: of errors like a half-normal's hardly
    any is as large."""

    most_blocks: int = 5
    """Most stretches that are listed. Presentation."""


@dataclass(frozen=True)
class ReportSettings:
    """Intervals and verdicts."""

    one_way: float = 0.01
    """Share of a speed's mean square up to which its rarer sign is not seen. Judgement: a robot that rocks
    back a little where it stops does not reverse."""

    one_sided: float = 0.2
    """A side that differs by less than this share of what the other one does is as stated. Presentation."""

    sentence_intervals: int = 2
    """Most terms of a formula that the sentence says with intervals. Presentation: a line and a half."""

    sentence_terms: int = 4
    """Most terms of a formula that the sentence says; of the others it says how many. Presentation: as
    above."""

    ambiguous_bic: float = 10.0
    """BIC difference below which another effect explains the log nearly as well. Statistics: 10 is "very
    strong" evidence after Kass and Raftery (1995)."""

    interval_tail: float = 0.025
    """Probability on either side of a reported interval. Statistics: ``ci95`` names its coverage."""

    interval_in_sd: float = 3.92
    """Width of a 95 % interval in standard deviations, for those of a model file. Statistics: 2 × 1.96, the
    normal distribution's."""

    edge_sd_s: float = 0.3
    """Standard deviation of a time that the unknown form of an edge adds, s. Patrol benchmark:
    hidden edges have other forms than the candidates'."""

    edge_sd_m: float = 0.15
    """The same for a place, m. Patrol benchmark, and the width of the candidates' softened edge."""

    flat: float = 3.84
    """Rise of −2 log likelihood up to which a time or place may lie elsewhere. Statistics: χ² with one degree
    of freedom exceeds it in 5 % of cases."""

    bump: float = 12.0
    """Rise up to which one looks beyond for a time or place as likely as the fitted one. Statistics: what is
    less likely by e⁻⁶ is over with."""

    most_steps: int = 100
    """Most steps by which a time or place is so moved, either way. Numerics: half a minute, 15 m."""

    slip_hole_s: float = 0.5
    """Rolling for less, between two slips, is of them where the interval of when traction was lost or came
    back reaches over slips, s. Physics: the instant of a switch is known to some .3 s."""

    least_blocks: int = 5
    """Fewest degrees of freedom of Student's t for the intervals. Statistics: below, the quantile grows
    beyond use."""

    bootstrap_draws: int = 999
    """Resamples of the windows for the reduction's interval. Statistics: quantiles at 2.5 % to a tenth."""

    least_windows: int = 3
    """Fewest windows for an interval of the reduction. Statistics: two have no distribution."""

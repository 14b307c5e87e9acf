"""Settings of the gates that an effect must pass."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SignificanceSettings:
    """Likelihood ratio, block-robust Wald test, placebo level."""

    component_sd: float = 2.0
    """Standard deviations from which on a component of an effect is shown. Statistics: the 95 % interval."""

    one_way: float = 0.05
    """Share of the yaw rate's mean square up to which its rarer sign is no turn the other way. Judgement:
    laps with a swerve; round a block with one turn against three it is .3."""

    level: float = 0.01
    """Level of significance, after the correction for everything scanned, and of the placebo test.
    Statistics: one false name in a hundred logs with nothing missing. The placebo's 99 draws resolve it."""

    block_s: float = 2.0
    """Length of a block, s. Statistics: several correlation times of the disturbance (0.4 s at the prior), so
    that the sums over blocks are nearly independent."""

    clip_sd: float = 6.0
    """Innovations count up to here in the block scores, standard deviations. As
    ``FilterSettings.outlier_sd``."""

    least_moved: float = 0.05
    """Share of an effect's mean squared sensitivity from which a row is said to show it. Patrol benchmark."""


@dataclass(frozen=True)
class HoldOutSettings:
    """The proof on held-out windows."""

    level: float = 0.05
    """Level of Wilcoxon's test that held-out blocks are predicted better. Statistics: the usual one; the
    effect is significant on the whole log already."""

    larger_level: float = 0.01
    """Level of the test that the gap is larger, against an effect that is. As
    ``SignificanceSettings.level``."""

    few_windows: int = 4
    """Below so many windows, none of which shows a difference, the level is stricter by
    ``few_windows_factor``. Three folds with a window each say nothing against an effect."""

    few_windows_factor: float = 5.0
    """Divisor of the level then: 0.01. As ``SignificanceSettings.level``."""

    clear: float = 1e-4
    """p of the blocks that is needed where no window shows a difference. Statistics: a hundredth of the level
    of significance."""

    clear_level: float = 0.01
    """p of the blocks that is needed where they are predicted better by ``clear_gain``. As
    ``SignificanceSettings.level``."""

    clear_gain: float = 30.0
    """Gain of the blocks in −2 log likelihood that leaves no doubt. Statistics: three times "very strong"
    after Kass and Raftery (1995); ranks do not see how much a block gains."""

    mostly_noise: float = 0.5
    """Share of the squared gap that noise of the poses makes, above which the gap is no measure. Statistics:
    more than half of it says nothing about the model."""

    least_reduction: float = 0.10
    """Least reduction of another gap. Patrol benchmark."""

    least_if_clear: float = 0.03
    """The same where the prediction leaves no doubt, and for an effect in a time or place where the gap is
    mostly noise. Patrol benchmark."""

    sure_sd: float = 1.96
    """Standard deviations by which the gap may shrink less than an effect that is there makes it, before the
    gap is asked. Statistics: that effect then passes in 97.5 % of the logs."""

    block_s: float = 2.0
    """Length of a block, s. As ``SignificanceSettings.block_s``."""

    least_moved: float = 0.5
    """Sum over a block of |change of the whitened innovations| from which the two models differ there.
    Statistics: half a standard deviation over some 150 innovations is nothing."""

    least_change: float = 0.02
    """Relative change of a window's gap from which the models differ there. Patrol benchmark."""

    most_slip: float = 0.05
    """Largest share of identified slipping in a window of the gap. Physics: an identifier's word for a loss
    of traction is no measurement; 0.2 s of 4 s lie within its switch error."""

    most_growth: float = 3.0
    """Largest growth of an error of the start in a window that says something of the model. Physics: one that
    grows by e in 2 s turns a simulation of 4 s three times as far as on a robot that rolls freely."""

    least_steady: float = 0.5
    """Least share of such windows, below which the prediction decides alone. Judgement: the others are slow
    ones, in which little shows."""

    least_seen: float = 0.1
    """Share of the information on a loss of traction in a time or place below which a fold does not fit it
    again. Statistics: its standard deviation is there more than three times that of the whole log."""

    refit_steps: int = 2
    """Gauss–Newton steps of a model on another fold. Numerics: it starts at the optimum of two thirds of the
    same rows."""


@dataclass(frozen=True)
class PlaceboSettings:
    """Logs in which nothing is missing, made by random signs."""

    draws: int = 99
    """How many. Statistics: the least p is 1/(1 + draws), which is the level 0.01."""

    block_s: float = 2.0
    """Length of a block of one sign, s. As ``SignificanceSettings.block_s``."""


@dataclass(frozen=True)
class ExcitationSettings:
    """How strongly the torques must vary for a verdict."""

    least_ratio: float = 3.0
    """Least ratio of the commanded acceleration's standard deviation to the disturbance's for a log to say
    that nothing is missing, and of what a dead zone holds back. Statistics: under feedback the torques answer
    the disturbance; its variance is then at most a ninth of what they ask for. Chosen on the benchmark's
    patrol and cruise drives."""

    manoeuvre_sd: float = 5.0
    """From so many standard deviations of the disturbance on, what the torques ask for is a manoeuvre.
    Statistics: efforts that answer a Gaussian disturbance reach it once in two million. Its level is a fit's,
    and a false effect makes it smaller: at 3, delays that are not there were seen on cruise drives."""

    afterwards_s: float = 0.5
    """How long a manoeuvre shows, s. Judgement: a pose shows an acceleration after tenths of a second."""

    answers_in_zones: tuple[float, ...] = (2.0, 3.0)
    """Sizes in widths of a dead zone up to which efforts may only answer the disturbance. Statistics: a zone
    that is not there is as wide as one or two standard deviations of the answers."""

    narrow: float = 0.5
    """Share of ``least_ratio`` up to which a dead zone is as narrow as the answers. Judgement: half as many
    standard deviations as what a log must ask for."""

    far_wider: float = 2.0
    """Multiple of ``least_ratio`` from which a dead zone is far wider than the answers. Judgement: as much
    above what a log must ask for as ``narrow`` is below."""

    clear_answers: float = 100.0
    """How much likelier than large efforts that lose nothing a zone between the two must be, in −2 log
    likelihood. Benchmark worlds, develop part, and so a Judgement: 122 to 660 where there is one."""

    level: float = 0.01
    """Level of the test in manoeuvres alone. Statistics: as ``SignificanceSettings.level``; the effect is
    significant after the correction for everything scanned already."""


@dataclass(frozen=True)
class AnswerSettings:
    """What a controller that answers the disturbance makes of a lag."""

    rates_per_s: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0)
    """Rates of the answer that are tried; the worst counts. Physics: a robot's speed loop settles within a
    second, and no faster than in some bins. The worst one's bias is at most 1.4 times that of the benchmark
    worlds' own loops, 2 and 3 (spiral drives)."""

    frequencies: int = 2000
    """Angular frequencies of the sum, up to that of the bins. Numerics: 0.04 rad/s apart."""


@dataclass(frozen=True)
class ChannelSettings:
    """What a lag of the torques must show ahead and in turning."""

    least_gain: float = 6.63
    """What one channel must be more likely by to show an effect, or less likely by to refute it, in units of
    deviance. Statistics: χ² with one degree of freedom exceeds it in 1 % of cases; an effect that is there is
    refuted in at most .5 %, however much the channel shows."""

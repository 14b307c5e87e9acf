"""Settings of the analysis of robots whose base model wheel speeds drive.

Reasons as in :mod:`wmr_replay.gap.settings`; *encoder benchmark*: chosen on the made-up drives of
``bench/encoders``, its develop half.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class LayoutSettings:
    """How logs are laid out as stretches, bins and blocks."""

    shortest_step_s: float = 0.01
    """Shortest step of the grid on which wheel speeds act, s. Physics: a robot of some kilograms does not
    change its
    speed within 10 ms."""

    longest_step_s: float = 0.05
    """Longest step of it, s. Numerics: speeds that are held longer than 50 ms are interpolated."""

    command_step_s: float = 0.02
    """Longest step of the grid for commands, which change at once, s. Physics: a lag of 50 ms shows."""

    bin_s: float = 0.2
    """Length of a bin over which poses are averaged, s. Physics: a robot of some kilograms hardly turns in
    it; half of it hides what a lidar pose of 10 Hz repeats."""

    block_s: float = 8.0
    """Longest block over which errors are correlated, s. Numerics: two windows of 4 s; the start of each
    block is free."""

    pose_gap_s: float = 1.0
    """Longest time without a pose within a stretch, s. Judgement: as a torque is held 1 s."""

    wheel_gap_s: float = 0.5
    """Longest time without a wheel speed within a stretch, s. Physics: a wheel changes its speed in half a
    second."""

    lead_s: float = 0.6
    """Time before a stretch for which wheel speeds are kept, s. Physics: the longest pose delay."""

    command_lead_s: float = 4.0
    """The same for commands, s. Physics: a lag of 1 s has forgotten its start."""

    smooth_s: float = 0.1
    """Width of the mean over which speeds are taken before they are multiplied, s. Physics: encoder counts
    of a single step are too coarse for |yaw_rate|."""

    least_rows: int = 8
    """Fewest poses of a stretch. Numerics: fewer fix no motion."""

    least_bins: int = 5
    """Fewest bins of a block. Numerics: fewer say nothing beside the free start."""

    origin_m: float = 1e-9
    """A pose nearer to (0, 0, 0) than this, in m and rad, after one that is not, begins a stretch. Physics:
    a recording of windows starts each at its origin."""


@dataclass(frozen=True)
class FitSettings:
    """Noise and parameters."""

    rounds: int = 4
    """Rounds of noise and parameters in turn. Numerics: the third changes nothing."""

    steps: int = 6
    """Gauss–Newton steps in a round. Numerics: the form is nearly linear."""

    converged_sd: float = 0.01
    """A step that moves every parameter by less than this share of its sd ends a round. Numerics."""

    clip: float = 3.5
    """Whitened errors beyond count in proportion, not squared (Huber). Statistics: 0.05 % of normal
    errors."""

    reject: float = 8.0
    """Whitened errors beyond do not count. Physics: a wheel that spins, a pose that jumps."""

    noise_evaluations: int = 160
    """Most evaluations of the likelihood in a fit of the noise. Numerics."""

    cluster_s: float = 4.0
    """Errors nearer than this are taken to be correlated in the robust covariance, s. Statistics: twice the
    time constant of the slowest disturbance that is met."""


@dataclass(frozen=True)
class GateSettingsWheelSpeed:
    """What an effect must pass."""

    level: float = 0.01
    """Level of the significance test, corrected for everything that was scanned. Statistics."""

    fitted_in_full: int = 4
    """Best candidates by score that are fitted in full. Numerics: the true one is among the best three."""

    near: float = 0.3
    """Candidates whose score is below this share of the best one's are not fitted. Numerics: a slope
    misjudges the gain of a large effect by half."""

    most_effects: int = 8
    """Most effects that are looked for. Physics: a skid-steered robot lacks five at once."""

    unit_s: float = 6.0
    """Least driving in a unit of the hold-out, s; every third unit is held out in turn. Judgement: as long
    as a step of a calibration campaign."""

    least_unit_change: float = 0.5
    """Least change of the deviance of a unit in which an effect shows. Judgement: in the others the driving
    has nothing to say of it."""

    least_unit_share: float = 0.01
    """The same as a share of the largest change of a unit. Judgement: straight on, a track that explains
    hundreds in each turn changes the deviance by one or two, by noise, and a test of ranks counts heads."""

    least_agreeing: float = 0.65
    """Share of the units that have to be likelier where there are few. Judgement: two of three."""

    few_units: int = 6
    """Fewest units in which an effect shows for a test of ranks. Statistics: that of five pairs cannot reach
    3 %."""

    few_units_gain: float = 10.0
    """Drop of the held-out deviance that decides in place of the test of ranks where there are fewer.
    Statistics: 4.5 standard deviations."""

    held_out_level: float = 0.05
    """Level of the test that held-out blocks are likelier with the effect. Statistics."""

    least_reduction: float = 0.1
    """Share by which the held-out gap has to shrink. Judgement: as for torques."""

    least_above_floor: float = 0.3
    """Share of what stands above the noise floor by which it may shrink instead. Judgement: as for
    torques."""

    least_doubtless: float = 0.02
    """Share by which it has to shrink where the test is below ``doubtless``. Judgement: as for torques."""

    least_clear: float = 0.05
    """Share by which it has to shrink where the test is below ``clear``. Judgement: on a real robot that
    repeats itself to 50 mm, an effect of p = 10⁻²⁰ narrows the gap by 6 to 8 %."""

    clear: float = 0.01
    """Level of the test of windows below which ``least_clear`` suffices. Statistics: one in a hundred, beside
    the tests of the likelihood and of the units."""

    doubtless: float = 1e-4
    """Level of the test of windows below which a small reduction suffices. Statistics: one in ten
    thousand."""

    gate_windows_s: tuple[float, ...] = (4.0, 2.0, 1.0)
    """Lengths of the windows of this gate, s; the first with enough windows is taken. Judgement: as reported,
    then shorter, since a robot that slips often drives few whole windows without."""

    enough_windows: int = 10
    """Windows that are enough. Statistics: ten pairs reach one in a thousand; most effects
    grow with the length of a window."""

    few_windows: int = 8
    """Fewest windows for their test of ranks; with fewer the reduction alone counts beside the units' test.
    Statistics: the test of seven pairs needs six of them to agree."""

    least_shown: float = 0.2
    """Share of the largest change of a window's path from which on an effect shows in a window. Judgement: in
    the others noise alone decides."""

    least_remaining: float = 0.3
    """Share of a time or a place that has to remain in a fold for its loss to be fitted there; else the loss
    is that of the whole record. Judgement: a third, less an edge."""

    least_relevant: float = 0.2
    """Least size of an effect, as a share of the size that matters in practice. Physics: every tyre creeps a
    little, every encoder is late by part of a step."""

    calibration_sd: float = 2.6
    """Standard deviations by which an effect has to differ from what a calibration gave the base model,
    those of both together. Statistics: the level of 1 %, two-sided."""

    between_logs: float = 1.5
    """Factor on the calibration's. Judgement: one log does not show how a robot differs from drive to drive;
    tracks of skid-steered ones vary by more."""

    least_lowered: float = 0.1
    """Least share by which a limit of the base model has to be lowered. Physics: a limit is known to 10 %."""

    least_units: int = 3
    """Fewest units for a verdict: one in each third. Statistics."""

    least_driven_m: float = 2.0
    """Least way that the wheels turn, m. Physics: less is nothing to calibrate."""

    most_loss_sd: float = 0.1
    """Most standard deviation of a loss in a time or a place. Judgement: that of a spinning wheel varies."""

    least_place_gain: float = 100.0
    """Least drop of the deviance by a loss in a time or a place. Judgement, on the encoder benchmark: noise
    of 5 cm lets a spin of a wheel pass for a steady loss below 50; true losses gain hundreds."""

    most_loss_sd_of_bin: float = 0.2
    """Most standard deviation of the loss of a single bin that shows one. Judgement: two thirds of the least
    loss that matters."""

    least_loss: float = 0.15
    """Least loss in a time or a place. Judgement: less is what uneven ground does."""

    least_steady_share: float = 0.45
    """Least share of these bins that move as with the common loss, in each channel. Judgement, on the encoder
    benchmark's develop families: true losses .46 to 1."""

    least_steady_s: float = 2.3
    """Least time for which they do, s. Physics: wheels that spin up on ice from standing still lose a
    constant share until they are as fast as commanded. Encoder benchmark, develop families: up to 2.2 s at a
    noise of 5 cm."""

    least_beyond_usual: float = 1.5
    """Least time for which they do, in that of every other steady slip of the record. Judgement: clearly
    longer than any."""

    least_gain_of_bin: float = 5.0
    """By how much, in −2 log likelihood, a loss is likelier than rolling in every bin of a slip. Statistics:
    a bin in twenty-five has as much by chance."""

    least_seen_s: float = 0.7
    """Least time of a slip that is a finding, of a robot which rolled on its calibration logs, s. Judgement:
    on 72 logs of strangers' robots with nothing hidden the longest lasts .6 s."""

    least_beyond_calibration: float = 2.0
    """By how many times its loss has to exceed the largest one of the calibration logs. Judgement: twice."""

    least_seen_gain: float = 60.0
    """By how much it has to be likelier than rolling. Judgement: on 83 logs of MuJoCo's two-wheeled robots
    with nothing hidden no slip lasts two bins."""

    least_seen_gain_scrubbing: float = 150.0
    """The same of a robot that scrubs, whose wheels spin in hard turns on any ground. Judgement: on 90 logs
    of MuJoCo's skid-steered robot with nothing hidden slips of any loss have up to 123."""

    least_scrubbing: float = 0.2
    """Share by which scrubbing widens the track of such a robot. Judgement: tyres of two wheels that give do
    less; four wheels about as far apart along as across double it."""

    least_slipped_gain: float = 30.0
    """From what on a calibration log slips. Judgement: half of it."""

    least_staying_behind: float = 0.5
    """Least share of the way it loses by which the robot is still behind afterwards. Judgement: half."""

    tolerance_m: float = 0.003
    """An effect counts when it moves the simulated path by more, m. ``GapOptions`` sets it."""

    tolerance_s: float = 4.0
    """In this time, s. ``GapOptions`` sets it."""

    most_unseen: int = 4
    """Most effects of a relevant size that a log may miss and still be said to lack nothing. Judgement: as
    for torques."""

    most_vague: float = 5.0
    """Most standard deviation of a calibrated parameter, in sizes that matter in practice
    (``EffectDeclaration.relevant``). Judgement: a vaguer one is no calibration."""

    least_turning_rad: float = 0.5
    """Least turning of the robot in the log, rad. Physics: less shows no track."""


@dataclass(frozen=True)
class DriveSettings:
    """How the drive is fitted to what the wheels did."""

    soft_mps: float = 0.05
    """Rim speed from which an error counts by its size and no more by its square, m/s. Physics: what a wheel
    that is controlled keeps to."""

    scale: float = 0.05
    """Least scale of a parameter in the fit, in its unit. Numerics."""

    least_change: float = 1e-5
    """Share of the cost and of the parameters by which a fit still moves. Numerics."""

    steps: int = 25
    """Most evaluations of a fit's slope. Numerics: twice what the Husky takes."""

    least_better: float = 0.005
    """Share of the errors that an effect takes away to be needed. Judgement: half a per cent."""

    level: float = 0.001
    """Level at which stretches have to be told better with an effect. Statistics: the level of the gates."""


@dataclass(frozen=True)
class ModeSettingsWheelSpeed:
    """When a wheel slips or the robot skids."""

    rounds: int = 5
    """Rounds of robust regression. Numerics: the fourth changes nothing."""

    soft: float = 2.0
    """Errors of so many standard deviations count half (Cauchy's weights). Statistics: 2.4 keeps 95 % of the
    efficiency; a fifth of the rows may slip."""

    far_out: float = 4.0
    """Slip stands out by so many robust standard deviations. Statistics: 1 row in 16000 by chance."""

    slip_mps: float = 0.05
    """Least slip velocity of a wheel, m/s. Physics: elastic slip is none; as contact modes are scored."""

    slip_share: float = 0.03
    """The same as a share of the speed. Physics: as contact modes are scored."""

    skid_mps: float = 0.03
    """Least velocity sideways of a skid, m/s. Physics: as contact modes are scored."""

    widen_bins: int = 1
    """Bins beside a slip that go with it. Numerics: the width of the difference."""

    most_masked: float = 0.6
    """Largest share of a record that may be slip; beyond, none is masked. Judgement: what happens most of the
    time is no exception."""


@dataclass(frozen=True)
class TermSettings:
    """Terms of the dictionary, which are tried beside the effects of the library."""

    least_share: float = 0.01
    """Least size of a term, as a share of the speed or the yaw rate. Physics: a tyre's elastic slip is .3 %
    of the speed where it accelerates by 1 m/s²."""

    least_share_calibrated: float = 0.1
    """The same beside a base model that was calibrated on another log. Judgement: the track that turning on
    the spot shows differs by a tenth from that of curves, on MuJoCo's skid-steered robot."""

    fitted_in_full: int = 2
    """Best terms of each channel that are fitted in full. Numerics: the motion is linear in a term."""

    most: int = 2
    """Most terms that are looked for. Judgement: three would be a table, not an explanation."""

    least_remainder: float = 0.15
    """Share of what the effects found explain that a term beside them has to explain. Judgement, as for
    torques: the wrong form of an effect leaves less."""

    least_better: float = 25.0
    """Drop of the deviance by which a term in the place of effects has to be better. Statistics: BIC of 25 is
    far beyond "very strong" (Kass and Raftery 1995)."""

    draws: int = 199
    """Placebo records. Statistics: the least p is 1/(1 + draws), half of the level."""


@dataclass(frozen=True)
class DisagreementSettings:
    """Disagreement in time or on the ground that no effect and no term explains."""

    level: float = 0.005
    """Level of the placebo on the ground. Statistics: half of the level of the verdict."""

    level_in_time: float = 0.001
    """Level of the placebo in time. Judgement, on the encoder benchmark: errors of the driving itself last
    longer than a cell; at .005, 5 % of the logs without a hidden effect passed."""

    draws: int = 999
    """Placebo records. Statistics: the least p is a fifth of the level."""

    cell_s: float = 2.0
    """Length of a cell of one sign, s. Judgement: as for torques."""

    most_cells: int = 120
    """Most cells; a longer record has longer ones. Numerics: intervals grow with their square."""

    least_cells: int = 5
    """Fewest cells of an interval. Statistics: fewer cannot keep a direction beyond chance."""

    least_push: float = 0.01
    """Least velocity of its own in an interval, m/s or rad/s. Physics: uneven ground is some mm/s."""

    least_slip: float = 0.02
    """The same as a share of the speed. Physics: as ``relevant`` of a wheel scale."""

    least_share: float = 0.1
    """Least share of the errors in an interval that its velocity explains. Judgement: as of the gap."""

    region_m: float = 2.0
    """Side of a square on the ground, m. Judgement: a robot's length or two."""

    least_visits: int = 4
    """Fewest visits of a square. Statistics: two may be one moment of slip on the way out and in, three
    two such moments by chance."""

    least_louder: float = 4.0
    """Least median square of errors in a square, in those elsewhere. Judgement, on the encoder benchmark:
    twice the size; at 2, 3 % of the logs without a hidden effect passed."""

    shift_s: float = 5.0
    """Least shift of the errors along the path, s. Physics: a moment of slip lasts less."""

    least_bins: int = 100
    """Fewest bins for a placebo by shifts. Statistics: the least p is 1/(1 + shifts)."""


@dataclass(frozen=True)
class WheelSpeedSettings:
    """All settings of the wheel-speed base."""

    layout: LayoutSettings = LayoutSettings()
    fit: FitSettings = FitSettings()
    modes: ModeSettingsWheelSpeed = ModeSettingsWheelSpeed()
    drive: DriveSettings = DriveSettings()
    terms: TermSettings = TermSettings()
    disagreement: DisagreementSettings = DisagreementSettings()
    gates: GateSettingsWheelSpeed = GateSettingsWheelSpeed()

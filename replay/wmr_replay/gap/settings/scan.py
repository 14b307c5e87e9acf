"""Settings of the scan: what a candidate's freedom costs, and where local effects are looked for."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ScanSettings:
    """Scores of candidates, and cells of time and places for losses of traction."""

    held_too: bool = False
    """Whether effects that a base model alone may hold are candidates, as while one is calibrated. Judgement:
    on another log a change of them is no finding."""

    parameter_cost: float = 8.0
    """Price of a parameter in deviance. Statistics: BIC's log n is 8.0 for the three components of
    the fitted rows of a minute (n = 3000); a scan only ranks candidates."""

    most_cells: int = 120
    """Most cells of time. Numerics: the scan's cost grows with their square."""

    least_cell_s: float = 0.5
    """Shortest cell of time, s. Patrol benchmark: some twelve rows."""

    longest_interval_s: float = 30.0
    """Longest slip interval, s. Patrol benchmark: a third of its logs; a longer loss is nearer to a
    drive gain."""

    shortest_interval_s: float = 1.0
    """Shortest slip interval, s. Statistics: two of the shortest cells, since a single
    one may be an outlier."""

    radii_m: tuple[float, ...] = (0.5, 1.0, 1.5, 2.5)
    """Radii of the patches that are tried, m. Patrol benchmark; a fit refines them."""

    disc_steps_m: tuple[float, ...] = (0.4, 0.2, 0.1, 0.05)
    """Steps in which the disc is found that is nearest to an interval, m. Numerics: from the spacing of the
    radii down to a third of the softened edge's width, 0.15 (``model.extension``)."""

    step_margin: int = 10
    """A load step is looked for outside the first and last 1/10 of the cells. Judgement: nearer to an end
    the log shows one side only, as of a payload."""

    step_loss: tuple[float, float] = (-2.0, 0.9)
    """Losses of α that a load step may have. Physics: α/(1 + p) = α (1 − loss), a mass from a third to ten
    times the nominal one."""

    local_loss: tuple[float, float] = (0.02, 1.3)
    """Losses of traction that are credible. Physics: 0 to 1, with a margin for the error of a linear
    estimate; a loss below 0.02 is not worth a fit."""

    most_local_loss: float = 0.98
    """Largest loss at which a fit starts. Numerics: at 1 nothing depends on the torques."""


@dataclass(frozen=True)
class MisfitSettings:
    """What a calibrated base model leaves on its own log, below which nothing is a finding."""

    in_sd: float = 2.0
    """Standard deviations added to a size. Statistics: a size on another log varies as well."""

    most_open: float = 100.0
    """Largest share of α that torques may hide, for where they do not vary at all. Numerics: no effect is a
    hundred times α, and a file holds it."""

    other_drives: float = 2.0
    """Largest rest on another drive, times that on the calibration log. Statistics: of the rests on 92 logs
    of 17 robots of the engine with nothing hidden (seeds from 3400000, once), 3 were larger, by little."""

    unknown_turning: float = 6.0
    """The same for a yaw damping where the calibration log does not show α_yaw. Judgement: on logs of the
    engine with nothing hidden, yaw dampings that were named had up to five times as much."""

    unknown_inertia: float = 2.5
    """The same for a yaw inertia there, of what the calibration leaves of α_yaw. Judgement: on logs of the
    engine with nothing hidden it came to 1.7 times that at most, since more of their rests are held."""

    least_share: float = 0.8
    """Least rest that a base model is given in any case, as a share of what is negligible. Judgement: of the
    effects of two-wheeled robots of the engine that were named rightly in its thirteenth report none was
    smaller; of those named where nothing was hidden some were."""

    beside: float = 1.5
    """Largest rest beside an effect that matters, times what is negligible, of effects that a calibration
    measures. Judgement: of ten second effects of the engine that were none (its twelfth report), five were
    formulas or slips, four up to one and a half times what is negligible, one larger."""

    least_beside_rests: float = 0.5
    """Least share of an effect's size that is its own where the base model's rests are fitted beside it.
    Judgement: where less is left, rests at their likeliest sizes explain most of what it does."""

    most_rests: int = 3
    """Most effects that a calibration takes into the base model beside its parameters. Judgement: one a
    channel."""

    most_of_library: int = 5
    """The same where the library has a name for each. Judgement: bearings, tyres and supports brake a robot,
    its centre of mass lies somewhere; a stranger's robot whose fourth was left out had ten times the
    disturbance, and answered for it on every other log."""

    negligible_share: float = 0.2
    """Largest rest, as a share of the size from which an effect matters in practice. Judgement: more is a
    finding; as with wheel speeds."""

    negligible_mps2: float = 0.03
    """The same for resistances that declare no such size, m/s². Judgement: a fifth of .15 m/s²."""

    negligible_per_s: float = 0.04
    """The same for friction in proportion to speed, 1/s. Judgement: a fifth of .2 1/s."""

    negligible_m: float = 0.02
    """The same for lengths, m. Judgement: where a pose was measured by hand it is off by as much."""

    lag_s: float = 0.01
    """Lag or delay at which the fit of one that a calibration log leaves starts, s. Physics: that of a quick
    motor."""

    window_s: float = 1.0
    """Windows in which a log's speeds are taken, s. Statistics: a mean speed is known to .07 m/s at 5 cm."""

    least_speed_mps: float = 0.1
    """From this mean speed on a robot moves, m/s. Statistics: 1.4 standard deviations of 5 cm noise; slower
    windows weigh little in sums over a drive."""

    most_in_form_mps2: float = 0.12
    """Largest resistance whose form is in doubt, m/s². Judgement: four times ``negligible_mps2``. Swivel
    casters leave .045 on the engine's robots; bearings of a robot of 4 kg left .09 in another form."""

    doubted_share: float = 0.5
    """From this error of α_yaw on, a lag must be shown ahead. Judgement: what else turns the robot is then .7
    times as large as what the torques ask for; swivel casters under load leave .3 to 15, plates, balls and
    light casters .03."""

    no_formula_share: float = 0.25
    """From this error of α_yaw on, no formula is said. Judgement: friction takes nearly all of the torques in
    turning, and what turns the robot beside them brakes it, in forms of its own."""

    on_casters: float = 0.12
    """Error of α_yaw at least on casters that carry load. Judgement: on sixteen of the engine's robots it is
    1 to 18 %, by the engine's own inertias, on five of them 8 or more."""

    least_swivels_mps2: float = 0.005
    """Friction of swivels that shows such casters, m/s². Judgement: on robots whose casters turn lightly a
    calibration finds .0005 to .004, and α_yaw to 1 %."""

    least_swings_mps2_rthz: float = 0.015
    """Disturbance in turning that shows them, with what they add while they swing, (m/s²)/√Hz. Judgement: on
    the engine's robots light casters, balls and plates leave .0004 to .013 and α_yaw is known to 2 %; from
    .015 on (eleven robots on loaded casters or wide tyres) it is off by 3 to 55 %."""

    dry_form: float = 0.25
    """Share to which the form of a held dry friction in turning is known. Judgement: on strangers' robots on
    balls, a skid and one caster α_yaw is off by .1 to .2 where friction takes .4 to .7 of the torques."""

    same_disturbance: float = 1.25
    """Densities of a disturbance on two logs that differ by less, a factor, are the same. Statistics: on 90 s
    one with a correlation time of 1 s is known to 9 %; two standard deviations of a ratio are a quarter."""

    times_the_disturbance: float = 5.0
    """A disturbance so many times that of the calibration log is one that nothing found explains. Judgement:
    on a stranger's four robots with nothing hidden it was up to 2.3 times as large, in the engine's
    eighteenth report more than this on one of 312 logs; a robot on ice, whose wheels were taken to skid, had
    60 times."""

    least_disturbance_mps2_rthz: float = 0.005
    """What a base model leaves counts as no less, (m/s²)/√Hz. Judgement: on balls and at 1 mm a calibration
    leaves .0001, of which any floor leaves many times as much."""

"""Settings of the likelihood: filter, disturbances, refit, calibration."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.terms import SOFT_SIGN


class FilterSettings(NamedTuple):
    """Numbers of the compiled filter; a named tuple, so that compiled code takes it as an argument."""

    slip_disturbance_mps2_rthz: float = 0.5
    """Largest random walk of v_long and w while slipping, m/s per √s. Covers what quasi-steady slip shares
    leave out. Patrol benchmark; a log's own slipping says how much of it is needed
    (``estimation.slip_disturbance``)."""

    switch_sd_mps: float = 0.05
    """Jump of v_long and w at a change of mode, m/s. Physics: an acceleration that is wrong by 1 m/s² for
    a bin of 0.04 s."""

    outlier_sd: float = 6.0
    """Largest whitened innovation that counts in full in the likelihood, in standard deviations. Statistics:
    of Gaussian ones, two in a billion are larger; a jump of the pose must not decide between models."""

    least_pair: float = 1e-6
    """Probability, before its pose, below which a pair of modes before and now is left out where modes are
    not known. Numerics: a switch within a bin of 0.04 s has 2e-3."""

    forgotten: float = 1e-12
    """Sensitivity to a loss of traction below which it is 0, in SI units. Numerics: a millimetre of noise is
    10⁹ times as large."""

    first_variance: float = 0.25
    """Variance of the first pose and speeds, (0.5 m, rad, m/s)². Statistics: wide beside what the first rows
    say, so that it does not act."""


@dataclass(frozen=True)
class DiffusionSettings:
    """Prior and bounds of the disturbances. Five numbers each: sd [m/s²] and correlation time [s] ahead, sd
    [m/s²] and correlation time [s] in yaw, sd of the lateral velocity [m/s].
    """

    start: tuple[float, ...] = (0.05, 0.4, 0.05, 0.4, 0.01)
    """Median of the prior, where a fit begins. Patrol benchmark; the wide prior lets a log say
    otherwise."""

    calm: tuple[float, ...] = (0.02, 0.4, 0.02, 0.4, 0.002)
    """A calm disturbance: what is held where a fitted one might explain a missing effect. Patrol benchmark:
    two fifths of the start's sd ahead and in yaw, a fifth sideways."""

    least: tuple[float, ...] = (1e-4, 0.05, 1e-4, 0.05, 1e-5)
    """Lower bounds. Numerics: below them the measurement noise hides a disturbance; 0.05 s is little more
    than a bin."""

    most: tuple[float, ...] = (5.0, 10.0, 5.0, 10.0, 0.5)
    """Upper bounds. Physics: 5 m/s² is half of gravity; over 10 s a disturbance is constant in a window."""

    prior_sd: float = 3.0
    """Standard deviation of the logarithms. Statistics: a factor of 20 either way, so that a minute of data
    outweighs it and an unseen disturbance stays at the start."""

    lateral_tau_s: float = 0.2
    """Correlation time of the lateral velocity without a skid, s. Physics: it decays at 5/s
    (``model.base``)."""

    large: float = 5.0
    """From this ratio of low-frequency densities to a calm disturbance's on, one is made calm. Patrol
    benchmark."""

    difference: float = 1e-3
    """Step of the differences in a logarithm. Numerics: far above rounding, far below curvature."""

    longest_step: float = 2.0
    """Longest step in a logarithm, a factor of 7. Numerics: a Gauss–Newton step is not trusted beyond it."""

    enough: float = 0.2
    """A fit ends where a step lowers the deviance by less. Statistics: a small part of a
    parameter's price in BIC, about 8."""

    first_damping: float = 1e-2
    """Levenberg's damping of the first step, a share of the curvature. Numerics."""

    damping_up: float = 30.0
    """Factor of the damping after a step that failed. Numerics."""

    damping_down: float = 3.0
    """Divisor of the damping after a step that succeeded. Numerics."""

    most_damping: float = 10.0
    """A fit ends where the damping exceeds it. Numerics: the step is a tenth of Newton's by then."""

    part_rows: int = 3000
    """Bins of the part of a long log on which a fit begins; logs of twice as many are long. Numerics: two
    minutes tell each level and time to some per cent, and Newton's step on the whole log mends the rest."""

    whole_iterations: int = 1
    """Iterations on the whole of a long log. Numerics: from some per cent off, one step of Newton's leaves
    less than a thousandth."""

    swings: tuple[float, float] = (0.0, 0.0)
    """Root densities ahead and in yaw while casters swing, (m/s²)/√Hz. Physics: none, unless the base
    model has any (``estimation.swing_disturbance``)."""

    def with_swings(self, swings: tuple[float, float]) -> "DiffusionSettings":
        """With other densities of a swing."""
        return replace(self, swings=swings)

    def with_free_swings(self, own: "SwingSettings") -> "DiffusionSettings":
        """With the densities of a swing fitted too: seven numbers each, the last two those of a swing."""
        two = (own.start_mps2_rthz,) * 2
        least, most = (own.least_mps2_rthz,) * 2, (own.most_mps2_rthz,) * 2
        numbers = {"start": two, "calm": most, "least": least, "most": most}
        return replace(self, swings=two, **{key: getattr(self, key) + more for key, more in numbers.items()})

    @cached_property
    def start_log(self) -> F64:
        """Logarithms (5,) of ``start``."""
        return np.asarray(np.log(self.start))

    @cached_property
    def calm_log(self) -> F64:
        """Logarithms (5,) of ``calm``."""
        return np.asarray(np.log(self.calm))

    @cached_property
    def bounds_log(self) -> tuple[F64, F64]:
        """Logarithms of ``least`` and ``most``, (5,) each."""
        return np.asarray(np.log(self.least)), np.asarray(np.log(self.most))


@dataclass(frozen=True)
class SwingSettings:
    """Where swivel casters may be swinging round, and how hard they push meanwhile."""

    length_m: float = 0.1
    """Distance in which a caster follows the motion but for 1/e, m. Physics: two to four trails of casters of
    robots. On four robots of the engine, .05, .1 and .2 m gain within a fifth of the same likelihood."""

    full: float = 0.2
    """Share of a half turn still to swing from which on all of the disturbance may act. Statistics: on
    these robots a step at half of it, or no bound, gains up to a tenth less."""

    least_speed_mps: float = 0.02
    """Speed from which on a robot moves, m/s. Physics: slower, a caster swings by less than its trail in a
    second."""

    seen_sd: float = 3.0
    """The same in standard deviations of the speed that poses show. Statistics: noise shows no direction."""

    start_mps2_rthz: float = 0.1
    """Median of the prior. Physics: .15 m/s² for .2 s at a time."""

    least_mps2_rthz: float = 1e-3
    """Lower bound. Numerics: poses of 1 mm do not show less."""

    most_mps2_rthz: float = 5.0
    """Upper bound. Physics: half of gravity for half a second."""

    least_gain: float = 20.0
    """Least drop of the deviance. Statistics: twice "very strong" after Kass and Raftery (1995), as
    ``SideslipSettings.least_gain``."""


@dataclass(frozen=True)
class RefitSettings:
    """Gauss–Newton on the whitened innovations."""

    clip_sd: float = 6.0
    """Innovations are clipped at so many times their usual size. Statistics: as
    ``FilterSettings.outlier_sd``."""

    normal_median: float = 0.6745
    """Median of |e| for a standard normal e, the quantile Φ⁻¹(3/4). Statistics."""

    enough: float = 0.1
    """A fit ends where a step lowers the deviance by less. Statistics: far below any threshold on gains."""

    nothing: float = 0.001
    """A step that promises to lower the deviance by less is not taken. Statistics: it is a thirtieth of a
    standard deviation."""

    linear: float = 0.1
    """Largest difference of what a step gains from what it promises, a share of that, after which the next
    step has the same sensitivities. Numerics: a slope is then off by a tenth at most, and with it a step that
    follows a far longer one."""

    dampings: tuple[float, ...] = (1.0, 0.4, 0.1)
    """Shares of a Gauss–Newton step that are tried in turn. Numerics."""


@dataclass(frozen=True)
class FormSettings:
    """What the declared forms leave open, by field of the extended model."""

    friction_speeds_mps: tuple[float, ...] = (0.005, 0.01, 0.04)
    """Speeds over which friction may change its sign beside the usual 0.02, m/s. Physics: dry contacts creep
    by mm/s before they slide, greased ones by cm/s. Bins of 0.04 s do not follow a smaller one."""

    reported_speeds_mps: tuple[float, ...] = (0.005, 0.007, 0.01, 0.014, 0.02, 0.028, 0.04)
    """The same for the interval of its size. Numerics: between those that are tried one more, so that the
    likeliest lies within a fifth of one."""

    scrub_speeds_mps: tuple[float, ...] = (0.08, 0.16)
    """Those of a wheel's rim at which the scrub of a turn may change its sign, too, m/s. Physics: a tyre that
    turns on its patch winds up before it slides, over .1 to 1 rad/s of the engine's soft contacts."""

    reported_scrub_mps: tuple[float, ...] = (0.056, 0.08, 0.11, 0.16)
    """The same for the interval of its size. Numerics: between those that are tried one more."""

    corner_shares: tuple[float, ...] = (0.1, 0.25, 0.5)
    """Shares of its threshold over which a dead zone or a limit of the torques may set in. Physics: from a
    drive's clean limit to a gear whose stiction vibration smears over the whole zone."""

    reported_shares: tuple[float, ...] = (0.0, 0.06, 0.1, 0.16, 0.25, 0.35, 0.5)
    """The same for the interval of its size. Numerics: between those that are tried one more."""

    looks: int = 2
    """Looks between the values that are tried, for the likeliest. Numerics: a spline through four values is
    off by a step of the reported ones; through those near its least, by far less than noise."""

    alike: float = 1e-4
    """Difference below which two values are one, in m/s or of a share. Numerics: nothing differs by it."""

    fine: int = 200
    """Values at which what lies between is looked up. Numerics: a tenth of what noise makes of a share."""

    @property
    def usual(self) -> dict[str, float]:
        """The values where an extended model says nothing."""
        return {"friction_speed_mps": SOFT_SIGN, "corner_share": 0.0}

    def tried(self, field: str, scrubs: bool) -> tuple[float, ...]:
        """The values of a field that a fit tries; of a friction that ``scrubs``, larger speeds, too."""
        usual = {"friction_speed_mps": self.friction_speeds_mps, "corner_share": self.corner_shares}
        return (*usual[field], *self.scrub_speeds_mps) if scrubs else usual[field]

    def reported(self, field: str, scrubs: bool) -> tuple[float, ...]:
        """The values that an interval covers."""
        usual = {"friction_speed_mps": self.reported_speeds_mps, "corner_share": self.reported_shares}
        return (*usual[field], *self.reported_scrub_mps) if scrubs else usual[field]


@dataclass(frozen=True)
class StickingSettings:
    """Dry friction in yaw that holds a robot while its torques try to turn it."""

    window_s: float = 0.2
    """Windows over which changes of the yaw rate are held against torques, s. Judgement: a turn is set in
    within some of them."""

    turning_mps: float = 0.03
    """Speed of a wheel about the robot's middle from which on it turns, m/s. Physics: a dry contact creeps by
    mm/s; noise of 5 mrad a pose makes a tenth of it in a window."""

    least_windows: int = 30
    """Least windows in which it does. Statistics: ten for each of the three that are fitted."""

    least_mps2: float = 0.03
    """Least friction that is tried, m/s². Judgement: a third of what turns a robot briskly in .3 s."""

    sign_change_mps: float = 0.0003
    """Speed over which it changes its sign, m/s. Physics: what holds does not move; MuJoCo's contacts creep
    by a tenth of a mm/s."""

    least_gain: float = 50.0
    """Least gain in deviance over the calibration without it. Judgement: three parameters more cost 25."""

    swivels_mps2: float = 0.04
    """Friction of the swivels of casters that a calibration starts from, m/s². Judgement: the engine's loaded
    casters have .03 to .09."""


@dataclass(frozen=True)
class SideslipSettings:
    """The elastic sideslip of tyres that grip."""

    iterations: int = 3
    """Iterations of the diffusion that it is estimated at. Numerics: the lateral part is held calm anyway."""

    difference: float = 0.1
    """Step of the difference, a share of the largest compliance. Numerics: v_lat is linear in it."""

    clip_sd: float = 6.0
    """Innovations count up to here. As ``FilterSettings.outlier_sd``."""

    most_s: float = 0.008
    """Largest lateral speed by lateral acceleration, s. Physics: 8 mm/s at 1 m/s², some times what tyres of
    robots show. At walking pace it looks like a pose 1 cm off the axle; more than that is no sideslip."""

    least_gain: float = 20.0
    """Least drop of the deviance. Statistics: twice "very strong" after Kass and Raftery (1995); less than
    that harms nothing."""


@dataclass(frozen=True)
class BudgetSettings:
    """Iterations that each fit may take. Numerics: a fit ends earlier where a step gains too little. Chosen
    for speed on the patrol benchmark; what larger numbers would change is to be measured.
    """

    base_diffusion: int = 8
    """Iterations of the diffusion of a base model, which starts at the prior."""

    without_diffusion: int = 6
    """Iterations of the diffusion of the model with one effect fewer."""

    diffusion: int = 5
    """Iterations of the diffusion where none of the other budgets applies."""

    best_diffusion: int = 4
    """Iterations of the diffusion for the best candidate of a scan."""

    ranked_diffusion: int = 3
    """Iterations of the diffusion for the two best fitted candidates, and for exchanged ones."""

    steps: int = 3
    """Gauss–Newton steps before the diffusion is fitted again."""

    ranked_steps: int = 1
    """The same for the two best fitted candidates, which are near their optimum already."""

    candidate_steps: int = 4
    """Gauss–Newton steps of a candidate at a fixed diffusion."""

    last_steps: int = 2
    """Gauss–Newton steps of every last or repeated fit."""

    fully_fitted: int = 2
    """How many of the fitted candidates have their diffusion fitted too: the two that are compared in fine
    bins."""


@dataclass(frozen=True)
class CalibrationSettings:
    """Calibration of a base model on a log."""

    rough_s: float = 0.5
    """Time over which speed changes are held against torques for the first α, s. Statistics: the
    noise of a second difference falls with its square; a longer time averages the torque's changes out."""

    least_skid_s: float = 3.0
    """Shortest skidding in all from which the cornering stiffness is fitted, s. Patrol benchmark."""

    rounds: int = 3
    """Turns of identifying the modes and fitting. Numerics."""

    iterations: int = 6
    """Iterations of each fit, of the diffusion and of the parameters. Numerics, as ``BudgetSettings``."""

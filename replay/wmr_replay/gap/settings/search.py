"""Settings of the search: fits of candidates, selection, contact modes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CandidateFitSettings:
    """Which scored candidates are fitted in full, and how the fits are compared. Units of deviance."""

    most_fitted: int = 6
    """Most candidates fitted in full. Patrol benchmark; each costs a fit."""

    least_gain: float = 8.0
    """Least gain that a scan must promise. Statistics: the price of one parameter,
    ``ScanSettings.parameter_cost``."""

    promising: float = 0.3
    """Least share of the best score that is still fitted. Patrol benchmark: a scan is linear, and its
    gains are rough where an effect is not."""

    least_score: float = -10.0
    """Least score of the first candidate that is fitted. Below 0, since a first effect makes the diffusion
    calmer and gains by that. Patrol benchmark."""

    least_score_later: float = 0.0
    """The same from the second effect on, where the diffusion is calm already. Statistics: it
    must promise a gain."""

    close: float = 25.0
    """Two fits closer than this are compared in bins of half the length. Patrol benchmark: lag and delay
    differ within a bin."""

    one_side: float = 0.1
    """A load step within this share of the log from an end is dropped: it would be a payload. As
    ``ScanSettings.step_margin``."""

    longest_slip_s: float = 36.0
    """A slip interval that a fit makes longer is dropped, s. Judgement: a fifth beyond
    ``ScanSettings.longest_interval_s``; a loss that lasts is a load."""

    edge_steps: tuple[float, ...] = (1.0, 0.4, 0.15)
    """Steps of the search for an edge in time and space, s or m. Numerics: from a cell of the scan down to
    the softened edge's width, 0.15 (``model.extension``)."""

    edge_gain: float = 1.0
    """What a step of that search must gain. Statistics: what a change by one standard deviation costs."""


@dataclass(frozen=True)
class SelectionSettings:
    """Forward selection and backward elimination. Gains are in units of deviance."""

    correlated: float = 0.25
    """R² from which an effect counts as correlated with those found before. Patrol benchmark."""

    share_of_rest: float = 0.5
    """Share of what an effect that the base model may leave explains, below which another one found without
    it is a part of it in another form. Judgement: what explains about as much may be the cause itself."""

    remainder_share: float = 0.15
    """Share of a found effect's gain that the wrong form of it may leave for a correlated one. Patrol
    benchmark, in which effects are hidden in other forms than their candidates."""

    strong: float = 6.0
    """Of two effects whose scores differ by less, the better one may be the other. Statistics: "strong"
    evidence after Kass and Raftery (1995)."""

    slight: float = 0.5
    """Share of the size that matters in practice, below which an effect beside a far larger one is what the
    wrong form of that leaves, correlated or not. Judgement."""

    confounded_share: float = 0.5
    """The same for two forms of one cause, actuator lag and input delay. Physics: most real lags lie between
    a lag of one pole and a delay."""

    same_stiffness: float = 0.25
    """How far a cornering stiffness may differ from what a payload's mass does, relatively. Judgement: the
    stiffness itself grows a little with the load."""

    one_place_m: float = 1.5
    """Radius of what is one place, m. Judgement: a wet patch that a robot crosses."""

    most_at_one_place: float = 0.9
    """Largest share of what shows another cornering stiffness at one place. Statistics: three drives on other
    tyres had .49 of it at most; two over a patch, all of it."""

    known_stiffness: float = 0.15
    """How far a cornering stiffness may differ, relatively, and still be the same tyre's. Judgement: load,
    inflation and wear change it by more than that, and a precise log shows a twentieth."""

    most_stiffer: float = 2.0
    """How much stiffer another tyre may be, relatively. Judgement: three times is another kind of wheel."""

    margin: float = 10.0
    """What an effect must explain beyond its price beside others. Statistics: a BIC difference of 10, "very
    strong" after Kass and Raftery (1995)."""

    margin_identified: float = 30.0
    """The same for a loss of traction in a time or place where an identifier said the modes: a wrong label
    explains as much. Patrol benchmark."""

    rival: float = 100.0
    """Fits within this score of the best are tried in its place once all effects are found. Patrol benchmark:
    an effect that is still missing distorts the score of the first."""

    most_rivals: int = 2
    """How many rivals are tried so. Numerics: each costs a fit in fine bins."""

    something_left: float = 2.0
    """From this ratio of the disturbance's density to a calm one's on, terms of the dictionary are tried.
    Patrol benchmark."""


@dataclass(frozen=True)
class ModeSettings:
    """When the contact modes of the base model are doubted."""

    much_skid: float = 0.5
    """Share of the log called skidding from which skidding is doubted. Judgement: a robot rarely skids for
    most of a drive, while a yaw that is off looks like a skid that never ends."""

    much_slip: float = 0.02
    """Share of the log called slipping from which slipping is doubted. Judgement: two seconds of ninety. What
    is found without slipping must be more likely than the slipping."""

    doubted_slip: float = 0.15
    """Share of the log called slipping from which it is doubted even where something is found beside it.
    Judgement: a drag or a damping is called slipping wherever it acts, and leaves a small rest of itself."""

    most_slip: float = 0.5
    """Share of the log called slipping from which all of it is held against rolling. Judgement: as
    ``much_skid``."""

    least_doubt: float = 10.0
    """How much likelier rolling must be, in −2 log likelihood, for a skid or slip to be taken back.
    Statistics: "very strong" after Kass and Raftery (1995)."""

    suspicious_disturbance: float = 100.0
    """From this ratio of low-frequency densities to a calm disturbance's on, what explains most beside a calm
    one is a preliminary model. Judgement: a standard deviation ten times as large, about the least of a
    slope that moves a robot by itself."""

    rival_share: float = 1 / 3
    """Share of the best score from which another candidate is a preliminary model too. Patrol benchmark."""

    most_rivals: int = 3
    """First candidates of a stage that are so considered, the best among them. Numerics: each costs a run of
    the identifier and a selection."""

    part_rows: int = 2000
    """Rows of the part of a log of twice as many or more that preliminary models come from, and that must
    show a formula beside what is named. Numerics: one selection on a whole log of ten minutes costs as much
    as a log of 90 s altogether, which are 2250 rows."""

    alike: float = 0.1
    """Two preliminary models of the same lasting effects whose sizes differ by no more, as a share, are one.
    Judgement: the identifier knows α to as much, ``alpha_sd``."""

    hopeless: float = 30.0
    """A rival that costs so much more than another solution, with modes of its own, is not selected from.
    Statistics: three times "very strong" after Kass and Raftery (1995), since effects beside it gain, too."""

    smoothed: int = 2
    """How often modes are asked of the likelihood that sums over them, each time with the disturbance that
    the modes before leave. Numerics: on seven logs to develop, a third time changed costs by up to 8."""

    far_behind: float = 120.0
    """A solution that holds and costs so much less than a selection with the labels of a preliminary model is
    the answer, before that selection is made again with slipping in place of its losses. Statistics: four
    times ``hopeless``, since one more loss is looked for in their place."""

    out_of_reach: float = 1000.0
    """A preliminary model that is so much less likely than a solution of other effects, whatever the modes,
    is left out. Judgement: of 48 logs to develop, models that were behind by up to 560 still led to the
    likeliest solution, since their sizes are found with wrong modes; none did from 580 on."""

    change_cost: float = 9.4
    """−2 ln of the probability that a mode changes in .06 s. Statistics: at .15 changes a second, the rate
    of the identifier (``BankSettings.switch_rate_per_s``)."""

    alpha_sd: float = 0.1
    """Standard deviation of ln α in the identifier where a preliminary model explains the log. Judgement: it
    knows α to that by then, and with a wider one slipping at all times explains the same as another α."""


@dataclass(frozen=True)
class UnlabelledSettings:
    """The search for effects where no row of the log has a contact mode."""

    coarse: float = 2.0
    """Length of a bin in units of the usual one. Numerics: it is a search, and half the passes' cost."""

    most_climbed: int = 6
    """Effects that are brought to their likeliest sizes. Physics: the six of the library that resist a drive
    straight ahead look alike at first."""

    most_models: int = 2
    """Most effects that are models to identify the modes with. Numerics: each costs a run of the identifier
    and a selection."""

    most_steps: int = 4
    """Most steps of an effect's sizes. Numerics: two mostly suffice."""

    enough: float = 4.0
    """Gain in −2 log likelihood below which sizes are likely enough. Numerics: a fit follows."""

    factor: float = 2.5
    """Factor between two shares of a step. Numerics."""

    least_share: float = 0.1
    """Least share of a step, and inverse of the largest. Numerics: what needs less moves nothing."""

    difference_sd: float = 0.3
    """Step of the differences about an answer, standard deviations. Numerics: far above what is rounded where
    Gaussians are merged, and below what bends."""

    least_information: float = 0.5
    """Least information that a log without labels has on a size, as a share of that with labels, of which it
    has no more than all. Numerics: less is mostly a bend between two tops, and a step by it has no end."""


@dataclass(frozen=True)
class BegunSettings:
    """What the beginning of a long log is asked for."""

    lasts_s: float = 120.0
    """Length of the beginning. Statistics: what ninety seconds name nine times of ten, two minutes do; of 36
    logs of ten minutes to develop they named 30 as the whole does, and wrongly one loss and one drag."""

    long_s: float = 360.0
    """Logs that last so long are begun so. Numerics: from three times the beginning on, that costs less than
    the preliminary models and their selections on the whole."""

    bank_bin_s: float = 0.04
    """Length of the identifier's bins on a long log, s. Numerics: that of the analysis's own bins, to which
    the modes are needed, at half the cost of the identifier's usual ones."""


@dataclass(frozen=True)
class WorkSettings:
    """How much a long log's search may ask for, and what its parts ask for, in passes of the filter over all
    rows. Numerics: what takes as long, measured on logs of ten minutes.
    """

    most: float = 1500.0
    """Passes over the whole of a long log after which nothing further is tried. Numerics: of 84 logs of ten
    minutes, 70 ask for fewer; what is under way is finished, with as many again."""

    most_at_first: float = 3000.0
    """The same over the beginning, where a pass is short. Numerics, as above."""

    of_column: float = 0.06
    """A column of sensitivities in one pass."""

    of_lane: float = 0.7
    """A pass that runs together with others."""

    of_unknown_modes: float = 14.0
    """A pass over all contact modes."""

    of_identifier: float = 140.0
    """Identifying the modes, twice through the bank."""


@dataclass(frozen=True)
class SlipSettings:
    """The test of a loss of traction against the base model's own slipping."""

    edge_s: float = 0.4
    """Left out at both ends of an interval, s. Patrol benchmark: more than the identifier's switch error
    of 0.3 s (``BinSettings.identified_switch_s``)."""

    shortest_inside_s: float = 0.3
    """Shortest inside of an interval that is tested, s. Statistics: some seven bins."""

    loss_sd: tuple[float, float] = (0.01, 0.02)
    """How far slipping's own losses of α and α_yaw may lie from quasi-steady ones, standard deviations.
    Judgement: what rounding of a robot's parameters leaves open; more than that is in the log's own
    disturbance while slipping."""

    far: float = 9.2
    """Squared distance dᵀ C⁻¹ d from which a loss differs clearly. Statistics: χ² with two degrees of
    freedom exceeds it in 1 % of cases."""

    disturbances_mps2_rthz: tuple[float, ...] = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
    """Random walks of v_long and w while slipping that are tried, m/s per √s. Numerics: factors of two and
    a half."""

    usual_mps2_rthz: float = 0.02
    """The most likely one before a log is seen. Benchmark worlds, three plants, and so a Judgement: 0.5 is
    less likely by 20 to 100 a second of slipping."""

    close_mps2_rthz: float = 0.05
    """Up to this one, slipping follows the model closely. Statistics: a factor of 2.5 above the usual one,
    its standard deviation."""

    disturbance_sd: float = 1.0
    """Standard deviation of its logarithm. Judgement: a factor of 2.7 either way."""

    most_of_one: float = 10.0
    """How much one slipping interval may speak against it, in −2 log likelihood. Statistics: "very strong"
    after Kass and Raftery (1995); two that agree outweigh the prior, and one may hide a loss of traction."""

    least_of_unknown: float = 0.3
    """Least loss that slipping has where a robot's masses are unknown. Judgement: it is taken to lose half
    (``model.base``), and of the benchmark's robots, 95 % lose more than this."""

    most_doubts: int = 2
    """Most intervals called slipping that are taken for a loss, one at a time. Numerics: each costs a
    selection."""

    hardest: float = 0.1
    """Slipping above this share of the largest torques alone may be a limit of the torques. Judgement: at
    most one row in ten that rolls is driven as hard as the least driven one that slips."""

    seen_gain: float = 500.0
    """By how much slipping of a calibrated robot must be likelier than rolling, in −2 log likelihood, to be a
    loss of traction. Statistics: "very strong" after Kass and Raftery (1995) fifty times over, for tails that
    are no Gaussian's; of logs of a contact engine with nothing hidden the largest is 434, of .4 s."""

    seen_in_s: float = 90.0
    """A log up to this length asks for no more than that, s; a longer one for √(length/this) times as much.
    Statistics: where tails fall as 1/gain², the largest of n times as many slips that are none is √n as
    large; on 25 minutes of the engine with nothing hidden it is 503."""

    close_s: float = 0.6
    """Doubtful intervals nearer to each other than this are one, s. Statistics: twice the identifier's
    switch error."""

    piece_s: float = 0.1
    """Pieces of time in which slipping may set in or end where it is held against a loss, s. Statistics:
    some two bins; a loss has ends that are fitted, and a precise pose sees a tenth of a second."""

    most_pieces: int = 120
    """Most such pieces. Numerics: the cost grows with their square."""

    least_apart: float = 0.1
    """By how much the model may be wrong about what slipping loses. A loss nearer to it than this, both ahead
    and in turning, may be slipping, however precise; another one is held against slipping that is moved
    towards it by as much in the whole log, too. Physics: what slipping leaves depends on loads and tyres that
    the model knows to some tenths; a payload of a sixth moves it by .03."""

    separate: float = 10.0
    """What a loss of traction must explain beyond slipping in its likeliest history and beyond its price, in
    −2 log likelihood. Statistics: "very strong" after Kass and Raftery (1995)."""

    separate_alike: float = 30.0
    """The same for a loss as large as slipping's, ahead or in turning. Judgement: two slips, and what lies
    between them, are one interval that saves two changes of mode, of ``ModeSettings.change_cost`` each."""

    as_large: float = 0.15
    """A loss nearer to slipping's than this is as large. Judgement: ``least_apart``, and half of it for what
    a log leaves open of an interval's own."""

    inside: float = 0.9
    """Weight of a local effect from which a row lies inside it. Judgement: the softened
    edge's upper tenth."""

    half: float = 0.5
    """Weight from which a local effect acts at all. Judgement: the edge's middle."""

    least_information: float = 1e-2
    """Information that regularises a loss, a standard deviation of 10. Numerics: a cell without torque."""

"""The result of a gap analysis; ``gap.json`` holds the same fields."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from wmr_schemas.arrays import F64
from wmr_schemas.model_file import Model, Odometry

Verdict = Literal["named", "ambiguous", "unnamed", "nothing_missing", "not_enough_excitation"]


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    ci95: tuple[float, float]
    unit: str


@dataclass(frozen=True)
class Alternative:
    """Another effect that explains nearly as much: ``delta_bic`` ≥ 0 is how much worse it is,
    ``separate_with`` the manoeuvre that tells it from the effect, empty where none is known.
    """

    name: str
    delta_bic: float
    separate_with: str = ""


@dataclass(frozen=True)
class AgainstBin:
    """A bin of the effect's variable: its bounds, the median ``at`` in it, its duration, and medians of the
    residual before and after, and of what the effect explains.
    """

    low: float
    high: float
    at: float
    seconds: float
    before: float
    after: float
    fitted: float


@dataclass(frozen=True)
class Against:
    """The residual of an effect against the variable that it follows, bins in ascending order."""

    residual_unit: str
    variable_unit: str
    rms_before: float
    rms_after: float
    bins: tuple[AgainstBin, ...]


@dataclass(frozen=True)
class FoundEffect:
    """An effect that is missing from the base model. ``confound_class`` contains its own name.

    ``residual`` is the channel in which it shows, ``variable`` the quantity of the traces that the residual
    follows.
    """

    name: str
    channel: str
    formula: str
    parameters: Mapping[str, Estimate]
    confound_class: tuple[str, ...]
    alternatives: tuple[Alternative, ...]
    p_value: float
    separate_with: str
    residual: str = ""
    variable: str = ""
    against: Against | None = None


@dataclass(frozen=True)
class Formula:
    """What terms of a dictionary add to the acceleration of a channel, as one sum.

    ``text`` has units and intervals; ``parity`` says odd, even or mixed by quantity; ``rms_mps2`` is its size
    over the log, ``visited`` the range of each quantity that it was seen over. ``against`` is the residual
    against the column ``variable`` of the traces, the one that what it explains follows most.
    """

    channel: str
    text: str
    terms: tuple[str, ...]
    parity: Mapping[str, str]
    rms_mps2: float
    visited: Mapping[str, tuple[float, float]]
    variable: str = ""
    against: Against | None = None


@dataclass(frozen=True)
class Interval:
    """A stretch of time and its share of the whole excess of prediction errors."""

    start_s: float
    end_s: float
    share: float


@dataclass(frozen=True)
class Region:
    """A disc on the path and its share of the excess."""

    x_m: float
    y_m: float
    radius_m: float
    share: float


@dataclass(frozen=True)
class Regime:
    """A bin of a regime (speed, yaw rate, torque, heading, mode): mean squared whitened prediction error of
    each channel in it, 1 where measurement noise and the fitted disturbance explain everything.
    """

    low: float
    high: float
    seconds: float
    longitudinal: float
    lateral: float
    yaw: float


@dataclass(frozen=True)
class Where:
    """``channels``: √(Q/Q_none), the disturbance that the base model needs over that of the extended one."""

    channels: Mapping[str, float] = field(default_factory=dict)
    intervals: tuple[Interval, ...] = ()
    regions: tuple[Region, ...] = ()
    regime: Mapping[str, tuple[Regime, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class TrainGap:
    """Root mean square gap over the fitted windows."""

    before: float
    after: float


@dataclass(frozen=True)
class HeldOutGap:
    """The same over the held-out windows; ``floor`` is what measurement noise alone would leave."""

    before: float
    after: float
    floor: float
    reduction_ci95: tuple[float, float]
    p_value: float


@dataclass(frozen=True)
class SlipGap:
    """Root mean square gap over the windows with slip, which the held-out gap leaves out."""

    windows: int
    before: float
    after: float


@dataclass(frozen=True)
class GapMetric:
    """The gap over windows of 4 s whose initial state is fitted; ``unit`` m or rad."""

    metric: str
    unit: str
    windows: int
    train: TrainGap
    held_out: HeldOutGap
    in_slip: SlipGap | None = None


@dataclass(frozen=True)
class StandsOut:
    """A stretch in which the extended model's path errs far more than in the median one, ``times`` it."""

    start_s: float
    end_s: float
    position_rms_m: float
    times: float


@dataclass(frozen=True)
class Remains:
    """What the extended model leaves: its held-out gaps over those that noise alone leaves, and the stretches
    that stand out, the largest error first.
    """

    position_over_floor: float
    yaw_over_floor: float
    blocks: tuple[StandsOut, ...]


@dataclass(frozen=True)
class Detectable:
    """The smallest size of an effect that the log would have shown."""

    value: float
    unit: str


@dataclass(frozen=True)
class CandidateScore:
    """A candidate that was fitted in full: ``stage`` counts the effects found before it, ``gain`` is the drop
    of the deviance, ``score`` the gain less its price; ``failed`` names the gate that it does not pass.
    """

    stage: int
    name: str
    gain: float
    score: float
    p_value: float
    failed: str = ""


@dataclass(frozen=True, eq=False)
class Traces:
    """For plots: ``t_s`` (n,) from the log's start; poses (n, 3) x, y, yaw: measured, simulated with the
    base and with the extended model (windows of 4 s, each from its own fitted start, NaN outside);
    ``base_residual``, ``extended_residual`` (n, 3): the disturbance that the filter sees, longitudinal
    [m/s²], a lateral velocity [m/s], l·yaw_acc [m/s²]; ``held_out`` (n,) 1 where the row was not fitted;
    ``quantities``: speeds and efforts by column of the traces' table, each (n,).
    """

    start_ns: int
    t_s: F64
    measured: F64
    base_path: F64
    extended_path: F64
    base_residual: F64
    extended_residual: F64
    held_out: F64
    mode: F64
    quantities: Mapping[str, F64] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class GapResult:
    """The result of one log.

    ``base`` names the source of the base model, ``unnameable`` the effects that this source rules out;
    ``notes`` give reasons and remarks.
    """

    verdict: Verdict
    sentence: str
    effects: tuple[FoundEffect, ...]
    where: Where
    position: GapMetric
    yaw: GapMetric
    modes: str
    base: str
    unnameable: tuple[str, ...]
    minimum_detectable: Mapping[str, Detectable]
    model: Model
    seed: int
    notes: tuple[str, ...]
    traces: Traces
    candidates: tuple[CandidateScore, ...] = ()
    base_model: Literal["torque", "wheel_speed"] = "torque"
    odometry: Odometry | None = None
    formulas: tuple[Formula, ...] = ()

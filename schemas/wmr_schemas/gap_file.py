"""``gap.json``: what a gap analysis found, as a file; its JSON Schema is made of the types below.

A number that is not known (or not finite) is null, never NaN.
"""

from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from wmr_schemas.errors import InvalidFile
from wmr_schemas.text import json_shown

Maybe = float | None
Probability = Annotated[float, Meta(ge=0, le=1)] | None
Size = Annotated[float, Meta(ge=0)] | None
Verdict = Literal["named", "ambiguous", "unnamed", "nothing_missing", "not_enough_excitation"]
SCHEMA_NAME = "gap.schema.json"


class Part(Struct, frozen=True, forbid_unknown_fields=True):
    """A table of the file; unknown keys are refused."""


class Estimate(Part, frozen=True):
    """A parameter with its 95 % interval."""

    value: Annotated[float | None, Meta(description="estimate")]
    ci95: Annotated[tuple[Maybe, Maybe], Meta(description="95 % interval; null where it has no bound")]
    unit: Annotated[str, Meta(description="unit of value and interval; `1` for a ratio")]


class Alternative(Part, frozen=True):
    """Another effect that explains the log, and how much worse."""

    name: Annotated[str, Meta(description="name in the catalogue")]
    delta_bic: Annotated[Size, Meta(description="BIC of the alternative minus that of the chosen effect")]
    separate_with: Annotated[
        str, Meta(description="the manoeuvre that tells it from the effect; empty where none is known")
    ] = ""


class AgainstBin(Part, frozen=True):
    """A bin of the variable; residuals are medians in it."""

    low: Annotated[float, Meta(description="least value of the variable")]
    high: Annotated[float, Meta(description="largest value")]
    at: Annotated[float, Meta(description="median value")]
    seconds: Annotated[float, Meta(ge=0, description="time spent in it")]
    before: Annotated[float, Meta(description="residual of the base model")]
    after: Annotated[float, Meta(description="residual of the extended model")]
    fitted: Annotated[float, Meta(description="what the effect explains: its fitted curve")]


class Against(Part, frozen=True):
    """The residual of an effect against the variable that it follows."""

    residual_unit: Annotated[str, Meta(description="unit of the residual")]
    variable_unit: Annotated[str, Meta(description="unit of the variable")]
    rms_before: Annotated[float, Meta(ge=0, description="residual of the base model, root mean square")]
    rms_after: Annotated[float, Meta(ge=0, description="the same, extended model")]
    bins: Annotated[tuple[AgainstBin, ...], Meta(description="of equal counts, in ascending order")]


class Effect(Part, frozen=True):
    """An effect that is missing from the base model."""

    name: Annotated[
        str, Meta(description="name in the catalogue, or `unnamed:<channel>:<term>` of a dictionary term")
    ]
    channel: Annotated[str, Meta(description="where it acts")]
    formula: Annotated[str, Meta(description="its form")]
    parameters: Annotated[dict[str, Estimate], Meta(description="its parameters, by name")]
    confound_class: Annotated[
        tuple[str, ...],
        Meta(min_length=1, description="effects that no motion can tell apart from it, itself among them"),
    ]
    alternatives: Annotated[
        tuple[Alternative, ...], Meta(description="the next best effects, and how much worse they are")
    ]
    p_value: Annotated[Probability, Meta(description="corrected for everything that was scanned")]
    separate_with: Annotated[str, Meta(description="a manoeuvre that would tell the alternatives apart")]
    residual: Annotated[
        str, Meta(description="channel of the residual in which it shows: longitudinal, lateral or yaw")
    ] = ""
    variable: Annotated[
        str, Meta(description="column of the traces that the residual follows, or `distance_m`")
    ] = ""
    against: Annotated[
        Against | None,
        Meta(description="the residual against that column, in bins; null where it is not known"),
    ] = None


class Formula(Part, frozen=True):
    """What terms of a dictionary add to the acceleration of a channel, as one sum."""

    channel: Annotated[str, Meta(description="longitudinal, lateral or yaw")]
    text: Annotated[str, Meta(description="the sum with units and 95 % intervals")]
    terms: Annotated[tuple[str, ...], Meta(description="names of its terms among `effects`")]
    parity: Annotated[
        dict[str, Literal["odd", "even", "mixed"]], Meta(description="by signed quantity that it reads")
    ]
    rms_mps2: Annotated[Size, Meta(description="root mean square over the log, m/s²")]
    visited: Annotated[
        dict[str, tuple[Maybe, Maybe]], Meta(description="range of each quantity over the log")
    ]
    variable: Annotated[
        str, Meta(description="column of the traces that what it explains follows most; empty where unknown")
    ] = ""
    against: Annotated[
        Against | None,
        Meta(description="the residual of its channel against that column, in bins; null where unknown"),
    ] = None


class Interval(Part, frozen=True):
    """A stretch of time in which the models disagree."""

    start_s: Annotated[float, Meta(description="from the log's first pose")]
    end_s: Annotated[float, Meta(description="end of the stretch")]
    share: Annotated[Size, Meta(description="of the whole excess of prediction errors")]


class Region(Part, frozen=True):
    """A disc on the path in which the models disagree."""

    x_m: Annotated[float, Meta(description="centre")]
    y_m: Annotated[float, Meta(description="centre")]
    radius_m: Annotated[float, Meta(ge=0, description="radius")]
    share: Annotated[Size, Meta(description="of the whole excess of prediction errors")]


class Regime(Part, frozen=True):
    """A bin of a regime: mean squared whitened prediction errors in it, 1 where noise explains everything."""

    low: Annotated[Maybe, Meta(description="lower edge of the bin; null: no bound")]
    high: Annotated[Maybe, Meta(description="upper edge; null: no bound")]
    seconds: Annotated[Size, Meta(description="time spent in it")]
    longitudinal: Annotated[Size, Meta(description="error of the longitudinal channel")]
    lateral: Annotated[Size, Meta(description="error of the lateral channel")]
    yaw: Annotated[Size, Meta(description="error of the yaw channel")]


class Where(Part, frozen=True):
    """Where simulation and measurement disagree."""

    channels: Annotated[
        dict[str, Size],
        Meta(description="√(Q/Q_none) of each channel: disturbance that the base model needs, over its own"),
    ]
    intervals: Annotated[tuple[Interval, ...], Meta(description="in time, the largest share first")]
    regions: Annotated[tuple[Region, ...], Meta(description="on the path, the largest share first")]
    regime: Annotated[
        dict[str, tuple[Regime, ...]],
        Meta(description="by speed, yaw rate, torque, heading and mode: bins in ascending order"),
    ]


class Train(Part, frozen=True):
    """Root mean square gap over the windows that were fitted."""

    before: Annotated[Size, Meta(description="with the base model")]
    after: Annotated[Size, Meta(description="with the extended model")]


class HeldOut(Part, frozen=True):
    """Root mean square gap over the windows that were not fitted."""

    before: Annotated[Size, Meta(description="with the base model")]
    after: Annotated[Size, Meta(description="with the extended model")]
    floor: Annotated[Size, Meta(description="what measurement noise alone would leave")]
    reduction_ci95: Annotated[
        tuple[Maybe, Maybe], Meta(description="95 % interval of 1 − after/before, windows in pairs")
    ]
    p_value: Annotated[Probability, Meta(description="that the gap shrank by chance")]


class InSlip(Part, frozen=True):
    """Root mean square gap over the windows with slip, both models under one history of contact modes."""

    windows: Annotated[int, Meta(ge=1, description="windows of the whole log that `held_out` leaves out")]
    before: Annotated[Size, Meta(description="with the base model")]
    after: Annotated[Size, Meta(description="with the extended model")]


class YawGap(Part, frozen=True):
    """The gap in yaw."""

    metric: Annotated[str, Meta(description="what was measured: `yaw_rms_4s`")]
    unit: Annotated[Literal["rad"], Meta(description="unit of the gaps")]
    windows: Annotated[int, Meta(ge=0, description="held-out windows")]
    train: Train
    held_out: HeldOut
    in_slip: InSlip | None = None


class Gap(Part, frozen=True):
    """The gap in position over windows of 4 s whose initial state is fitted; under ``yaw`` that in yaw."""

    metric: Annotated[str, Meta(description="what was measured: `position_rms_4s`")]
    unit: Annotated[Literal["m"], Meta(description="unit of the gaps")]
    windows: Annotated[int, Meta(ge=0, description="held-out windows")]
    train: Train
    held_out: HeldOut
    yaw: YawGap
    in_slip: InSlip | None = None

    @property
    def seconds(self) -> str:
        """Length of a window in s, as ``metric`` states it."""
        return self.metric.rpartition("_")[2].removesuffix("s")


class Proof(Part, frozen=True):
    """Both models on another log of the robot, of which nothing was fitted."""

    log: Annotated[str, Meta(description="the other log as it was named")]
    log_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$", description="hash of that log")]
    gap: Gap
    left_out: Annotated[
        tuple[str, ...], Meta(description="effects in an interval of the analysed log's own time")
    ] = ()


class Detectable(Part, frozen=True):
    """The smallest size of an effect that would have been seen."""

    value: Annotated[Maybe, Meta(description="size of its first parameter")]
    unit: Annotated[str, Meta(description="unit of that parameter")]


class ModelTables(Part, frozen=True, omit_defaults=True):
    """The extended model, table for table as in ``<stem>.model.toml``; empty tables are left out."""

    robot: dict[str, float | str] = {}
    noise: dict[str, float] = {}
    odometry: dict[str, float] = {}
    effects: tuple[dict[str, float | str], ...] = ()
    provenance: dict[str, str] = {}
    misfit: dict[str, float] = {}


class Asked(Part, frozen=True):
    """What the user asked for."""

    tolerance_m: Annotated[float, Meta(ge=0, description="an effect counts when it moves the path by more")]
    tolerance_s: Annotated[float, Meta(gt=0, description="over this time")]
    max_effects: Annotated[int, Meta(ge=1, description="most effects looked for")]
    clock_offset_s: Annotated[
        float, Meta(description="added to the stamps of torques and wheel speeds, s")
    ] = 0.0
    base: Annotated[str, Meta(description="base model asked for; empty: the torques'")] = ""
    input: Annotated[
        str, Meta(description="`measured` or `commands`, where wheel speeds drive the model")
    ] = ""
    given: Annotated[
        dict[str, str],
        Meta(description="`mapping` and `model` as the text of their files, `start` and `end`, where named"),
    ] = {}


class Found(Part, frozen=True):
    """What is wrong with the log's data; see the page on data quality."""

    code: Annotated[str, Meta(description="its kind, such as `torque_sign`")]
    severity: Annotated[Literal["note", "warning", "bars"], Meta(description="how much it matters")]
    text: Annotated[str, Meta(description="what was found, with its numbers")]
    meaning: Annotated[str, Meta(description="what it means for the answer")]
    advice: Annotated[str, Meta(description="what to do")]
    n: Annotated[int, Meta(ge=0, description="rows or messages concerned; 0: the log as a whole")]
    where: Annotated[
        tuple[tuple[float, float], ...], Meta(description="the first stretches, from and to in s")
    ]


class Candidate(Part, frozen=True):
    """A candidate that was fitted in full, whether it was chosen or not."""

    stage: Annotated[int, Meta(ge=0, description="effects found before it")]
    name: Annotated[str, Meta(description="name in the catalogue, or of a dictionary term")]
    gain: Annotated[Maybe, Meta(description="drop of the deviance, −2 log likelihood")]
    score: Annotated[Maybe, Meta(description="gain less the price of its parameters; the largest is tested")]
    p_value: Annotated[Probability, Meta(description="corrected for everything that was scanned")]
    failed: Annotated[str, Meta(description="the gate that it does not pass; empty where none failed")]


class StandsOut(Part, frozen=True):
    """A stretch in which the extended model's path errs more than three times the median stretch."""

    start_s: Annotated[float, Meta(description="from the log's first pose")]
    end_s: Annotated[float, Meta(description="end of the stretch")]
    position_rms_m: Annotated[Size, Meta(description="error of the simulated position, root mean square")]
    times: Annotated[Size, Meta(description="the same over that of the median stretch")]


class Remains(Part, frozen=True):
    """What the extended model leaves."""

    position_over_floor: Annotated[
        Size, Meta(description="held-out gap in position after, over what noise alone leaves: 1 is nothing")
    ]
    yaw_over_floor: Annotated[Size, Meta(description="the same in yaw")]
    blocks: Annotated[tuple[StandsOut, ...], Meta(description="stretches of 4 s, the largest error first")]


class OdometryError(Part, frozen=True):
    """Dead reckoning over held-out windows from the measured pose at their start: the error at their end."""

    seconds: Annotated[float, Meta(gt=0, description="length of a window")]
    windows: Annotated[int, Meta(ge=0, description="held-out windows")]
    position_rms_before_m: Annotated[Size, Meta(description="position, root mean square, base model")]
    position_rms_after_m: Annotated[Size, Meta(description="the same, extended model")]
    position_median_before_m: Annotated[Size, Meta(description="position, median, base model")]
    position_median_after_m: Annotated[Size, Meta(description="the same, extended model")]
    yaw_rms_before_rad: Annotated[Size, Meta(description="yaw, root mean square, base model")]
    yaw_rms_after_rad: Annotated[Size, Meta(description="the same, extended model")]


class OnBase(Part, frozen=True):
    """The answer on one base."""

    verdict: Annotated[Verdict, Meta(description="the answer in a word")]
    effects: Annotated[tuple[str, ...], Meta(description="names of what is missing, in the order found")]
    sentence: Annotated[str, Meta(description="the answer in a sentence")]


class SameCause(Part, frozen=True):
    """An effect on each base that may be one cause."""

    torque: Annotated[str, Meta(description="effect on torques")]
    wheel_speed: Annotated[str, Meta(description="effect on wheel speeds")]
    cause: Annotated[str, Meta(description="what both confound classes hold, or the effect itself")]
    sizes_agree: Annotated[
        bool | None, Meta(description="whether the 95 % intervals meet; null: sizes of different kinds")
    ]


class Bases(Part, frozen=True):
    """With `--base both`: what each base says, and what the two say together."""

    torque: OnBase
    wheel_speed: OnBase
    same: Annotated[tuple[SameCause, ...], Meta(description="pairs of effects that may be one cause")]
    disputed: Annotated[
        tuple[str, ...], Meta(description="effects that one base names and the other would have seen")
    ]
    sentence: Annotated[str, Meta(description="both answers in a sentence")]


class GapFile(Part, frozen=True):
    """The whole file."""

    verdict: Annotated[Verdict, Meta(description="the answer in a word")]
    sentence: Annotated[str, Meta(description="the answer in a sentence")]
    effects: Annotated[tuple[Effect, ...], Meta(description="what is missing, in the order found")]
    where: Where
    gap: Gap
    modes: Annotated[
        str,
        Meta(
            pattern=r"^(identified|ideal|topic:[\s\S]+)$",
            description="how the contact mode was obtained: `identified`, `ideal` or `topic:/…`",
        ),
    ]
    base: Annotated[str, Meta(description="where the base model came from")]
    unnameable: Annotated[tuple[str, ...], Meta(description="effects that this base model rules out")]
    minimum_detectable: Annotated[
        dict[str, Detectable], Meta(description="by effect: what a `nothing_missing` means")
    ]
    notes: Annotated[tuple[str, ...], Meta(description="what else a reader should know")]
    model: ModelTables
    log: Annotated[str, Meta(description="the log as it was named")]
    log_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$", description="hash of the log")]
    settings: Asked
    seed: Annotated[int, Meta(ge=0, description="of the placebo logs")]
    version: Annotated[str, Meta(description="version of wmr-replay that wrote the file")]
    findings: Annotated[tuple[Found, ...], Meta(description="what is wrong with the data")] = ()
    candidates: Annotated[
        tuple[Candidate, ...], Meta(description="what was fitted in full, by stage, the best first")
    ] = ()
    proof: Annotated[Proof | None, Meta(description="with `--prove-on`: both models on another log")] = None
    remains: Annotated[Remains | None, Meta(description="what the extended model leaves")] = None
    base_model: Annotated[
        Literal["torque", "wheel_speed"], Meta(description="what drives the base model")
    ] = "torque"
    odometry: Annotated[
        OdometryError | None,
        Meta(description="where wheel speeds drive the model: the error of dead reckoning"),
    ] = None
    bases: Annotated[
        Bases | None, Meta(description="with `--base both`: both answers, and where they agree")
    ] = None
    formulas: Annotated[
        tuple[Formula, ...], Meta(description="the terms of a dictionary among the effects, by channel")
    ] = ()
    base_log: Annotated[
        str, Meta(description="the simulator's log that the base model was calibrated on; else empty")
    ] = ""
    base_log_sha256: Annotated[
        str, Meta(pattern="^([0-9a-f]{64})?$", description="hash of that log; else empty")
    ] = ""


def gap_to_json(gap: GapFile) -> str:
    """The text of the file; :func:`read_gap` gives the same back."""
    return json_shown(msgspec.json.format(msgspec.json.encode(gap), indent=2).decode()) + "\n"


def read_gap(path: Path) -> GapFile:
    """Read and check a ``gap.json``. Raises InvalidFile naming the place at fault."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=GapFile)
    except OSError as error:
        raise InvalidFile(path, "", f"cannot be read ({error.strerror})") from None
    except msgspec.ValidationError as error:
        problem, _, place = str(error).partition(" - at `")
        raise InvalidFile(path, place.removesuffix("`"), problem) from None
    except msgspec.DecodeError as error:
        raise InvalidFile(path, "", f"is not JSON: {error}") from None


def gap_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) that the types above amount to."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "gap.json"}
    return head | msgspec.json.schema(GapFile)


def committed_schema() -> dict[str, Any]:
    """The schema as it lies beside this module, for those who read ``gap.json`` elsewhere."""
    text = files("wmr_schemas").joinpath(SCHEMA_NAME).read_bytes()
    schema: dict[str, Any] = msgspec.json.decode(text)
    return schema

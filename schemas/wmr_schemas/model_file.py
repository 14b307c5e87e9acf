"""``model.toml``: a robot, its noise, the effects beyond the base model, and the model's provenance."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from wmr_schemas.effects import FRICTIONS, UNNAMED_PREFIX, WITHHOLDING, catalogue
from wmr_schemas.errors import InvalidFile, InvalidTerm
from wmr_schemas.robot import RobotParameters, described
from wmr_schemas.slip_terms import is_slip_term, parse_slip_term
from wmr_schemas.terms import COEFFICIENT, parse_term
from wmr_schemas.text import toml_shown
from wmr_schemas.tomlfile import check_keys, expect_table, expect_text, read_toml


@dataclass(frozen=True)
class NoiseModel:
    """Pose noise (standard deviation of a sample) and disturbance (diffusion by channel)."""

    position_sd_m: float | None = field(
        default=None, metadata=described("m", "standard deviation of a pose sample in x and in y")
    )
    yaw_sd_rad: float | None = field(
        default=None, metadata=described("rad", "standard deviation of a pose sample in yaw")
    )
    disturbance_longitudinal_mps2_rthz: float | None = field(
        default=None, metadata=described("(m/s²)/√Hz", "white disturbance on dv_long/dt")
    )
    disturbance_lateral_mps2_rthz: float | None = field(
        default=None, metadata=described("(m/s²)/√Hz", "white disturbance on dv_lat/dt")
    )
    disturbance_yaw_mps2_rthz: float | None = field(
        default=None, metadata=described("(m/s²)/√Hz", "white disturbance on half_track_m·d(yaw_rate)/dt")
    )
    swing_longitudinal_mps2_rthz: float | None = field(
        default=None,
        metadata=described("(m/s²)/√Hz", "white disturbance on dv_long/dt while swivel casters swing round"),
    )
    swing_yaw_mps2_rthz: float | None = field(
        default=None, metadata=described("(m/s²)/√Hz", "the same on half_track_m·d(yaw_rate)/dt")
    )
    slip_longitudinal_mps_rthz: float | None = field(
        default=None,
        metadata=described("(m/s)/√Hz", "slip velocity ahead, where wheel speeds drive the model"),
    )
    slip_lateral_mps_rthz: float | None = field(
        default=None, metadata=described("(m/s)/√Hz", "slip velocity sideways, likewise")
    )
    slip_yaw_radps_rthz: float | None = field(
        default=None, metadata=described("(rad/s)/√Hz", "error of the yaw rate, likewise")
    )


@dataclass(frozen=True)
class Effect:
    """One effect with its parameters, and their standard deviations where they were fitted.

    A friction c tanh(v/v₀) may have a ``sign_change_mps`` v₀ of its own, at which it has three quarters of
    its size; None for 2 cm/s. A dead zone and a limit of the torques may have a ``corner_share``, the share
    of their threshold over which they set in; None for at once.
    """

    name: str
    parameters: dict[str, float]
    sd: dict[str, float] = field(default_factory=dict)
    formula: str = ""
    sign_change_mps: float | None = None
    corner_share: float | None = None


class FormKey(NamedTuple):
    """What effects may say of their form: which effects, what all of them are, what it is, in or of what."""

    effects: tuple[str, ...]
    kind: str
    quantity: str
    unit: str


FORM_KEYS = {
    "sign_change_mps": FormKey(FRICTIONS, "frictions", "speed", "in m/s"),
    "corner_share": FormKey(WITHHOLDING, "dead zones and limits", "share", "of the threshold"),
}


@dataclass(frozen=True)
class Provenance:
    """Where a model came from."""

    log_sha256: str = field(
        default="", metadata=described("–", "hash of the log that the model was fitted to")
    )
    version: str = field(default="", metadata=described("–", "version of wmr-replay that wrote the file"))
    command: str = field(default="", metadata=described("–", "the command line that wrote it"))
    settings: str = field(
        default="", metadata=described("–", "of a fit: JSON, enough to repeat it with `--config`")
    )
    base_model: str = field(
        default="",
        metadata=described("–", "`wheel_speed` where wheel speeds drive the model; else torques do"),
    )
    base_log: str = field(
        default="",
        metadata=described("–", "the simulator's log that the base was calibrated on, where there is one"),
    )
    base_log_sha256: str = field(default="", metadata=described("–", "hash of that log"))
    base_effects: str = field(
        default="",
        metadata=described("–", "JSON: the effects that the simulator itself shows, as in `[[effects]]`"),
    )


@dataclass(frozen=True)
class Odometry:
    """Error of dead reckoning from wheel speeds over windows that were held out, before and after."""

    seconds: float = field(metadata=described("s", "length of a window; each starts at its measured pose"))
    windows: float = field(metadata=described("–", "held-out windows"))
    position_rms_before_m: float = field(
        metadata=described(
            "m", "error of the position at a window's end by the nominal robot, root mean square"
        )
    )
    position_rms_after_m: float = field(metadata=described("m", "the same by the calibrated robot"))
    position_median_before_m: float = field(metadata=described("m", "the median, nominal"))
    position_median_after_m: float = field(metadata=described("m", "the median, calibrated"))
    yaw_rms_before_rad: float = field(
        metadata=described("rad", "error of the yaw, root mean square, nominal")
    )
    yaw_rms_after_rad: float = field(metadata=described("rad", "the same, calibrated"))


@dataclass(frozen=True)
class Model:
    """The contents of a model file."""

    robot: RobotParameters = RobotParameters()
    robot_sd: dict[str, float] = field(default_factory=dict)
    noise: NoiseModel = NoiseModel()
    effects: tuple[Effect, ...] = ()
    provenance: Provenance = Provenance()
    odometry: Odometry | None = None
    misfit: dict[str, float] = field(default_factory=dict)


def read_model(path: Path) -> Model:
    """Read and check a model file. Raises InvalidFile naming the key at fault."""
    tables = read_toml(path)
    check_keys(path, "", tables, ("robot", "noise", "effects", "provenance", "odometry", "misfit"))
    robot, robot_sd = split_sd(path, "[robot]", expect_table(path, "[robot]", tables.get("robot", {})))
    noise = expect_table(path, "[noise]", tables.get("noise", {}))
    check_keys(path, "[noise]", noise, (f.name for f in fields(NoiseModel)))
    provenance = expect_table(path, "[provenance]", tables.get("provenance", {}))
    check_keys(path, "[provenance]", provenance, (f.name for f in fields(Provenance)))
    effects = parse_effects(path, tables.get("effects", []))
    return Model(
        robot=RobotParameters.from_values(robot, str(path)),
        robot_sd=robot_sd,
        noise=NoiseModel(
            **{key: non_negative(path, f"[noise] {key}", value) for key, value in noise.items()}
        ),
        effects=effects,
        provenance=Provenance(
            **{key: expect_text(path, f"[provenance] {key}", value) for key, value in provenance.items()}
        ),
        odometry=parse_odometry(path, tables.get("odometry")),
        misfit=parse_misfit(path, expect_table(path, "[misfit]", tables.get("misfit", {}))),
    )


def parse_misfit(path: Path, table: Mapping[str, Any]) -> dict[str, float]:
    """The ``[misfit]`` table: a size by effect."""
    check_keys(path, "[misfit]", table, catalogue())
    return {key: non_negative(path, f"[misfit] {key}", value) for key, value in table.items()}


def parse_odometry(path: Path, entry: object) -> Odometry | None:
    """The ``[odometry]`` table, complete or not there."""
    if entry is None:
        return None
    table = expect_table(path, "[odometry]", entry)
    wanted = [f.name for f in fields(Odometry)]
    check_keys(path, "[odometry]", table, wanted)
    missing = [key for key in wanted if key not in table]
    if missing:
        raise InvalidFile(path, "[odometry]", f"lacks {', '.join(missing)}")
    return Odometry(**{key: non_negative(path, f"[odometry] {key}", table[key]) for key in wanted})


def parse_effects(path: Path, entries: object) -> tuple[Effect, ...]:
    """The ``[[effects]]``; frictions that change their sign over different speeds, or thresholds with
    different corners, are no model.
    """
    if not isinstance(entries, list):
        raise InvalidFile(path, "effects", "expected [[effects]], an array of tables")
    effects = tuple(parse_effect(path, index, entry) for index, entry in enumerate(entries))
    for key, form in FORM_KEYS.items():
        if len({getattr(effect, key) for effect in effects if effect.name in form.effects}) > 1:
            message = f"one {form.quantity} serves all {form.kind} of a model"
            raise InvalidFile(path, f"[[effects]] {key}", message)
    return effects


def friction_speed_mps(effects: Iterable[Effect]) -> float:
    """The speed over which the frictions among the effects change their sign; 0 for the usual one."""
    return next((effect.sign_change_mps for effect in effects if effect.sign_change_mps is not None), 0.0)


def corner_share(effects: Iterable[Effect]) -> float:
    """The share of their thresholds over which a dead zone and a limit set in; 0 for at once."""
    return next((effect.corner_share for effect in effects if effect.corner_share is not None), 0.0)


def parse_effect(path: Path, index: int, entry: object) -> Effect:
    """One ``[[effects]]`` table against the catalogue."""
    place = f"[[effects]] #{index + 1}"
    table = dict(expect_table(path, place, entry))
    name = table.pop("name", None)
    if not isinstance(name, str) or (name not in catalogue() and not name.startswith(UNNAMED_PREFIX)):
        known = ", ".join(catalogue())
        raise InvalidFile(path, f"{place} name", f"{name!r} is no effect; known are {known}")
    formula = expect_text(path, f"{place} formula", table.pop("formula", ""))
    form = parse_form(path, f"{place} ({name})", name, table)
    values, sd = split_sd(path, place, table)
    wanted = parameters_of(path, place, name)
    check_keys(path, f"{place} ({name})", values, wanted)
    optional = catalogue()[name].absent if name in catalogue() else {}
    missing = [key for key in wanted if key not in values and key not in optional]
    if missing:
        raise InvalidFile(path, f"{place} ({name})", f"lacks {', '.join(missing)}")
    sizes = {key: number(path, f"{place} {key}", value) for key, value in values.items()}
    return Effect(name, sizes, sd, formula, **form)


def parse_form(path: Path, place: str, name: str, table: dict[str, Any]) -> dict[str, float]:
    """The keys of :data:`FORM_KEYS` of an effect, taken out of its table."""
    found: dict[str, float] = {}
    for key, form in FORM_KEYS.items():
        if name not in form.effects or key not in table:
            continue
        found[key] = number(path, f"{place} {key}", table.pop(key))
        if found[key] <= 0:
            message = f"expected a {form.quantity} above 0 {form.unit}, found {found[key]!r}"
            raise InvalidFile(path, f"{place} {key}", message)
    return found


def parameters_of(path: Path, place: str, name: str) -> tuple[str, ...]:
    """Names of an effect's parameters; an unnamed effect must be a term of the dictionary."""
    if name in catalogue():
        return tuple(catalogue()[name].parameters)
    try:
        (parse_slip_term if is_slip_term(name) else parse_term)(name)
    except InvalidTerm as error:
        raise InvalidFile(path, f"{place} name", str(error)) from error
    return (COEFFICIENT,)


def split_sd(path: Path, place: str, table: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float]]:
    """Values and their ``…_sd``, which need a value of the same name."""
    values = {key: value for key, value in table.items() if not key.endswith("_sd")}
    sd: dict[str, float] = {}
    for key, value in table.items():
        if key.endswith("_sd"):
            base = key.removesuffix("_sd")
            if base not in values:
                raise InvalidFile(path, f"{place} {key}", f"stands without {base}")
            sd[base] = non_negative(path, f"{place} {key}", value)
    return values, sd


def number(path: Path, key: str, value: object) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidFile(path, key, f"expected a number, found {value!r}")
    return float(value)


def non_negative(path: Path, key: str, value: object) -> float:
    """A finite number that is not below 0."""
    result = number(path, key, value)
    if result < 0:
        raise InvalidFile(path, key, f"expected a number not below 0, found {value!r}")
    return result


def model_to_toml(model: Model) -> str:
    """The text of a model file; ``read_model`` gives the same model back."""
    return toml_shown(tomli_w.dumps(model_tables(model)))


def model_tables(model: Model) -> dict[str, Any]:
    """The tables of a model file, without those that are empty."""
    tables: dict[str, Any] = {"robot": with_sd(model.robot.known(), model.robot_sd)}
    tables["noise"] = {key: value for key, value in vars(model.noise).items() if value is not None}
    tables["provenance"] = {key: value for key, value in vars(model.provenance).items() if value}
    tables["odometry"] = {} if model.odometry is None else vars(model.odometry)
    tables["misfit"] = dict(model.misfit)
    tables["effects"] = [effect_table(effect) for effect in model.effects]
    return {key: value for key, value in tables.items() if value}


def with_sd(values: Mapping[str, float | str], sd: Mapping[str, float]) -> dict[str, float | str]:
    """Each value followed by its standard deviation, where there is one."""
    table: dict[str, float | str] = {}
    for key, value in values.items():
        table[key] = value
        if key in sd:
            table[f"{key}_sd"] = sd[key]
    return table


def effect_table(effect: Effect) -> dict[str, float | str]:
    """One ``[[effects]]`` table."""
    table: dict[str, float | str] = {"name": effect.name}
    if effect.formula:
        table["formula"] = effect.formula
    table |= with_sd(effect.parameters, effect.sd)
    return table | {key: value for key in FORM_KEYS if (value := getattr(effect, key)) is not None}

"""What a caller asks of a replay: settings, a model, a mapping, a part of the log."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeAlias, TypedDict

from wmr_replay.api.places import LocalPlace, local_path
from wmr_replay.ingest import Between
from wmr_replay.pipeline.settings import DEFAULT_SHAPE, Settings
from wmr_schemas import mapping_file, model_file
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model

ModelLike: TypeAlias = Model | LocalPlace
"""A model, or the path of a model file (``model.toml``)."""
MappingLike: TypeAlias = LogMapping | LocalPlace
"""A mapping, or the path of a mapping file (``robot.toml``)."""
Instant: TypeAlias = str | float
"""Seconds from the log's first message, seconds or nanoseconds since 1970, or a time of ISO 8601."""


KERNEL_SHAPE = ("degree", "kappa", "mu", "theta")


class SettingsArguments(TypedDict, total=False):
    """The fields of ``Settings`` as keyword arguments."""

    window_s: float | None
    degree: int
    kappa: int
    mu: int
    theta: float
    identifier: str
    evidence: str
    min_confidence: float
    simultaneous: bool
    threshold_sd: float
    min_c_k_mps: float
    min_c_d_mps2: float
    min_sideslip: float | None
    target_a_long_sd_mps2: float
    tune: bool
    max_delay_s: float | None
    tuning_stretch_s: float
    initial_stretch_s: float
    noise_time_constant_s: float
    hindsight: bool
    hindsight_lag_s: float
    reorder_window_s: float
    max_hold_s: float
    clock_offset_s: float


def settings_of(given: Mapping[str, Any]) -> Settings:
    """The settings with these values. Raises InvalidSetting for an unknown name or a bad value."""
    known = [field.name for field in fields(Settings)]
    for name in given:
        if name not in known:
            raise InvalidSetting(f"no setting {name!r}; the settings are {', '.join(known)}")
    return Settings(**untuned(given))


def untuned(given: Mapping[str, Any]) -> dict[str, Any]:
    """The same without tuning, where the default's shape of a kernel is given and nothing is said of tuning.

    Another shape is never tuned; that of the default, given on purpose, is as much a choice.
    """
    shape = tuple(given.get(name, value) for name, value in zip(KERNEL_SHAPE, DEFAULT_SHAPE, strict=True))
    chosen = any(name in given for name in KERNEL_SHAPE) and shape == DEFAULT_SHAPE
    return {**given, "tune": False} if chosen and "tune" not in given else dict(given)


def read_model(path: LocalPlace) -> Model:
    """Read and check a model file (``model.toml``). Raises InvalidFile naming the key at fault."""
    return model_file.read_model(local_path(path))


def read_mapping(path: LocalPlace) -> LogMapping:
    """Read and check a mapping file (``robot.toml``). Raises InvalidFile naming the key at fault."""
    return mapping_file.read_mapping(local_path(path))


def model_of(given: ModelLike | None) -> Model | None:
    """The model, read from its file where a path was given."""
    return given if given is None or isinstance(given, Model) else read_model(given)


def mapping_of(given: MappingLike | None) -> LogMapping | None:
    """The mapping, read from its file where a path was given."""
    return given if given is None or isinstance(given, LogMapping) else read_mapping(given)


def between_of(start: Instant | None, end: Instant | None) -> Between:
    """The limits in log time."""
    first, last = (None if limit is None else str(limit) for limit in (start, end))
    return Between(first, last)

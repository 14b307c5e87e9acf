"""A gap analysis as ``gap.json`` holds it: checked against the file's types, NaN and infinities as null."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

import msgspec

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.remains import remains_of
from wmr_replay.gap.result.result import GapResult
from wmr_schemas import __version__
from wmr_schemas.findings import Finding
from wmr_schemas.gap_file import GapFile
from wmr_schemas.model_file import model_tables


def document_of(
    result: GapResult,
    options: GapOptions,
    log: str,
    log_sha256: str,
    findings: Iterable[Finding] = (),
    asked: Mapping[str, Any] = {},
) -> GapFile:
    """The file's contents; ``asked``: further keys of its settings.

    Raises msgspec.ValidationError for a result that no file may hold.
    """
    same = ("verdict", "sentence", "modes", "base", "unnameable", "notes", "seed")
    contents = {name: getattr(result, name) for name in same} | {
        "effects": [asdict(effect) for effect in result.effects],
        "where": asdict(result.where),
        "gap": asdict(result.position) | {"yaw": asdict(result.yaw)},
        "minimum_detectable": {name: asdict(least) for name, least in result.minimum_detectable.items()},
        "model": model_tables(result.model),
        "log": log,
        "log_sha256": log_sha256,
        "settings": {
            "tolerance_m": options.tolerance_m,
            "tolerance_s": options.tolerance_s,
            "max_effects": options.max_effects,
            **asked,
        },
        "version": __version__,
        "findings": [found.as_dict() for found in findings],
        "base_model": result.base_model,
        "odometry": None if result.odometry is None else asdict(result.odometry),
        "formulas": [asdict(formula) for formula in result.formulas],
        "remains": asdict(remains_of(result.position, result.yaw, result.traces)),
        "candidates": [asdict(candidate) for candidate in result.candidates],
    }
    return msgspec.json.decode(msgspec.json.encode(contents, enc_hook=plain), type=GapFile)


def plain(value: object) -> object:
    """A number of numpy as one of Python."""
    item = getattr(value, "item", None)
    if item is None:
        raise NotImplementedError(f"{type(value).__name__} has no place in gap.json")
    return item()

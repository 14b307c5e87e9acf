"""The options that a result was made with, out of its file: the same call again."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wmr_schemas.errors import InvalidFile

TEXTS = {"mapping": "map", "model": "model"}
"""What a result states as the text of a file, and the option that names such a file."""
DECIDING = frozenset(
    {"modes", "tolerance", "max_effects", "seed", "clock_offset_s", "model_file", "start", "end"}
    | {"base", "inputs"}
    | {"map", "pose", "torque", "truth", "clock"}
)
"""Parameters of commands that decide an answer, besides the settings of a run. A result states all of them,
so that one that it leaves out was not given.
"""


class FileText(str):
    """The text of a file that an option names: it is written to a temporary file for the call."""

    __slots__ = ()


def stored_options(path: Path, content: Mapping[str, Any]) -> dict[str, Any]:
    """Options by key, of ``<stem>.summary.json`` or ``<stem>.gap.json``. Raises InvalidFile for others."""
    settings = content.get("settings")
    if not isinstance(settings, dict):
        raise InvalidFile(
            path, "settings", "is missing: this is neither <stem>.summary.json nor <stem>.gap.json"
        )
    return (
        gap_options(content, settings)
        if "verdict" in content and "effects" in content
        else run_options(settings)
    )


def model_options(path: Path, content: Mapping[str, Any]) -> dict[str, Any]:
    """Options by key, of the ``<stem>.model.toml`` of a fit. Raises InvalidFile for another model."""
    provenance = content["provenance"]
    text = provenance.get("settings") if isinstance(provenance, dict) else None
    if not text:
        raise InvalidFile(
            path,
            "[provenance] settings",
            "is missing: a fit states it; a gap's options are in <stem>.gap.json",
        )
    try:
        settings = json.loads(text)
        return fit_options(settings, settings["modes"])
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InvalidFile(path, "[provenance] settings", f"cannot be understood ({error})") from None


def run_options(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Those of a run: its settings, and what else it was given."""
    from wmr_replay.api.request import SettingsArguments

    known = {name: settings[name] for name in SettingsArguments.__annotations__ if name in settings}
    return {name: value for name, value in known.items() if value is not None} | given_options(settings)


def gap_options(content: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Those of a gap analysis."""
    options = {
        "tolerance": f"{1e3 * settings['tolerance_m']:.15g}:{settings['tolerance_s']:.15g}",
        "max-effects": settings["max_effects"],
        "seed": content["seed"],
    }
    return options | fit_options(settings, content["modes"])


def fit_options(settings: Mapping[str, Any], modes: str) -> dict[str, Any]:
    """Those that a gap analysis and a calibration share."""
    shift = settings.get("clock_offset_s", 0.0)
    asked = {name: settings[name] for name in ("base", "input") if settings.get(name)}
    return {"modes": modes, "clock-offset": shift} | asked | given_options(settings)


def given_options(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Mapping, model and limits."""
    given = settings.get("given") or {}
    options: dict[str, Any] = {name: given[name] for name in ("start", "end") if given.get(name)}
    return options | {option: FileText(given[name]) for name, option in TEXTS.items() if given.get(name)}

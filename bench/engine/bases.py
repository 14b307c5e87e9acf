"""Calibrated base models, kept in files that the processes of a run share.

A file is kept for one state of the analysis, the engine's robots and its controller: after any change every
robot is calibrated once more.
"""

import hashlib
import os
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from engine.case import Case
from wmr_schemas.model_file import Model, model_to_toml, read_model

HERE = Path(__file__).parent
KEPT = HERE.parent / "results" / "bases"
PRODUCT = HERE.parents[1]
SOURCES = (PRODUCT / "replay" / "wmr_replay", PRODUCT / "schemas", PRODUCT / "synth", HERE)


@cache
def state() -> str:
    """Hash of every source that a calibration may depend on."""
    found = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted(path for ending in ("*.py", "*.xml") for path in folder.rglob(ending)):
            found.update(path.read_bytes())
    return found.hexdigest()[:16]


def kept(cases: Sequence[Case], make: Callable[[], Model]) -> Model:
    """The base model of calibration cases, made where no file of this state has it."""
    name = "+".join(f"{case.key.replace('/', '.')}.{case.duration_s:g}" for case in cases)
    path = KEPT / state() / f"{name}.toml"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = path.with_suffix(f".{os.getpid()}")
        whole.write_text(model_to_toml(make()), encoding="utf-8")
        whole.replace(path)
    return read_model(path)

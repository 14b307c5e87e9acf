"""The vocabulary that the simulator and the replay share.

Signals (:mod:`~wmr_schemas.signals`), contact modes, robot parameters, model and mapping files, the messages
of the canonical log, the result tables, and errors that carry facts. Nothing here imports the other packages.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wmr_schemas.modes import ContactMode, ModeSet
    from wmr_schemas.robot import PAPER_ROBOT, RobotParameters
    from wmr_schemas.signals import CommandTrack, Log, ModeTrack, PoseTrack, TorqueTrack, WheelSpeedTrack
    from wmr_schemas.status import Status

__version__ = "0.1.0"

__all__ = [
    "PAPER_ROBOT",
    "CommandTrack",
    "ContactMode",
    "Log",
    "ModeSet",
    "ModeTrack",
    "PoseTrack",
    "RobotParameters",
    "Status",
    "TorqueTrack",
    "WheelSpeedTrack",
    "__version__",
]

_HOMES = {
    "CommandTrack": "signals",
    "ContactMode": "modes",
    "Log": "signals",
    "ModeSet": "modes",
    "ModeTrack": "signals",
    "PAPER_ROBOT": "robot",
    "PoseTrack": "signals",
    "RobotParameters": "robot",
    "Status": "status",
    "TorqueTrack": "signals",
    "WheelSpeedTrack": "signals",
}


def __getattr__(name: str) -> Any:
    """The name out of its module, imported on first use: ``wmr-replay --help`` needs no numpy."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

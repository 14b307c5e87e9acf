"""Log replay for wheeled mobile robots: contact modes and α out of MCAP logs.

    import wmr_replay as wr

    result = wr.run("log.mcap")
    result.segments, result.summary, result.samples.collect()
    result.plot()
    result.save("results/")

Every name is imported on first use, so that ``import wmr_replay`` costs nothing. ``wr.gap``, ``wr.report``,
``wr.excite`` and ``wr.differentiate`` are functions, although packages of these names hold what they call:
import from the packages with ``from wmr_replay.gap import …``.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from wmr_schemas import __version__

if TYPE_CHECKING:
    from wmr_replay.api.batch import batch
    from wmr_replay.api.check import Check, check
    from wmr_replay.api.compare import Comparison, compare, compare_all
    from wmr_replay.api.convert import Converted, convert, convert_bag
    from wmr_replay.api.design import Design, design
    from wmr_replay.api.differentiate import Derivative, differentiate
    from wmr_replay.api.excite import Excitation, excite
    from wmr_replay.api.export import export
    from wmr_replay.api.fit import Fit, fit
    from wmr_replay.api.gap import Gap, gap
    from wmr_replay.api.info import LogInfo
    from wmr_replay.api.log import LogFile, Signals, open_log
    from wmr_replay.api.places import URL
    from wmr_replay.api.pose_derivatives import PoseDerivatives, differentiate_pose
    from wmr_replay.api.request import read_mapping, read_model
    from wmr_replay.api.result import Result
    from wmr_replay.api.run import replay, run
    from wmr_replay.api.stored import plot, report
    from wmr_replay.api.suite import suite, suites, verify_suite
    from wmr_replay.api.synthesise import Synthetic, hidden_effects, scenarios, synthesise
    from wmr_replay.api.viewer import screenshot, serve, view
    from wmr_replay.pipeline.settings import Settings
    from wmr_schemas.mapping_file import LogMapping
    from wmr_schemas.model_file import Model
    from wmr_schemas.modes import ContactMode, ModeSet
    from wmr_schemas.robot import RobotParameters
    from wmr_schemas.signals import CommandTrack, Log, ModeTrack, PoseTrack, TorqueTrack, WheelSpeedTrack
    from wmr_schemas.status import Status

__all__ = [
    "URL",
    "Check",
    "CommandTrack",
    "Comparison",
    "ContactMode",
    "Converted",
    "Derivative",
    "Design",
    "Excitation",
    "Fit",
    "Gap",
    "Log",
    "LogFile",
    "LogInfo",
    "LogMapping",
    "ModeSet",
    "ModeTrack",
    "Model",
    "PoseDerivatives",
    "PoseTrack",
    "Result",
    "RobotParameters",
    "Settings",
    "Signals",
    "Status",
    "Synthetic",
    "TorqueTrack",
    "WheelSpeedTrack",
    "__version__",
    "batch",
    "check",
    "compare",
    "compare_all",
    "convert",
    "convert_bag",
    "design",
    "differentiate",
    "differentiate_pose",
    "excite",
    "export",
    "fit",
    "gap",
    "hidden_effects",
    "open_log",
    "plot",
    "read_mapping",
    "read_model",
    "replay",
    "report",
    "run",
    "scenarios",
    "screenshot",
    "serve",
    "suite",
    "suites",
    "synthesise",
    "verify_suite",
    "view",
]

_HOMES = {
    "wmr_replay.api.batch": "batch",
    "wmr_replay.api.check": "Check check",
    "wmr_replay.api.compare": "Comparison compare compare_all",
    "wmr_replay.api.convert": "Converted convert convert_bag",
    "wmr_replay.api.design": "Design design",
    "wmr_replay.api.differentiate": "Derivative differentiate",
    "wmr_replay.api.excite": "Excitation excite",
    "wmr_replay.api.export": "export",
    "wmr_replay.api.fit": "Fit fit",
    "wmr_replay.api.gap": "Gap gap",
    "wmr_replay.api.info": "LogInfo",
    "wmr_replay.api.log": "LogFile Signals open_log",
    "wmr_replay.api.places": "URL",
    "wmr_replay.api.pose_derivatives": "PoseDerivatives differentiate_pose",
    "wmr_replay.api.request": "read_mapping read_model",
    "wmr_replay.api.result": "Result",
    "wmr_replay.api.run": "replay run",
    "wmr_replay.api.stored": "plot report",
    "wmr_replay.api.suite": "suite suites verify_suite",
    "wmr_replay.api.synthesise": "Synthetic hidden_effects scenarios synthesise",
    "wmr_replay.api.viewer": "screenshot serve view",
    "wmr_replay.pipeline.settings": "Settings",
    "wmr_schemas.mapping_file": "LogMapping",
    "wmr_schemas.model_file": "Model",
    "wmr_schemas.modes": "ContactMode ModeSet",
    "wmr_schemas.robot": "RobotParameters",
    "wmr_schemas.signals": "CommandTrack Log ModeTrack PoseTrack TorqueTrack WheelSpeedTrack",
    "wmr_schemas.status": "Status",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}


class _Package(ModuleType):
    """A package in which a submodule does not take the place of the function of the same name."""

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute, unless the import system binds the submodule ``gap`` or ``differentiate``."""
        if not (name in _HOME_OF and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

"""The vocabulary that the simulator and the replay share.

Signals (:mod:`~wmr_schemas.signals`), contact modes, robot parameters, model and mapping files, the messages
of the canonical log, the result tables, and errors that carry facts. Nothing here imports the other packages.
"""

from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.robot import PAPER_ROBOT, RobotParameters
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack
from wmr_schemas.status import Status

__version__ = "0.1.0"

__all__ = [
    "PAPER_ROBOT",
    "ContactMode",
    "Log",
    "ModeSet",
    "ModeTrack",
    "PoseTrack",
    "RobotParameters",
    "Status",
    "TorqueTrack",
    "__version__",
]

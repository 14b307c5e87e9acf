"""The vocabulary that the simulator and the replay share.

Signals (:mod:`~wmr_schemas.signals`), contact modes, robot parameters, model and mapping files, the messages
of the canonical log, the result tables, and errors that carry facts. Nothing here imports the other packages.
"""

from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import PAPER_ROBOT, RobotParameters
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack

__version__ = "0.1.0"

__all__ = [
    "PAPER_ROBOT",
    "ContactMode",
    "Log",
    "ModeTrack",
    "PoseTrack",
    "RobotParameters",
    "TorqueTrack",
    "__version__",
]

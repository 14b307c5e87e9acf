"""The identifier of the contact mode and of α. Pure: numpy and numba alone."""

from wmr_replay.identify.interface import Evidence, Identifier, Verdict
from wmr_replay.identify.motion import Motion, Slip, motion_of, wheel_slip
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, Rules, make_rules

__all__ = [
    "Evidence",
    "Identifier",
    "Motion",
    "PaperIdentifier",
    "Rules",
    "Slip",
    "Verdict",
    "make_rules",
    "motion_of",
    "wheel_slip",
]

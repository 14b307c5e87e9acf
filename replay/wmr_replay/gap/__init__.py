"""Where simulation and measurement disagree, what is missing, and how much smaller the gap is with it."""

from wmr_replay.gap.analyse import analyse, calibrate
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import GapResult

__all__ = ["GapOptions", "GapResult", "analyse", "calibrate"]

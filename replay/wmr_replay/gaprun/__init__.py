"""A gap analysis from file to files: the log whole, the analysis in memory, its results written together."""

from wmr_replay.gaprun.command import FitRun, GapRun, fit_log, gap_log
from wmr_replay.gaprun.document import document_of

__all__ = ["FitRun", "GapRun", "document_of", "fit_log", "gap_log"]

"""The result tables: columns into polars, Parquet and the summary."""

from wmr_replay.tables.calibration import CalibrationCollector
from wmr_replay.tables.files import SMALL, ParquetStream, write_parquet
from wmr_replay.tables.names import MODE_DTYPE, with_names
from wmr_replay.tables.runs import ModeRuns, RunCollector
from wmr_replay.tables.samples import hindsight_frame, samples_frame
from wmr_replay.tables.score import Score, confusion_frame, score_runs
from wmr_replay.tables.segments import SegmentCollector, with_seconds

__all__ = [
    "MODE_DTYPE",
    "SMALL",
    "CalibrationCollector",
    "ModeRuns",
    "ParquetStream",
    "RunCollector",
    "Score",
    "SegmentCollector",
    "confusion_frame",
    "hindsight_frame",
    "samples_frame",
    "score_runs",
    "with_names",
    "with_seconds",
    "write_parquet",
]

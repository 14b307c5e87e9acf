"""Data quality: what stands between the columns of a log and a verdict on its contact modes.

Every monitor is a stage: rows in, in order, and for each row the status that bars its answer, or ``OK``. A
row's status depends on no later row and not on the batches. What a monitor found it states as
:class:`~wmr_schemas.findings.Finding`.
"""

from wmr_replay.quality.interface import Monitor, Observed
from wmr_replay.quality.monitors import Quality
from wmr_replay.quality.stretches import Stretches

__all__ = ["Monitor", "Observed", "Quality", "Stretches"]

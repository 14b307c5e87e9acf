"""Whether a log's data can carry an analysis of the whole log: the monitors of a replay, asked beforehand."""

from dataclasses import replace

import numpy as np

from wmr_replay.ingest import LogPath
from wmr_replay.ingest.tracks import WholeLog
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import NO_IDENTIFIER, Settings
from wmr_schemas.arrays import I8
from wmr_schemas.errors import LogUnusable
from wmr_schemas.findings import KINDS, Finding, Severity
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_schemas.status import BARRING, Status

MOST_BARRED = 0.5
"""Share of the rows after warm-up; what is left of a log beyond is no log to name an effect on."""
TORQUE_FACTOR = ("torque_unit",)
"""What bars an analysis by torques wherever it was found: with torques many times too large the model
foresees accelerations that never come, which it calls slips, and the monitor does not count slips."""


def checked_findings(
    path: LogPath, whole: WholeLog, robot: RobotParameters, bars_anywhere: tuple[str, ...] = ()
) -> tuple[Finding, ...]:
    """What is wrong with the data of a log, by the parameters of ``robot``.

    Raises LogUnusable with the finding's own words where findings bar more than half of the rows, where signs
    or units are found to be wrong at the log's end – they do not change within a log –, or where one of the
    codes ``bars_anywhere`` bars a row.
    """
    status, found = replayed_status(replace(whole.log, robot=robot))
    findings = (*whole.findings, *found)
    barring = [f for f in findings if f.severity == Severity.BARS]
    rows = status[status != Status.WARMING_UP]
    if not barring or not len(rows):
        return findings
    barred = np.isin(rows, list(BARRING))
    anywhere = any(f.code in bars_anywhere for f in barring)
    if barred.mean() <= MOST_BARRED and rows[-1] != Status.IMPLAUSIBLE and not anywhere:
        return findings
    labels = {KINDS[f.code].bars: f for f in reversed(barring)}
    most = Status(int(np.bincount(rows[barred]).argmax()))
    worst = labels.get(most, barring[0])
    raise LogUnusable(path, f"{worst.code}: {worst.text}; {worst.meaning}", f"{worst.advice}.")


def replayed_status(log: Log) -> tuple[I8, list[Finding]]:
    """The status (n,) of each row of a replay of a log in memory, and what its monitors found.

    No modes are identified.
    """
    settings = Settings(identifier=NO_IDENTIFIER, hindsight=False, tune=False)
    engine = Engine(settings, ReplayModel(log.robot))
    batches = [*engine.push(as_batch(log)), *engine.finish()]
    return np.concatenate([columns["status"] for columns in batches]), engine.findings

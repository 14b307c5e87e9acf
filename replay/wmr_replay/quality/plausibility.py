"""Signs and units of pose, torques and wheel speeds, held against one another.

What is only probable is a warning. A finding bars the rows from its detection on where an answer would be
wrong: torques against the motion, a pose in other units.
"""

from collections.abc import Mapping

import numpy as np

from wmr_replay.quality import sign_text, unit_text
from wmr_replay.quality.cells import Cells, Means
from wmr_replay.quality.interface import Observed
from wmr_replay.quality.judgement import CODES, Comparisons, judge
from wmr_replay.quality.ratios import WheelVotes
from wmr_replay.quality.response import TorqueResponse
from wmr_replay.quality.snapshot import Snapshot, snapshot
from wmr_replay.quality.stretches import Stretches
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_replay.quality.turning import PathVotes
from wmr_schemas.arrays import I8, Bool
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import Status

TEXTS = {
    "yaw_unit": unit_text.yaw_unit,
    "position_unit": unit_text.position_unit,
    "half_track": unit_text.half_track,
    "wheel_speed_unit": unit_text.wheel_speed_unit,
    "torque_unit": unit_text.torque_unit,
    "torque_sign": sign_text.torque_sign,
    "sides_swapped": sign_text.sides_swapped,
    "wheel_speed_sign": sign_text.wheel_speed_sign,
}


class PlausibilityMonitor:
    """Monitor: rows → ``IMPLAUSIBLE`` from the row on at which signs or units are found to be wrong.

    It decides at the first row of each half second, on sums over all rows before.
    """

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._cells, self._wheels, self._path = Cells(sums), WheelVotes(sums), PathVotes(sums)
        self._response = TorqueResponse()
        self._found, self._bars = np.zeros(len(CODES), bool), np.zeros(len(CODES), bool)
        self._barred = [Stretches() for _ in CODES]
        self._last: list[Snapshot | None] = [None] * len(CODES)
        self.barred: Mapping[str, Bool] = {}

    def push(self, rows: Observed) -> I8:
        """The status (n,) that bars each row."""
        with np.errstate(all="ignore"):  # what is not finite is left out where it is summed up
            begins, means = self._cells.push(rows)
            decided = self._decide(means, rows.robot)
        bars = np.concatenate([self._bars[:, None], decided], axis=1)
        self._bars = bars[:, -1]
        edges = np.concatenate([[0], begins, [len(rows.t_ns)]])
        at = np.repeat(bars, np.diff(edges), axis=1)
        self.barred = dict(zip(CODES, at, strict=True))
        for stretches, marked in zip(self._barred, at, strict=True):
            stretches.push(rows.t_s, marked)
        return np.where(at.any(axis=0), Status.IMPLAUSIBLE, Status.OK).astype(np.int8)

    def _decide(self, means: Means, robot: RobotParameters) -> Bool:
        """Which code bars (codes, m) after each cell; what was found last is kept for the findings."""
        if not len(means.t_s):
            return np.zeros((len(CODES), 0), bool)
        wheels, path = self._wheels.push(means, robot), self._path.push(means)
        compared = Comparisons(wheels, path, self._response.push(means), robot)
        judged = judge(compared)
        self._found = judged.found[:, -1]
        for k, cells in enumerate(judged.found):
            if cells.any():
                self._last[k] = snapshot(compared, judged, int(np.flatnonzero(cells)[-1]))
        return judged.bars

    def findings(self) -> list[Finding]:
        """What holds now; what has barred rows before only where nothing that bars has taken its place."""
        told, replaced = [], bool((self._found & self._bars).any())
        for k, code in enumerate(CODES):
            last, barred = self._last[k], self._barred[k]
            if last is None or not (self._found[k] or (barred.n and not replaced)):
                continue
            severity = Severity.BARS if barred.n or self._bars[k] else Severity.WARNING
            text, advice = TEXTS[code](last)
            told.append(finding(code, severity, text, barred.n, barred.where, advice))
        return told

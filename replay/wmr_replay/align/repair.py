"""Outliers and jumps of the pose, before anything is differentiated.

A sample is compared with a straight line through the last few good ones. It is rejected when its distance
exceeds what noise and any motion of a wheeled robot explain (``jumps.gates``). The first rejected sample may
be an outlier or the start of a jump; its status is ``outlier``. If a later sample agrees with the line, the
rejected ones were outliers. If 4 in a row agree with one another instead, the pose has jumped, and the last
of them is ``pose_jump``. Jumps too small for single samples are found in groups (``jumps.hidden_step``), with
a longer delay.

A jump is a rigid motion: a turn about the robot and a shift. Later poses are transformed by its inverse, so
that velocities in the robot's frame stay exact whatever the error of the turn. The windows restart, since the
shift is known to about σ only: this error is a step, and would appear in C_k at 2 to 4 of its standard
deviations for the length of a window, as a skid that did not happen.

The smallest jump that is found, at the best of m = 16, 64, 256, is about (5 to 5.5) 2.8 σ/√m + .09 s h +
.42 h², h = m·step, at speed s (.5 m/s at least): .4 m at σ = .316 m and 1 kHz, 5 cm at σ = 1 mm and 100 Hz,
both at 1 m/s.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.align.batch import SampleBatch
from wmr_replay.align.carried import CarriedInputs
from wmr_replay.align.exact import judge_rows
from wmr_replay.align.jumps import GROUPS
from wmr_replay.align.quiet import follow_quiet
from wmr_replay.align.state import N_JUMPS, N_OUTLIERS, Rules, fresh_memory

GROUP_SPAN_S = 1.3
LONGEST_GAP_S = 0.5


def rules_for(step_s: float) -> Rules:
    """The rules for a pose that comes every ``step_s``."""
    n_groups = sum(2 * m * step_s <= GROUP_SPAN_S for m in GROUPS)
    n_line = min(8, max(4, round(0.06 / step_s)))
    return Rules(step_s, n_line, n_groups, max(LONGEST_GAP_S, 3 * step_s))


class PoseRepair:
    """Stage: measured rows → the same rows with outliers marked and jumps taken out; none is held back."""

    def __init__(self, *, step_s: float, position_sd_m: float, yaw_sd_rad: float) -> None:
        self._rules = rules_for(step_s)
        self._memory = fresh_memory(position_sd_m, yaw_sd_rad)
        self._carried = CarriedInputs()

    def change_rate(self, step_s: float, position_sd_m: float, yaw_sd_rad: float) -> None:
        """The pose comes every ``step_s`` from the next row on, with this noise."""
        self._rules = rules_for(step_s)
        self._memory.variances[:] = position_sd_m**2, yaw_sd_rad**2

    @property
    def n_jumps(self) -> int:
        """Number of jumps of the pose so far."""
        return int(self._memory.counts[N_JUMPS])

    @property
    def n_outliers(self) -> int:
        """Number of outliers so far."""
        return int(self._memory.counts[N_OUTLIERS])

    def push(self, rows: SampleBatch) -> SampleBatch:
        """The same rows with ``pose``, ``inputs`` and ``repair`` filled in; stamps strictly increase.

        Frozen rows pass by. The inputs of rows that are left out are added to those of the next kept row.
        """
        rows = replace(rows, inputs=self._carried.push(rows))
        frozen = rows.frozen
        if not frozen.any():
            return self._judged(rows)
        judged, kept = self._judged(rows.part(~frozen)), ~frozen
        pose, inputs, repair = rows.pose_raw.copy(), rows.inputs.copy(), rows.repair.copy()
        pose[:, kept], inputs[:, kept], repair[kept] = judged.pose, judged.inputs, judged.repair
        return replace(rows, pose=pose, inputs=inputs, repair=repair)

    def _judged(self, rows: SampleBatch) -> SampleBatch:
        """Rows of which none is frozen."""
        measured = np.ascontiguousarray(rows.pose_raw)
        inputs, status, poses = rows.inputs.copy(), np.zeros(len(rows), np.int8), np.empty_like(measured)
        m, rules, t_ns = self._memory, self._rules, rows.t_ns
        row, hides = follow_quiet(
            m.counts, m.held, m.variances, m.frame, m.last, rules, 0, t_ns, measured, poses
        )
        if hides or row < len(t_ns):
            judge_rows(m, rules, row, hides, t_ns, measured, inputs, status, poses)
        return replace(rows, pose=poses, inputs=inputs, repair=status)

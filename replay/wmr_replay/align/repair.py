"""Outliers and jumps of the pose, before anything is differentiated.

A sample is compared with a straight line through the last few good ones, and dissents when it lies further
off than noise and any motion of a wheeled robot explain (``jumps.gates``). At the first such sample nobody
can know whether it is an outlier or the pose has jumped: it is set aside as ``outlier``. When a sample agrees
with the line again, that was all. When 4 in a row agree with one another instead, the pose has jumped, and
that row is ``pose_jump``. Jumps too small for single samples are found in groups (``jumps.hidden_step``),
somewhat later.

After a jump, poses are carried back by the rigid motion that the jump was – a turn about the robot and a
shift, so that velocities in the robot's own frame stay exact whatever the error of the turn – and the windows
restart. They must: the shift is known to about σ only, and this error, a step, would stand in C_k at 2 to 4
of its standard deviations for the length of a window: a skid that never was.

Found are, at the best of m = 16, 64, 256, jumps above about (5 to 5.5) 2.8 σ/√m + .09 s h + .42 h², h =
m·step, at speed s (.5 m/s at least): .4 m at σ = .316 m and 1 kHz, 5 cm at σ = 1 mm and 100 Hz, both at 1
m/s.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.align.batch import SampleBatch
from wmr_replay.align.frame import carry_back, take_out
from wmr_replay.align.jumps import AGREEING, GROUPS, agree, distance, gates, hidden_step, inside, offsets
from wmr_replay.align.quiet import follow_quiet
from wmr_replay.align.state import (
    ANCHOR_NS,
    LAST_NS,
    N_GOOD,
    N_HELD,
    N_JUMPS,
    N_OUTLIERS,
    N_PENDING,
    N_ROWS,
    Memory,
    Rules,
    fresh_memory,
)
from wmr_replay.align.track import CAPACITY, follow_noise, make_room, put
from wmr_schemas.arrays import F64, I8, I64
from wmr_schemas.compiled import compiled
from wmr_schemas.status import Status

OK, POSE_JUMP, OUTLIER = Status.OK, Status.POSE_JUMP, Status.OUTLIER
"""Outcomes of a row."""
GROUP_SPAN_S = 1.3
LONGEST_GAP_S = 0.5


@compiled
def take_up(counts: I64, held: F64, t_ns: int, pose: F64) -> None:
    """One more good sample."""
    if counts[N_HELD] == CAPACITY:
        counts[ANCHOR_NS] += round(make_room(held) * 1e9)
        counts[N_HELD] = CAPACITY // 2
    if counts[N_HELD] == 0:
        counts[ANCHOR_NS] = t_ns
    put(held, counts[N_HELD], (t_ns - counts[ANCHOR_NS]) * 1e-9, pose[0], pose[1], pose[2])
    counts[N_HELD] += 1
    counts[N_GOOD] += 1


@compiled
def start_again(m: Memory, t_ns: int, pose: F64) -> int:
    """Forget what came before this row."""
    m.counts[N_HELD] = m.counts[N_PENDING] = 0
    m.counts[N_JUMPS] += 1
    take_up(m.counts, m.held, t_ns, pose)
    return POSE_JUMP


@compiled
def set_aside(m: Memory, t_s: float, pose: F64) -> None:
    """One more dissenting sample; the last four are kept."""
    n = m.counts[N_PENDING]
    if n == AGREEING:
        n -= 1
        m.pending[:, :n] = m.pending[:, 1:].copy()
    m.pending[0, n] = t_s
    m.pending[1:, n] = pose
    m.counts[N_PENDING] = n + 1


@compiled
def is_back(m: Memory, t_s: float, pose: F64) -> bool:
    """Whether a sample lies inside the gate, nearer to the line than to the last one that dissented."""
    here = distance(pose, m.lines, np.zeros(3), m.gate)
    n = m.counts[N_PENDING]
    if here > 1.0 or n == 0:
        return here <= 1.0
    offsets(m.pending[:, n - 1 :], 1, t_s, m.lines, m.found)
    return here <= distance(pose, m.lines, m.found[0], m.gate)


@compiled
def judge_unusual(m: Memory, rules: Rules, t_ns: int, pose: F64, predictable: bool) -> int:
    """A row without a prediction, or one that dissents, or one after some that did."""
    t_s, n_held = (t_ns - m.counts[ANCHOR_NS]) * 1e-9, m.counts[N_HELD]
    if predictable and not is_back(m, t_s, pose):
        set_aside(m, t_s, pose)
        n = m.counts[N_PENDING]
        offsets(m.pending, n, t_s, m.lines, m.found)
        if n < AGREEING or not agree(m.found[1], m.lines, t_s - m.pending[0, 0], m.variances):
            return OUTLIER
        take_out(m.frame, pose, m.found[0])
        return start_again(m, t_ns, pose)
    if not predictable and n_held and t_s - m.held[n_held - 1, 0] > rules.longest_gap_s:
        if m.counts[N_PENDING]:
            return start_again(m, t_ns, pose)
        m.counts[N_HELD] = 0
    m.counts[N_PENDING] = 0
    take_up(m.counts, m.held, t_ns, pose)
    return OK


@compiled
def is_usual(counts: I64, held: F64, variances: F64, rules: Rules, t_s: float, lines: F64, gate: F64) -> int:
    """1 where a sample can be predicted and nothing is pending, 0 where something is, −1 without a
    prediction.
    """
    n = counts[N_HELD]
    if n < rules.n_line or t_s - held[n - 1, 0] > rules.longest_gap_s:
        return -1
    gates(held, n, rules.n_line, t_s, variances, lines, gate)
    return 0 if counts[N_PENDING] else 1


@compiled
def carry_inputs(waiting: F64, inputs: F64, i: int, dt_s: float, outcome: int) -> None:
    """Inputs are means over the time since the row before; rows set aside leave theirs to the next."""
    if outcome == OUTLIER:
        for k in range(4):
            waiting[k] += inputs[k, i] * dt_s
        waiting[4] += dt_s
    elif waiting[4] > 0.0:
        for k in range(4):
            inputs[k, i] = (waiting[k] + inputs[k, i] * dt_s) / (waiting[4] + dt_s)
        waiting[:] = 0.0


@compiled
def find_step(m: Memory, rules: Rules, t_ns: int, pose: F64) -> int:
    """A good row, just taken up: whether it shows that the pose has jumped before it."""
    n, count = m.counts[N_HELD], m.counts[N_GOOD]
    if not hidden_step(m.held, n, count, rules.n_groups, m.variances, m.before, m.after):
        return OK
    take_out(m.frame, pose, m.after[0] - m.before[0])
    return start_again(m, t_ns, pose)


@compiled
def judge_row(m: Memory, rules: Rules, t_ns: int, pose: F64, repeated: bool) -> int:
    """Outcome of one row by the exact tests; ``pose`` may change."""
    if repeated:
        return OUTLIER if m.counts[N_PENDING] else OK
    t_s = (t_ns - m.counts[ANCHOR_NS]) * 1e-9
    usual = is_usual(m.counts, m.held, m.variances, rules, t_s, m.lines, m.gate)
    if usual != 1 or not inside(pose, m.lines, m.gate):
        return judge_unusual(m, rules, t_ns, pose, usual >= 0)
    take_up(m.counts, m.held, t_ns, pose)
    follow_noise(m.held, m.counts[N_HELD], rules.step_s, m.variances)
    return find_step(m, rules, t_ns, pose)


@compiled
def judge_rows(m: Memory, rules: Rules, t_ns: I64, measured: F64, inputs: F64) -> tuple[I8, F64]:
    """Outcome of each row (n,) and its pose carried back (3, n); ``inputs`` (4, n) change in place.

    A pose that is repeated to the bit is a held one: it goes on as it came, and says nothing new.
    """
    counts, last = m.counts, m.last
    outcome, poses, pose = np.zeros(len(t_ns), np.int8), np.empty_like(measured), np.empty(3)
    i = 0
    while i < len(t_ns):
        i, hides = follow_quiet(m, rules, i, t_ns, measured, poses)
        if hides:
            pose[:] = poses[:, i - 1]
            outcome[i - 1] = find_step(m, rules, t_ns[i - 1], pose)
            poses[:, i - 1] = pose
        elif i < len(t_ns):
            stamp, row = t_ns[i], measured[:, i]
            repeated = row[0] == last[0] and row[1] == last[1] and row[2] == last[2]
            last[:] = row
            carry_back(m.frame, last, pose)
            now = judge_row(m, rules, stamp, pose, repeated)
            since_s = (stamp - counts[LAST_NS]) * 1e-9 if counts[N_ROWS] else 0.0
            carry_inputs(m.waiting, inputs, i, since_s, now)
            outcome[i], poses[:, i] = now, pose
            counts[LAST_NS] = stamp
            counts[N_ROWS] += 1
            counts[N_OUTLIERS] += now == OUTLIER
            i += 1
    return outcome, poses


class PoseRepair:
    """Stage: measured rows → the same rows with outliers marked and jumps taken out; none is held back."""

    def __init__(self, *, step_s: float, position_sd_m: float, yaw_sd_rad: float) -> None:
        n_groups = sum(2 * m * step_s <= GROUP_SPAN_S for m in GROUPS)
        n_line = min(8, max(4, round(0.06 / step_s)))
        self._rules = Rules(step_s, n_line, n_groups, max(LONGEST_GAP_S, 3 * step_s))
        self._memory = fresh_memory(position_sd_m, yaw_sd_rad)

    @property
    def n_jumps(self) -> int:
        """Jumps so far."""
        return int(self._memory.counts[N_JUMPS])

    @property
    def n_outliers(self) -> int:
        """Rows set aside so far."""
        return int(self._memory.counts[N_OUTLIERS])

    def push(self, rows: SampleBatch) -> SampleBatch:
        """The same rows with ``pose``, ``inputs`` and ``repair`` filled in; stamps strictly increase.

        An outlier's inputs are added to those of the next kept row.
        """
        inputs = rows.inputs.copy()
        measured = np.ascontiguousarray(rows.pose_raw)
        status, pose = judge_rows(self._memory, self._rules, rows.t_ns, measured, inputs)
        return replace(rows, pose=pose, inputs=inputs, repair=status)

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

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_replay.align.aligner import AlignedBatch
from wmr_replay.align.frame import carry_back, take_out
from wmr_replay.align.jumps import AGREEING, GROUPS, agree, distance, gates, hidden_step, inside, offsets
from wmr_replay.align.track import CAPACITY, follow_noise, fresh_track, make_room, put
from wmr_schemas.arrays import F64, I8, I64, Bool

OK, POSE_JUMP, OUTLIER = 0, 7, 8
"""Outcomes, as positions in ``wmr_schemas.tables.Status``."""
GROUP_SPAN_S = 1.3
LONGEST_GAP_S = 0.5
N_HELD, N_GOOD, N_PENDING, N_JUMPS, N_OUTLIERS, N_ROWS, ANCHOR_NS, LAST_NS = range(8)


class Memory(NamedTuple):
    """What is carried from row to row, changed in place.

    ``counts`` (8,); the track ``held`` and the ``variances`` (2,) of position and yaw; the last dissenting
    samples ``pending`` (4, 4) t, x, y, yaw; ``frame`` (3,) turn and shift that carry a measured pose back;
    ``last`` (3,) the pose measured last; ``waiting`` (5,) inputs of rows set aside times their seconds, and
    these. The rest is scratch.
    """

    counts: I64
    held: F64
    variances: F64
    pending: F64
    frame: F64
    last: F64
    waiting: F64
    lines: F64
    gate: F64
    before: F64
    after: F64
    found: F64


def fresh_memory(position_sd_m: float, yaw_sd_rad: float) -> Memory:
    """Nothing seen yet."""
    variances, pending, last = (
        np.array([position_sd_m**2, yaw_sd_rad**2]),
        np.zeros((4, AGREEING)),
        np.full(3, np.nan),
    )
    scratch = (np.zeros((2, 3)), np.zeros(3), np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)))
    counts = np.zeros(8, np.int64)
    return Memory(counts, fresh_track(), variances, pending, np.zeros(3), last, np.zeros(5), *scratch)


class Rules(NamedTuple):
    """Nominal step, samples of the line, groups that are short enough, longest gap to predict
    over.
    """

    step_s: float
    n_line: int
    n_groups: int
    longest_gap_s: float


@njit(cache=True)
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


@njit(cache=True)
def start_again(m: Memory, t_ns: int, pose: F64) -> int:
    """Forget what came before this row."""
    m.counts[N_HELD] = m.counts[N_PENDING] = 0
    m.counts[N_JUMPS] += 1
    take_up(m.counts, m.held, t_ns, pose)
    return POSE_JUMP


@njit(cache=True)
def set_aside(m: Memory, t_s: float, pose: F64) -> None:
    """One more dissenting sample; the last four are kept."""
    n = m.counts[N_PENDING]
    if n == AGREEING:
        n -= 1
        m.pending[:, :n] = m.pending[:, 1:].copy()
    m.pending[0, n] = t_s
    m.pending[1:, n] = pose
    m.counts[N_PENDING] = n + 1


@njit(cache=True)
def is_back(m: Memory, t_s: float, pose: F64) -> bool:
    """Whether a sample lies inside the gate, nearer to the line than to the last one that dissented."""
    here = distance(pose, m.lines, np.zeros(3), m.gate)
    n = m.counts[N_PENDING]
    if here > 1.0 or n == 0:
        return here <= 1.0
    offsets(m.pending[:, n - 1 :], 1, t_s, m.lines, m.found)
    return here <= distance(pose, m.lines, m.found[0], m.gate)


@njit(cache=True)
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
    if not predictable and n_held and t_s - m.held[0, n_held - 1] > rules.longest_gap_s:
        if m.counts[N_PENDING]:
            return start_again(m, t_ns, pose)
        m.counts[N_HELD] = 0
    m.counts[N_PENDING] = 0
    take_up(m.counts, m.held, t_ns, pose)
    return OK


@njit(cache=True)
def is_usual(counts: I64, held: F64, variances: F64, rules: Rules, t_s: float, lines: F64, gate: F64) -> int:
    """1 where a sample can be predicted and nothing is pending, 0 where something is, −1 without a
    prediction.
    """
    n = counts[N_HELD]
    if n < rules.n_line or t_s - held[0, n - 1] > rules.longest_gap_s:
        return -1
    gates(held, n, rules.n_line, t_s, variances, lines, gate)
    return 0 if counts[N_PENDING] else 1


@njit(cache=True)
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


@njit(cache=True)
def judge_rows(m: Memory, rules: Rules, t_ns: I64, measured: F64, inputs: F64) -> tuple[I64, F64]:
    """Outcome of each row (n,) and its pose carried back (3, n); ``inputs`` (4, n) change in place.

    A pose that is repeated to the bit is a held one: it goes on as it came, and says nothing new.
    """
    counts, held, variances, frame, last = m.counts, m.held, m.variances, m.frame, m.last
    lines, gate, before, after, waiting = m.lines, m.gate, m.before, m.after, m.waiting
    outcome, poses, pose = np.zeros(len(t_ns), np.int64), np.empty_like(measured), np.empty(3)
    for i in range(len(t_ns)):
        now, stamp = OK, t_ns[i]
        repeated = measured[0, i] == last[0] and measured[1, i] == last[1] and measured[2, i] == last[2]
        last[0], last[1], last[2] = measured[0, i], measured[1, i], measured[2, i]
        carry_back(frame, last, pose)
        if repeated:
            now = OUTLIER if counts[N_PENDING] else OK
        else:
            t_s = (stamp - counts[ANCHOR_NS]) * 1e-9
            usual = is_usual(counts, held, variances, rules, t_s, lines, gate)
            if usual == 1 and inside(pose, lines, gate):
                take_up(counts, held, stamp, pose)
                follow_noise(held, counts[N_HELD], rules.step_s, variances)
                if hidden_step(
                    held, counts[N_HELD], counts[N_GOOD], rules.n_groups, variances, before, after
                ):
                    take_out(frame, pose, after[0] - before[0])
                    now = start_again(m, stamp, pose)
            else:
                now = judge_unusual(m, rules, stamp, pose, usual >= 0)
        carry_inputs(waiting, inputs, i, (stamp - counts[LAST_NS]) * 1e-9 if counts[N_ROWS] else 0.0, now)
        outcome[i], poses[0, i], poses[1, i], poses[2, i] = now, pose[0], pose[1], pose[2]
        counts[LAST_NS] = stamp
        counts[N_ROWS] += 1
        counts[N_OUTLIERS] += now == OUTLIER
    return outcome, poses


@dataclass(frozen=True, eq=False)
class Repaired:
    """``status`` (n,) of every row; ``kept`` (n,) those that go on; ``rows`` these, their poses carried back,
    and ``restarts`` where nothing may reach back further.
    """

    status: I8
    kept: Bool
    rows: AlignedBatch
    restarts: Bool


class PoseRepair:
    """Stage: aligned rows → the same without outliers and jumps; nothing is held back."""

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

    def push(self, rows: AlignedBatch) -> Repaired:
        """Rows in strictly increasing time."""
        inputs = rows.inputs.copy()
        outcome, poses = judge_rows(
            self._memory, self._rules, rows.t_ns, np.ascontiguousarray(rows.pose), inputs
        )
        kept = np.asarray(outcome != OUTLIER)
        good = AlignedBatch(rows.t_ns[kept], poses[:, kept], inputs[:, kept], rows.mode_true[kept])
        return Repaired(outcome.astype(np.int8), kept, good, np.asarray(outcome[kept] == POSE_JUMP))

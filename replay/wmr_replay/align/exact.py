"""The exact tests of a pose: outliers, jumps, and jumps that are hidden in noise.

They are compiled for the first row that :mod:`.quiet` does not pass; a log without such rows needs none.
"""

from wmr_replay.align.frame import carry_back, take_out
from wmr_replay.align.jumps import AGREEING, agree, distance, gates, hidden_step, inside, offsets
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
)
from wmr_replay.align.track import CAPACITY, follow_noise, make_room, put
from wmr_schemas.arrays import F64, I8, I64
from wmr_schemas.compiled.lean import lean
from wmr_schemas.status import Status

OK, POSE_JUMP, OUTLIER = int(Status.OK), int(Status.POSE_JUMP), int(Status.OUTLIER)
"""Outcomes of a row, as integers that compiled code compares with."""


@lean
def take_up(counts: I64, held: F64, t_ns: int, pose: F64) -> None:
    """Add a good sample to the track."""
    if counts[N_HELD] == CAPACITY:
        counts[ANCHOR_NS] += round(make_room(held) * 1e9)
        counts[N_HELD] = CAPACITY // 2
    if counts[N_HELD] == 0:
        counts[ANCHOR_NS] = t_ns
    put(held, counts[N_HELD], (t_ns - counts[ANCHOR_NS]) * 1e-9, pose[0], pose[1], pose[2])
    counts[N_HELD] += 1
    counts[N_GOOD] += 1


@lean
def start_again(m: Memory, t_ns: int, pose: F64) -> int:
    """Restart the track at this row, after a jump."""
    m.counts[N_HELD] = m.counts[N_PENDING] = 0
    m.counts[N_JUMPS] += 1
    take_up(m.counts, m.held, t_ns, pose)
    return POSE_JUMP


@lean
def set_aside(m: Memory, t_s: float, pose: F64) -> None:
    """Add a rejected sample; the last four are kept."""
    n = m.counts[N_PENDING]
    if n == AGREEING:
        n -= 1
        for k in range(4):
            for j in range(n):
                m.pending[k, j] = m.pending[k, j + 1]
    m.pending[0, n] = t_s
    for k in range(3):
        m.pending[1 + k, n] = pose[k]
    m.counts[N_PENDING] = n + 1


@lean
def is_back(m: Memory, t_s: float, pose: F64) -> bool:
    """Whether a sample lies inside the gate, nearer to the line than to the last rejected one."""
    here = distance(pose, m.lines, m.nowhere, m.gate)
    n = m.counts[N_PENDING]
    if here > 1.0 or n == 0:
        return here <= 1.0
    offsets(m.pending, n - 1, n, t_s, m.lines, m.found)
    return here <= distance(pose, m.lines, m.found[0], m.gate)


@lean
def judge_unusual(m: Memory, rules: Rules, t_ns: int, pose: F64, predictable: bool) -> int:
    """Outcome of a row without a prediction, of a rejected row, or of a row after rejected ones."""
    t_s, n_held = (t_ns - m.counts[ANCHOR_NS]) * 1e-9, m.counts[N_HELD]
    if predictable and not is_back(m, t_s, pose):
        set_aside(m, t_s, pose)
        n = m.counts[N_PENDING]
        offsets(m.pending, 0, n, t_s, m.lines, m.found)
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


@lean
def is_usual(counts: I64, held: F64, variances: F64, rules: Rules, t_s: float, lines: F64, gate: F64) -> int:
    """1 with a prediction and no rejected samples, 0 with a prediction and rejected samples, −1 without a
    prediction.
    """
    n = counts[N_HELD]
    if n < rules.n_line or t_s - held[n - 1, 0] > rules.longest_gap_s:
        return -1
    gates(held, n, rules.n_line, t_s, variances, lines, gate)
    return 0 if counts[N_PENDING] else 1


@lean
def carry_inputs(waiting: F64, inputs: F64, i: int, dt_s: float, outcome: int) -> None:
    """Inputs are means since the row before; the inputs of outliers are added to those of the next row."""
    if outcome == OUTLIER:
        for k in range(4):
            waiting[k] += inputs[k, i] * dt_s
        waiting[4] += dt_s
    elif waiting[4] > 0.0:
        for k in range(4):
            inputs[k, i] = (waiting[k] + inputs[k, i] * dt_s) / (waiting[4] + dt_s)
        for k in range(5):
            waiting[k] = 0.0


@lean
def find_step(m: Memory, rules: Rules, t_ns: int, pose: F64) -> int:
    """Whether a good row, just added, shows that the pose has jumped before it."""
    n, count = m.counts[N_HELD], m.counts[N_GOOD]
    if not hidden_step(m.held, n, count, rules.n_groups, m.variances, m.before, m.after):
        return OK
    for k in range(3):
        m.step[k] = m.after[0, k] - m.before[0, k]
    take_out(m.frame, pose, m.step)
    return start_again(m, t_ns, pose)


@lean
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


@lean
def judge_exactly(m: Memory, rules: Rules, i: int, t_ns: I64, measured: F64, inputs: F64, poses: F64) -> int:
    """Outcome of row i by the exact tests; its transformed pose goes into ``poses``."""
    counts, last, pose, stamp = m.counts, m.last, m.pose, t_ns[i]
    x, y, yaw = measured[0, i], measured[1, i], measured[2, i]
    repeated = x == last[0] and y == last[1] and yaw == last[2]
    last[0], last[1], last[2] = x, y, yaw
    carry_back(m.frame, last, pose)
    outcome = judge_row(m, rules, stamp, pose, repeated)
    carry_inputs(m.waiting, inputs, i, (stamp - counts[LAST_NS]) * 1e-9 if counts[N_ROWS] else 0.0, outcome)
    for k in range(3):
        poses[k, i] = pose[k]
    counts[LAST_NS] = stamp
    counts[N_ROWS] += 1
    counts[N_OUTLIERS] += outcome == OUTLIER
    return outcome


@lean
def judge_step(m: Memory, rules: Rules, i: int, stamp: int, poses: F64) -> int:
    """Outcome of row i, added by the fast test: a hidden step changes its pose in ``poses``."""
    for k in range(3):
        m.pose[k] = poses[k, i]
    outcome = find_step(m, rules, stamp, m.pose)
    for k in range(3):
        poses[k, i] = m.pose[k]
    return outcome


@lean
def judge_rows(  # noqa: PLR0913, PLR0917 – compiled; arrays that are filled in place
    m: Memory,
    rules: Rules,
    start: int,
    hides: bool,
    t_ns: I64,
    measured: F64,
    inputs: F64,
    outcome: I8,
    poses: F64,
) -> None:
    """Fill the ``outcome`` of each row (n,) from ``start`` on and its transformed pose, ``poses`` (3, n);
    ``inputs`` (4, n) change in place. ``start`` and ``hides`` are what ``quiet.follow_quiet`` has returned.
    """
    i = start
    while hides or i < t_ns.shape[0]:
        if hides:
            outcome[i - 1] = judge_step(m, rules, i - 1, t_ns[i - 1], poses)
        else:
            outcome[i] = judge_exactly(m, rules, i, t_ns, measured, inputs, poses)
            i += 1
        i, hides = follow_quiet(
            m.counts, m.held, m.variances, m.frame, m.last, rules, i, t_ns, measured, poses
        )

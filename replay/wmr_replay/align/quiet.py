"""Fast test of the usual case, in scalars and without square roots: rows that noise alone explains.

The first row that does not pass is left to the exact tests of :mod:`.exact`, which are compiled only then.
"""

import math

from wmr_replay.align.jumps import GROUP_SD, GROUPS, SINGLE_SD, TESTS_PER_GROUP
from wmr_replay.align.state import ANCHOR_NS, LAST_NS, N_GOOD, N_HELD, N_PENDING, N_ROWS, Rules
from wmr_replay.align.track import CAPACITY, followed, is_regular, make_room, put
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean


@lean
def values_at(held: F64, first: int, stop: int, at_s: float) -> tuple[float, float, float, float]:
    """v, x, y and yaw at ``at_s`` of the lines through samples first … stop − 1; see ``track.line``."""
    share = 1.0 / (stop - first)
    sum_t = held[stop, 4] - held[first, 4]
    mean = sum_t * share
    ahead = at_s - mean
    gain = ahead / (held[stop, 5] - held[first, 5] - sum_t * mean)
    x, y, yaw = held[stop, 6] - held[first, 6], held[stop, 7] - held[first, 7], held[stop, 8] - held[first, 8]
    tx, ty = held[stop, 9] - held[first, 9], held[stop, 10] - held[first, 10]
    tyaw = held[stop, 11] - held[first, 11]
    return (
        share + ahead * gain,
        x * share + (tx - mean * x) * gain + held[0, 1],
        y * share + (ty - mean * y) * gain + held[0, 2],
        yaw * share + (tyaw - mean * yaw) * gain + held[0, 3],
    )


@lean
def plainly_meet(held: F64, n: int, g: int, position: float, yaw: float) -> bool:
    """Whether lines through the last ``GROUPS[g]`` samples and those before meet within noise alone; the
    variances of position and yaw are given.
    """
    m = GROUPS[g]
    middle = n - m
    at_s = 0.5 * (held[middle - 1, 0] + held[middle, 0])
    v, x, y, turn = values_at(held, middle - m, middle, at_s)
    v_after, x_after, y_after, turn_after = values_at(held, middle, n, at_s)
    least = GROUP_SD[g] ** 2 * (v + v_after)
    near = (x_after - x) ** 2 <= least * position and (y_after - y) ** 2 <= least * position
    return bool(near and (turn_after - turn) ** 2 <= least * yaw)


@lean
def suspicious(held: F64, n: int, count: int, n_groups: int, position: float, yaw: float) -> bool:
    """Whether any group that is due might hide a step."""
    for g in range(n_groups):
        m = GROUPS[g]
        due = count % (m // TESTS_PER_GROUP) == 0
        if due and n >= 2 * m and not plainly_meet(held, n, g, position, yaw):
            return True
    return False


@lean
def follow_quiet(  # noqa: C901, PLR0913, PLR0917 – compiled; one loop, its state in scalars
    counts: I64,
    held: F64,
    variances: F64,
    frame: F64,
    last: F64,
    rules: Rules,
    row: int,
    t_ns: I64,
    measured: F64,
    poses: F64,
) -> tuple[int, bool]:
    """Add the rows from ``row`` on to the track, up to the first that does not pass; the first five arguments
    are those of :class:`.state.Memory`.

    Without a prediction – at the start, and after a long gap – every row passes. A pose that is repeated to
    the bit was held by the sender: it is passed on and not added. ``poses`` (3, n) are the transformed
    ``measured`` ones. Returns the first row that was not passed on, and whether the row before it may show
    a step.
    """
    if counts[N_PENDING]:
        return row, False
    i, n, good, anchor_ns, hides = row, counts[N_HELD], counts[N_GOOD], counts[ANCHOR_NS], False
    position, yaw_variance = variances[0], variances[1]
    x0, y0, yaw0 = last[0], last[1], last[2]
    cos, sin = math.cos(frame[0]), math.sin(frame[0])
    moved = frame[0] != 0.0 or frame[1] != 0.0 or frame[2] != 0.0
    while i < t_ns.shape[0] and not hides:
        raw_x, raw_y, raw_yaw = measured[0, i], measured[1, i], measured[2, i]
        x, y, yaw = raw_x, raw_y, raw_yaw
        if moved:
            x = raw_x * cos - raw_y * sin + frame[1]
            y = raw_x * sin + raw_y * cos + frame[2]
            yaw = raw_yaw + frame[0]
        if not (raw_x == x0 and raw_y == y0 and raw_yaw == yaw0):
            t_s = (t_ns[i] - anchor_ns) * 1e-9
            if n > 0 and t_s - held[n - 1, 0] > rules.longest_gap_s:
                n = 0
            predictable = n >= rules.n_line
            if predictable:
                v, at_x, at_y, at_yaw = values_at(held, n - rules.n_line, n, t_s)
                least = SINGLE_SD * SINGLE_SD * (1.0 + v)
                far = (x - at_x) ** 2 > least * position or (y - at_y) ** 2 > least * position
                if far or (yaw - at_yaw) ** 2 > least * yaw_variance:
                    break
            if n == CAPACITY:
                anchor_ns += round(make_room(held) * 1e9)
                n = CAPACITY // 2
            if n == 0:
                anchor_ns = t_ns[i]
            put(held, n, (t_ns[i] - anchor_ns) * 1e-9, x, y, yaw)
            n, good = n + 1, good + 1
            if predictable:
                if is_regular(held, n, rules.step_s):
                    position = followed(held, n, 1, position, 0.5)
                    position = followed(held, n, 2, position, 0.5)
                    yaw_variance = followed(held, n, 3, yaw_variance, 1.0)
                hides = suspicious(held, n, good, rules.n_groups, position, yaw_variance)
            x0, y0, yaw0 = raw_x, raw_y, raw_yaw
        poses[0, i], poses[1, i], poses[2, i] = x, y, yaw
        i += 1
    variances[0], variances[1] = position, yaw_variance
    last[0], last[1], last[2] = x0, y0, yaw0
    counts[N_HELD], counts[N_GOOD], counts[ANCHOR_NS] = n, good, anchor_ns
    counts[N_ROWS] += i - row
    if i > row:
        counts[LAST_NS] = t_ns[i - 1]
    return i, hides

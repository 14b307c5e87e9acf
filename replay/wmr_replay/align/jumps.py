"""Tests for outliers and jumps: gates for single samples, and lines through groups that do not meet."""

import math

from wmr_replay.align.track import line, rate
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

SINGLE_SD = 6.0
AGREEING = 4
GROUPS = (16, 64, 256)
GROUP_SD = (5.5, 5.25, 5.0)
TESTS_PER_GROUP = 8
KINK, SKID_SHARE = 0.15, 0.6
FLOOR = (0.5, 0.5)
"""Speed in m/s and yaw rate in rad/s that a robot at rest may have at the next sample."""
ACCELERATION = (15.0, 30.0)
GROUP_ACCELERATION = (5.0, 25.0)
JERK = 0.07


@lean
def gates(held: F64, n: int, n_line: int, t_s: float, variances: F64, lines: F64, gate: F64) -> None:
    """Fill ``lines`` (2, 3), pose and slopes at ``t_s`` by the line through the last good samples, and
    ``gate`` (3,), the largest distance of a good sample:

    6 σ √(1 + v) + s (gap + h/5) + A (h + gap)²/6, with the line's span h, the speed s – whose direction may
    change at once, as at the end of a skid – and a bound A on acceleration; likewise for yaw.
    """
    first = max(0, n - n_line)
    v = line(held, first, n, t_s, lines)
    gap_s, span_s = t_s - held[n - 1, 0], held[n - 1, 0] - held[first, 0]
    reach_s, bend = gap_s + 0.2 * span_s, (span_s + gap_s) ** 2 / 6.0
    for i in range(2):
        noise, moved = math.sqrt(variances[i] * (1.0 + v)), max(rate(lines, i), FLOOR[i]) * reach_s
        gate[2 * i] = SINGLE_SD * noise + moved + ACCELERATION[i] * bend
    gate[1] = gate[0]


@lean
def inside(pose: F64, lines: F64, gate: F64) -> bool:
    """Whether a sample lies inside the gate around its prediction."""
    x, y, yaw = abs(pose[0] - lines[0, 0]), abs(pose[1] - lines[0, 1]), abs(pose[2] - lines[0, 2])
    return bool(x <= gate[0] and y <= gate[1] and yaw <= gate[2])


@lean
def distance(pose: F64, lines: F64, offset: F64, gate: F64) -> float:
    """Distance from the line over the gate, the largest of three channels; a sample above 1 is rejected."""
    most = 0.0
    for k in range(3):
        most = max(most, abs(pose[k] - lines[0, k] - offset[k]) / gate[k])
    return most


@lean
def offsets(pending: F64, start: int, stop: int, t_s: float, lines: F64, out: F64) -> None:
    """Offsets of start … stop − 1 of ``pending`` (4, …) – t, x, y, yaw – from the line: mean and range,
    ``out`` (2, 3).
    """
    for k in range(3):
        low, high, total = math.inf, -math.inf, 0.0
        for j in range(start, stop):
            off = pending[1 + k, j] - lines[0, k] - lines[1, k] * (pending[0, j] - t_s)
            low, high, total = min(low, off), max(high, off), total + off
        out[0, k], out[1, k] = total / (stop - start), high - low


@lean
def agree(apart: F64, lines: F64, span_s: float, variances: F64) -> bool:
    """Whether samples within ``span_s``, their offsets ``apart`` (3,), are a pose that moves like the
    line.
    """
    for k in range(3):
        i = k // 2
        moved = max(rate(lines, i), FLOOR[i]) * span_s + ACCELERATION[i] * span_s**2
        if apart[k] > SINGLE_SD * math.sqrt(2.0 * variances[i]) + moved:
            return False
    return True


@lean
def fail_to_meet(held: F64, n: int, g: int, variances: F64, before: F64, after: F64) -> bool:
    """Whether lines through the last m samples and the m before fail to meet between them, m = ``GROUPS[g]``.

    A constant acceleration bends both lines alike and drops out; a velocity that changes by Δv inside one
    half, of duration h, leaves .15 Δv h at most, and a skid that ends changes it by .6 of the speed; a circle
    leaves .07 s ω² h³. The step is then ``after[0] − before[0]``.
    """
    m = GROUPS[g]
    middle = n - m
    at_s = 0.5 * (held[middle - 1, 0] + held[middle, 0])
    v = line(held, middle - m, middle, at_s, before) + line(held, middle, n, at_s, after)
    half_s = held[n - 1, 0] - held[middle, 0]
    for k in range(3):
        i = k // 2
        step = abs(after[0, k] - before[0, k])
        if step * step > GROUP_SD[g] ** 2 * v * variances[i]:
            noise = GROUP_SD[g] * math.sqrt(v * variances[i])
            fastest = max(rate(before, i), rate(after, i), FLOOR[i])
            turning = 0.0 if i else max(rate(before, 1), rate(after, 1))
            kink, bend = KINK * SKID_SHARE * half_s, JERK * turning**2 * half_s**3
            if step > noise + fastest * (kink + bend) + GROUP_ACCELERATION[i] * half_s**2 / 12.0:
                return True
    return False


@lean
def hidden_step(
    held: F64, n: int, count: int, n_groups: int, variances: F64, before: F64, after: F64
) -> bool:
    """Whether any group of samples fails to meet the one before it; n are held, after ``count`` in all."""
    for g in range(n_groups):
        m = GROUPS[g]
        due = count % (m // TESTS_PER_GROUP) == 0
        if due and n >= 2 * m and fail_to_meet(held, n, g, variances, before, after):
            return True
    return False

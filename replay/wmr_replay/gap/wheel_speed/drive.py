"""From commands to wheel speeds: the effects of the drive, in the order in which a command meets them.

command → gains → limit of the turning → dead zone → saturation, of each wheel or both →
delay → limits of the acceleration, in turning and of each wheel → lag → wheel
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.wheel_speed.record import Record
from wmr_schemas.arrays import F64, I64

MANY_ROWS = 16
"""Rows from which they are taken place by place together. Numerics."""
Values = Mapping[str, Mapping[str, float]]
"""Effects by name, each with its parameters."""


class Chassis(NamedTuple):
    """The nominal robot."""

    radius_m: float
    half_track_m: float


def wheel_speeds(record: Record, effects: Values, chassis: Chassis) -> F64:
    """Left and right wheel speeds (2, M) that the drive makes of what drives the model."""
    speeds = np.stack([record.left_radps, record.right_radps])
    if record.driven_by != "command":
        return speeds
    speeds, radius_m = with_gains(speeds, effects), chassis.radius_m
    if "turn_saturation" in effects:
        limit = effects["turn_saturation"]["limit_radps"] * chassis.half_track_m / radius_m
        mean, half = (speeds[1] + speeds[0]) / 2, np.clip((speeds[1] - speeds[0]) / 2, -limit, limit)
        speeds = np.stack([mean - half, mean + half])
    if "speed_deadzone" in effects:
        dead = effects["speed_deadzone"]["threshold_mps"] / radius_m
        speeds = np.sign(speeds) * np.maximum(np.abs(speeds) - dead, 0.0)
    if "speed_saturation" in effects:
        limit = effects["speed_saturation"]["limit_mps"] / radius_m
        speeds = np.clip(speeds, -limit, limit)
    if "speed_desaturation" in effects:
        limit = effects["speed_desaturation"]["limit_mps"] / radius_m
        speeds = speeds * np.minimum(1.0, limit / np.maximum(np.abs(speeds).max(axis=0), 1e-9))
    if "input_delay" in effects:
        speeds = delayed(record, speeds, effects["input_delay"]["delay_s"])
    if "turn_acceleration_limit" in effects:
        limit = effects["turn_acceleration_limit"]["limit_radps2"] * chassis.half_track_m / radius_m
        speeds = turn_limited(record, speeds, limit * record.step_s)
    if "acceleration_limit" in effects:
        limit = effects["acceleration_limit"]["limit_mps2"] / radius_m
        speeds = rate_limited(record, speeds, limit * record.step_s)
    if "actuator_lag" in effects:
        speeds = lagged(record, speeds, effects["actuator_lag"]["time_constant_s"])
    return speeds


def with_gains(speeds: F64, effects: Values) -> F64:
    """Gain of both wheels, and of their difference."""
    both = 1 + effects.get("drive_gain", {}).get("ratio", 0.0)
    turn = 1 + effects.get("turn_gain", {}).get("ratio", 0.0)
    if both == 1.0 and turn == 1.0:
        return speeds
    mean, half = both * (speeds[1] + speeds[0]) / 2, both * turn * (speeds[1] - speeds[0]) / 2
    return np.stack([mean - half, mean + half])


def delayed(record: Record, speeds: F64, delay_s: float) -> F64:
    """Speeds of ``delay_s`` before, (2, M); each stretch's first is held before it."""
    shift = delay_s / record.step_s
    whole = int(np.floor(shift))
    share = shift - whole
    first = np.repeat(record.first[:-1], np.diff(record.first))
    last = np.repeat(record.first[1:] - 1, np.diff(record.first))
    row = np.arange(speeds.shape[1]) - whole
    late = speeds[:, np.clip(row, first, last)]
    later = speeds[:, np.clip(row - 1, first, last)]
    return np.asarray((1 - share) * late + share * later)


def lagged(record: Record, speeds: F64, time_s: float) -> F64:
    """Means over each row of a first-order lag, dy/dt = (u − y)/T, exact for a held u; starts as in
    :func:`stretch_by_stretch`.
    """
    from scipy.signal import lfilter  # noqa: PLC0415 – a second of start-up

    if time_s < 1e-6:
        return speeds
    keep = float(np.exp(-record.step_s / time_s))

    def follow(rows: F64, start: F64) -> F64:
        ends = lfilter([1 - keep], [1.0, -keep], rows, axis=-1, zi=keep * start[..., None])[0]
        begins = np.concatenate([start[..., None], ends[..., :-1]], axis=-1)
        return np.asarray(rows + (begins - rows) * (1 - keep) * time_s / record.step_s)

    return stretch_by_stretch(record, speeds, follow)


def rate_limited(record: Record, speeds: F64, most: float) -> F64:
    """Means over each row of wheel speeds that change by at most ``most`` in a row, at a constant rate until
    they reach what is wanted.
    """
    return stretch_by_stretch(record, speeds, lambda rows, start: approached(rows, start, most))


def turn_limited(record: Record, speeds: F64, most: float) -> F64:
    """The same where half the difference of both wheels changes by at most ``most`` in a row."""

    def follow(rows: F64, start: F64) -> F64:
        mean, half = rows.mean(axis=0), approached((rows[1] - rows[0]) / 2, (start[1] - start[0]) / 2, most)
        return np.stack([mean - half, mean + half])

    return stretch_by_stretch(record, speeds, follow)


def approached(rows: F64, start: F64, most: float) -> F64:
    """Means over each of ``rows`` (..., m) of speeds that start from ``start`` (...) and change by at most
    ``most`` in a row.
    """
    flat, begins = rows.reshape(-1, rows.shape[-1]), start.ravel()
    if len(flat) > MANY_ROWS:
        ends = limited_columns(flat, begins, most)
    else:
        ends = np.stack([limited_row(row, at, most) for row, at in zip(flat, begins.tolist(), strict=True)])
    ends = ends.reshape(rows.shape)
    steps = np.diff(ends, axis=-1, prepend=start[..., None])
    return np.asarray(ends - steps * np.abs(steps) / (2 * max(most, 1e-12)))


def limited_columns(rows: F64, start: F64, most: float) -> F64:
    """Many rows (n, m) that change by at most ``most`` from place to place, from ``start`` (n,) on."""
    out, at = np.empty_like(rows), start
    for k in range(rows.shape[1]):
        at = at + np.clip(rows[:, k] - at, -most, most)
        out[:, k] = at
    return out


def limited_row(row: F64, start: float, most: float) -> F64:
    """One row that changes by at most ``most`` from place to place, from ``start`` on.

    Only where a step is too large are places taken one by one, until the row is reached again.
    """
    steps = np.flatnonzero(np.abs(np.diff(row, prepend=start)) > most).tolist()
    if not steps:
        return row
    wanted, reached, n = row.tolist(), -1, len(row)
    out = list(wanted)
    for first in steps:
        if first <= reached:
            continue
        at, k = wanted[first - 1] if first else start, first
        while k < n:
            step = wanted[k] - at
            if -most <= step <= most:
                break
            at += most if step > 0 else -most
            out[k] = at
            k += 1
        reached = k
    return np.array(out)


def stretch_by_stretch(record: Record, speeds: F64, follow: Callable[[F64, F64], F64]) -> F64:
    """The answer (2, M) of a drive with a memory to commanded speeds (2, M).

    ``follow`` takes rows (2, s, m) of s stretches of like length, and the speeds (2, s) that they start from:
    where wheel speeds were measured, those at the first pose, held before it; elsewhere the first command.
    """
    out = np.empty_like(speeds)
    begin, end, known = begin_rows(record), record.first[1:], np.isfinite(record.started_radps).all(axis=0)
    begin = np.where(known, begin, record.first[:-1])
    start = np.where(known, record.started_radps, speeds[:, record.first[:-1]])
    lengths = end - begin
    classes = np.floor(4 * np.log2(np.maximum(lengths, 1)))
    for one in np.unique(classes):
        mine = np.flatnonzero(classes == one)
        rows = begin[mine, None] + np.arange(lengths[mine].max())
        followed = follow(speeds[:, np.minimum(rows, end[mine, None] - 1)], start[:, mine])
        inside = rows < end[mine, None]
        out[:, rows[inside]] = followed[:, inside]
    before = np.flatnonzero(known)
    for number in before:
        out[:, record.first[number] : begin[number]] = start[:, number, None]
    return out


def begin_rows(record: Record) -> I64:
    """The grid row (S,) in which each stretch's first pose lies."""
    return np.floor(record.at[record.first_pose[:-1]]).astype(np.int64)

"""From wheel speeds to the motion of the body in the measured frame: ahead, left, yaw rate.

    v_long = r (φ̇_R + φ̇_L)/2      l·yaw_rate = r (φ̇_R − φ̇_L)/2      v_lat = 0

and the effects on them. A measured pose describes another point, heading or time; that is the last step.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import expit

from wmr_replay.gap.wheel_speed.drive import Chassis, Values, wheel_speeds
from wmr_replay.gap.wheel_speed.record import Record
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.slip_terms import SLIP_CHANNELS, is_slip_term, parse_slip_term
from wmr_schemas.terms import COEFFICIENT

MOVING_RADPS = 0.02
"""The wheels turn where either is faster, rad/s."""


WIDE_TURNS = "wide_turn_scrub"
TIGHT = 3.0
"""The rims' difference that counts as much as the speed. Physics: tyres slide sideways at some ten degrees,
which those of a skid-steered robot reach in turns of three half-tracks. Judgement: 2.5 to 4 fit a stranger's
skid-steered robot and a tracked one about as well."""
LEAST_MPS = 1e-3
"""Below this speed a robot does not turn. Numerics."""
EDGE_S, EDGE_M = 0.05, 0.05
"""Widths of the edges of an interval [s] and of a disc [m]: a form that a fit can follow."""


class Motion(NamedTuple):
    """Body velocities (M,): ahead [m/s], left [m/s], yaw rate [rad/s]."""

    ahead: F64
    left: F64
    yaw: F64


def motion(record: Record, chassis: Chassis, effects: Values, smooth_rows: int) -> Motion:
    """Body velocities in the frame of the measured pose, with ``effects``."""
    wheels = wheel_speeds(record, effects, chassis)
    left, right = with_wheels(record, wheels, effects)
    half_track_m = chassis.half_track_m * (1 + effects.get("effective_track", {}).get("ratio", 0.0))
    ahead = chassis.radius_m * (right + left) / 2
    around = chassis.radius_m * (right - left) / 2
    yaw = around / (half_track_m * widened_by_turns(ahead, around, effects, smooth_rows))
    moving: Bool = np.asarray((np.abs(wheels) > MOVING_RADPS).any(axis=0))
    rolled = with_slip(
        record, Motion(ahead, np.zeros_like(ahead), yaw), moving, chassis, effects, smooth_rows
    )
    return as_measured(record, rolled, effects)


def widened_by_turns(ahead: F64, around: F64, effects: Values, smooth_rows: int) -> F64:
    """The track (M,) of tyres that scrub, by the one half-way between a turn on the spot and the widest one.

    1 + ratio·(g − ½), g = |v|/(|v| + 3 |w|): the slip angle of tyres ahead of the axle and behind it, and
    with it the friction that hinders a turn, grows less and less the tighter the turn is.
    """
    ratio = effects.get(WIDE_TURNS, {}).get("ratio", 0.0)
    if ratio == 0.0:
        return np.ones_like(ahead)
    v, w = np.abs(smoothed(ahead, smooth_rows)), np.abs(smoothed(around, smooth_rows))
    return np.asarray(1 + ratio * (v / np.maximum(v + TIGHT * w, LEAST_MPS) - 0.5))


def with_wheels(record: Record, wheels: F64, effects: Values) -> F64:
    """Wheel speeds (2, M) that move the robot: scales, and losses in a time or a place."""
    kept = np.full(wheels.shape, 1 + effects.get("wheel_scale", {}).get("ratio", 0.0))
    if "slip_interval" in effects:
        kept *= kept_of(effects["slip_interval"], in_interval(record.time_s, effects["slip_interval"]))
    if "low_grip_patch" in effects:
        kept *= kept_of(effects["low_grip_patch"], in_disc(record.world, effects["low_grip_patch"]))
    apart = effects.get("wheel_scale_difference", {}).get("ratio", 0.0)
    return np.asarray(wheels * kept * np.array([[1 - apart], [1 + apart]]))


def kept_of(loss: Mapping[str, float], inside: F64) -> F64:
    """What the left and the right wheel keep (2, M) where a share (M,) of each row loses traction."""
    apart = loss.get("loss_apart", 0.0)
    return np.asarray(1 - np.array([[loss["loss"] - apart], [loss["loss"] + apart]]) * inside)


def in_interval(time_s: F64, p: Mapping[str, float]) -> F64:
    """Share (M,) of each row that lies in an interval, edges softened over ``EDGE_S``."""
    return np.asarray(expit((time_s - p["start_s"]) / EDGE_S) * expit((p["end_s"] - time_s) / EDGE_S))


def in_disc(world: F64, p: Mapping[str, float]) -> F64:
    """Share (M,) of each row that lies in a disc, its edge softened over ``EDGE_M``."""
    away_m = np.hypot(world[0] - p["x_m"], world[1] - p["y_m"])
    return np.asarray(expit((p["radius_m"] - away_m) / EDGE_M))


def with_slip(
    record: Record, nominal: Motion, moving: Bool, chassis: Chassis, effects: Values, smooth_rows: int
) -> Motion:
    """The motion with slip ahead, sideways and downhill."""
    ahead, left, yaw = nominal
    slow_yaw = smoothed(yaw, smooth_rows)
    if "turning_slip" in effects:
        k = effects["turning_slip"]["s_per_m"]
        ahead = ahead * (1 - k * np.abs(slow_yaw) * chassis.half_track_m)
    if "slip_ratio" in effects:
        slow = smoothed(ahead, smooth_rows)
        ahead = ahead - effects["slip_ratio"]["seconds"] * np.gradient(slow, record.step_s)
    if "icr_offset" in effects:
        left = left - effects["icr_offset"]["offset_m"] * yaw
    if "lateral_slip" in effects:
        left = left - effects["lateral_slip"]["seconds"] * smoothed(ahead, smooth_rows) * slow_yaw
    if "slope_slip" in effects:
        cos, sin = np.cos(record.world[2]), np.sin(record.world[2])
        x, y = effects["slope_slip"]["x_mps"], effects["slope_slip"]["y_mps"]
        ahead = ahead + moving * (cos * x + sin * y)
        left = left + moving * (cos * y - sin * x)
    return with_terms(record, nominal, Motion(ahead, left, yaw), effects, smooth_rows)


def with_terms(record: Record, nominal: Motion, moved: Motion, effects: Values, smooth_rows: int) -> Motion:
    """The motion with the terms of the dictionary, products of the ``nominal`` speeds."""
    terms = [name for name in effects if is_slip_term(name)]
    if not terms:
        return moved
    columns = term_columns(record, nominal, smooth_rows)
    added = dict.fromkeys(SLIP_CHANNELS, np.zeros_like(moved.ahead))
    for name in terms:
        term = parse_slip_term(name)
        added[term.channel] = added[term.channel] + effects[name][COEFFICIENT] * term.evaluate(columns)
    return Motion(moved.ahead + added["v_long"], moved.left + added["v_lat"], moved.yaw + added["yaw_rate"])


def term_columns(record: Record, nominal: Motion, smooth_rows: int) -> dict[str, F64]:
    """What the factors of terms read, each (M,)."""
    v_mps = smoothed(nominal.ahead, smooth_rows)
    return {
        "v": v_mps,
        "a": np.gradient(v_mps, record.step_s),
        "yaw_rate": smoothed(nominal.yaw, smooth_rows),
        "yaw": record.world[2],
        "t": record.time_s,
    }


def as_measured(record: Record, body: Motion, effects: Values) -> Motion:
    """The motion as a pose describes it whose sensor lies away from the axle, or is turned."""
    ahead, left, yaw = body
    if "pose_lever_arm" in effects:
        x, y = effects["pose_lever_arm"]["x_m"], effects["pose_lever_arm"]["y_m"]
        ahead, left = ahead - yaw * y, left + yaw * x
    angle = effects.get("heading_misalignment", {}).get("angle_rad", 0.0)
    rate = effects.get("yaw_drift", {}).get("rate_radps", 0.0)
    if angle or rate:
        turned = angle + rate * record.time_s
        cos, sin = np.cos(turned), np.sin(turned)
        ahead, left = cos * ahead + sin * left, cos * left - sin * ahead
        yaw = yaw + rate
    return Motion(ahead, left, yaw)


def smoothed(values: F64, rows: int) -> F64:
    """Mean (M,) over ``rows`` rows, an odd number, centred; shorter at the ends."""
    if rows <= 1:
        return values
    box = np.ones(rows)
    return np.asarray(np.convolve(values, box, "same") / np.convolve(np.ones(len(values)), box, "same"))

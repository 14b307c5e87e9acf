"""Findings on signs and units in words: the numbers, the likely factor, and what to do."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.quality import explain, factor_words
from wmr_replay.quality.judgement import Comparisons, Judgement
from wmr_replay.quality.signs import Torques, Wheels
from wmr_schemas.robot import RobotParameters


@dataclass(frozen=True)
class Snapshot:
    """The numbers after one cell, from which a finding is told. Unknown ones are NaN."""

    seconds: float
    fault: int
    size: float
    decades: tuple[float, ...]
    torques: Torques
    wheels: Wheels
    clockwise: bool
    alone: bool
    alpha: float
    alpha_t: float
    turn_t: float
    speed_mps: float
    robot: RobotParameters


def snapshot(c: Comparisons, judged: Judgement, k: int) -> Snapshot:
    """The numbers after cell ``k``."""
    response, told = c.response, judged.explained
    one_side = judged.torques[k] in (Torques.LEFT_REVERSED, Torques.RIGHT_REVERSED)
    ahead = response.ahead_by_difference if one_side else response.ahead_by_sum
    turn = response.turn_by_sum if one_side else response.turn_by_difference
    return Snapshot(
        seconds=float(response.n[k]),
        fault=int(told.fault[k]),
        size=float(told.size[k]),
        decades=tuple(float(d) for d in told.decades[:, k]),
        torques=Torques(judged.torques[k]),
        wheels=Wheels(judged.wheels[k]),
        clockwise=bool(judged.clockwise[k]),
        alone=bool(told.alone[k]),
        alpha=float(ahead.slope[k]),
        alpha_t=float(ahead.t[k]),
        turn_t=float(turn.t[k]),
        speed_mps=float(10 ** c.path.speed_mps.log10[k]),
        robot=c.robot,
    )


def text_of(code: str, s: Snapshot) -> tuple[str, str]:
    """What was found, and advice in place of the kind's (empty: the kind's own)."""
    return _TEXTS[code](s)


def by(decades: float) -> str:
    """A factor in words."""
    factor = 10 ** abs(decades)
    size = f"{factor:.3g}" if factor < 1000 else f"{factor:.0f}"
    return f"{size} times too {'large' if decades > 0 else 'small'}"


def likely(words: str) -> str:
    """The likely cause, behind a colon."""
    return f": {words}" if words else ""


def torque_sign(s: Snapshot) -> tuple[str, str]:
    """Reversed torques, both or one."""
    if s.torques in (Torques.LEFT_REVERSED, Torques.RIGHT_REVERSED):
        side = "left" if s.torques == Torques.LEFT_REVERSED else "right"
        text = (
            f"the robot is driven by the difference of its torques (t = {abs(s.alpha_t):.0f} over "
            f"{s.seconds:.0f} s), not by their sum: the {side} torque is reversed"
        )
        return text, f"give {side}_torque_sign = -1 under [torque] in --map"
    text = f"alpha is {s.alpha:.3g} (m/s²)/(N·m) (t = {s.alpha_t:.0f} over {s.seconds:.0f} s): both torques are reversed"
    advice = "give left_torque_sign = -1 and right_torque_sign = -1 under [torque] in --map"
    if s.torques == Torques.REVERSED_AND_SWAPPED:
        return f"{text}, and left and right exchanged", f"{advice}, and exchange the joints"
    return text, advice


def sides_swapped(s: Snapshot) -> tuple[str, str]:
    """Left and right exchanged, or a pose whose y axis points right."""
    torques, wheels = s.torques == Torques.SWAPPED, s.wheels == Wheels.SWAPPED
    if torques and wheels:
        return (
            f"torques (t = {s.turn_t:.0f}) and wheel speeds turn the robot the other way: the pose's frame has its y "
            "axis to the right (NED), or left and right are exchanged"
        ), "publish the pose in a frame whose z axis points up, or exchange left and right in --map"
    if torques:
        return (
            f"the torques turn the robot the other way (t = {s.turn_t:.0f} over {s.seconds:.0f} s): left and right "
            "are exchanged"
        ), "exchange left and right of the torques in --map"
    text = "the wheel speeds turn the other way than the pose: their left and right are exchanged"
    return text, "exchange left and right of the wheel speeds in --map; sigma_diff_mps is wrong without"


def wheel_speed_sign(s: Snapshot) -> tuple[str, str]:
    """Reversed wheel speeds, both or one."""
    side = {Wheels.LEFT_REVERSED: "left", Wheels.RIGHT_REVERSED: "right"}.get(s.wheels)
    keys = f"{side}_speed_sign = -1" if side else "left_speed_sign = -1 and right_speed_sign = -1"
    which = f"the {side} wheel turns" if side else "both wheels turn"
    return f"{which} backwards while the robot moves ahead", f"give {keys} under [torque] in --map"


def yaw_unit(s: Snapshot) -> tuple[str, str]:
    """A yaw in degrees, or clockwise."""
    if s.clockwise:
        text = "the yaw turns clockwise where the path turns counter-clockwise"
        return (
            text,
            "give yaw_sign = -1 under [pose] in --map, or publish the yaw counter-clockwise from x (REP 103)",
        )
    decades = s.decades[2] if np.isfinite(s.decades[2]) else s.size
    words = factor_words.yaw_words(decades)
    return f"the yaw turns {10**decades:.3g} times as fast as the path{likely(words)}", ""


def position_unit(s: Snapshot) -> tuple[str, str]:
    """Positions in millimetres or the like."""
    if abs(s.size) < explain.HIGHEST[0]:
        return f"the median speed is {s.speed_mps:.3g} m/s: no wheeled robot moves like this", ""
    words = factor_words.position_words(s.size)
    text = (
        f"positions are {by(s.size)} for wheel speeds or torques{likely(words)}; speed {s.speed_mps:.3g} m/s"
    )
    return text, f"give position_scale = {10**-s.size:.2g} under [pose] in --map"


def half_track(s: Snapshot) -> tuple[str, str]:
    """A half track in another unit, or a whole one."""
    words = factor_words.half_track_words(s.size)
    text = f"half_track_m = {s.robot.half_track_m:g} is {by(s.size)} for how the robot turns{likely(words)}"
    return text, f"half_track_m = {(s.robot.half_track_m or 0.0) * 10**-s.size:.2g} fits; give it with --map"


def wheel_speed_unit(s: Snapshot) -> tuple[str, str]:
    """Wheel speeds in rpm or the like, or a wrong radius."""
    ahead, turn = s.decades[:2]
    if s.fault == explain.UNEXPLAINED:
        sizes = [
            f"{what} is {10**d:.3g} times what the wheel speeds say"
            for what, d in (("speed", ahead), ("yaw rate", turn))
            if np.isfinite(d)
        ]
        return "; ".join(sizes), ""
    words = factor_words.wheel_words(s.size, s.robot)
    other = "" if s.alone else f"; or positions {by(-s.size)}{likely(factor_words.position_words(-s.size))}"
    return f"wheel speed × wheel_radius_m is {by(s.size)}{likely(words)}{other}", ""


def torque_unit(s: Snapshot) -> tuple[str, str]:
    """Torques that do not fit mass and radius, or alpha."""
    nominal = explain.nominal_answers(s.robot)[0]
    known = "" if nominal is None else f" where the robot's parameters say {nominal:.3g}"
    text = f"alpha is {s.alpha:.3g} (m/s²)/(N·m){known}"
    if s.fault == explain.UNEXPLAINED:
        return text, ""
    return f"{text}: torques are about {by(s.size)}{likely(factor_words.torque_words(s.size, s.robot))}", ""


_TEXTS = {
    "yaw_unit": yaw_unit,
    "position_unit": position_unit,
    "half_track": half_track,
    "wheel_speed_unit": wheel_speed_unit,
    "torque_unit": torque_unit,
    "torque_sign": torque_sign,
    "sides_swapped": sides_swapped,
    "wheel_speed_sign": wheel_speed_sign,
}

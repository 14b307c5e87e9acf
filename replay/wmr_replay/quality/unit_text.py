"""Findings on units in words: the numbers, the likely unit, and what to do."""

import numpy as np

from wmr_replay.quality import explain, factor_words
from wmr_replay.quality.plausibility_limits import LIMITS
from wmr_replay.quality.snapshot import Snapshot
from wmr_schemas.text import figure

Told = tuple[str, str]
"""What was found, and advice in place of the kind's; empty: the kind's own."""


def by(decades: float) -> str:
    """A factor in words."""
    size = 10 ** abs(decades)
    shown = figure(size, 3)
    return f"{shown} times too {'large' if decades > 0 else 'small'}"


def likely(words: str) -> str:
    """The likely cause, behind a colon."""
    return f": {words}" if words else ""


def yaw_unit(s: Snapshot) -> Told:
    """A yaw in degrees, or clockwise."""
    if s.clockwise:
        text = "the yaw turns clockwise where the path turns counter-clockwise"
        return text, "give yaw_sign = -1 in the pose section of --map, or publish a yaw from x to y (REP 103)"
    words = likely(factor_words.yaw_words(s.size))
    return f"the yaw turns {figure(10**s.size, 3)} times as fast as the path{words}", ""


def position_unit(s: Snapshot) -> Told:
    """Positions in millimetres or the like."""
    if abs(s.size) < LIMITS.speed[1]:
        return f"the median speed is {s.speed_mps:.3g} m/s: no wheeled robot moves like this", ""
    size = s.decades[0] if np.isfinite(s.decades[0]) else s.size
    words = likely(factor_words.position_words(size))
    text = f"positions are {by(size)} for wheel speeds or torques{words}"
    scale = 1 / factor_words.nearest_factor(size, factor_words.POSITION)
    advice = f"give position_scale = {scale:.2g} in the pose section of --map"
    return f"{text}; median speed {s.speed_mps:.3g} m/s", advice


def half_track(s: Snapshot) -> Told:
    """A half track in another unit, or a whole one."""
    given, words = s.robot.half_track_m or 0.0, likely(factor_words.half_track_words(s.size))
    text = f"half_track_m = {given:g} is {by(s.size)} for how the robot turns{words}"
    return text, f"half_track_m = {given * 10**-s.size:.2g} fits; give it with --map"


def wheel_speed_unit(s: Snapshot) -> Told:
    """Wheel speeds in rpm or the like, or a wrong radius."""
    if s.fault == explain.UNEXPLAINED:
        compared = zip(("speed", "yaw rate"), s.decades[:2], strict=True)
        told = [
            f"{what} is {figure(10**d, 3)} times what the wheels say"
            for what, d in compared
            if np.isfinite(d)
        ]
        return "; ".join(told), ""
    text = f"wheel speed × wheel_radius_m is {by(s.size)}{likely(factor_words.wheel_words(s.size, s.robot))}"
    other = factor_words.position_words(-s.size)
    return text + (f"; or positions are {by(-s.size)}: {other}" if other and not s.alone else ""), ""


def torque_unit(s: Snapshot) -> Told:
    """Torques that do not fit mass and radius, or alpha."""
    nominal = explain.nominal_answers(s.robot)[0]
    known = "" if nominal is None else f" where the robot's parameters say {nominal:.3g}"
    text = f"alpha is {s.alpha:.3g} (m/s²)/(N·m){known}"
    if s.fault == explain.UNEXPLAINED:
        return text, ""
    words = likely(factor_words.torque_words(s.size, s.robot))
    return f"{text}: torques are about {by(s.size)}{words}", ""

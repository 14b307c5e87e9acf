"""Words for a factor: the unit or the parameter that it points to."""

import math

from wmr_schemas.robot import RobotParameters

NEAR, NEAR_TORQUE = 0.05, 0.35
"""Decades within which a factor is a known one: 12 %; torques: 2, for slipping and friction."""

POSITION = {
    1000.0: "millimetres",
    100.0: "centimetres",
    1 / 0.3048: "feet",
    1 / 0.0254: "inches",
    1e-3: "kilometres",
}
YAW = {180 / math.pi: "degrees"}
HALF_TRACK = {1000.0: "given in millimetres", 100.0: "given in centimetres", 2.0: "that is the whole track"}
WHEEL = {
    30 / math.pi: "rpm in place of rad/s",
    180 / math.pi: "degrees in place of radians",
    1 / (2 * math.pi): "turns in place of radians",
    1000.0: "a wheel radius in millimetres",
    100.0: "a wheel radius in centimetres",
    2.0: "the wheel's diameter in place of its radius",
}
TORQUE = {1000.0: "N·mm in place of N·m", 100.0: "N·cm in place of N·m"}
POLE_PAIRS = range(2, 16)


def known_factor(decades: float, known: dict[float, str], near: float = NEAR) -> str:
    """The words of the nearest known factor, empty where none is near."""
    factor = min(known, key=lambda f: abs(math.log10(f) - decades))
    return known[factor] if abs(math.log10(factor) - decades) <= near else ""


def nearest_factor(decades: float, known: dict[float, str], near: float = NEAR) -> float:
    """The nearest known factor, or the factor itself where none is near."""
    factor = min(known, key=lambda f: abs(math.log10(f) - decades))
    return factor if abs(math.log10(factor) - decades) <= near else 10**decades


def position_words(decades: float) -> str:
    """What positions are that are 10^decades times too large."""
    return known_factor(decades, POSITION)


def yaw_words(decades: float) -> str:
    """What a yaw is that turns 10^decades times too fast; by a low rate of poses it only seems so."""
    return known_factor(decades, YAW) or ("degrees" if decades > 0.5 else "")


def half_track_words(decades: float) -> str:
    """What a half track is that is 10^decades times too large."""
    return known_factor(decades, HALF_TRACK)


def wheel_words(decades: float, robot: RobotParameters) -> str:
    """What wheel speeds, or a wheel radius, are that are 10^decades times too large."""
    radius = robot.wheel_radius_m
    if radius and abs(math.log10(radius) - decades) <= NEAR and abs(decades) > NEAR:
        return "wheel speeds in m/s in place of rad/s"
    found = known_factor(decades, WHEEL)
    if found or decades <= 0:
        return found
    pairs = [p for p in POLE_PAIRS if abs(math.log10(p * 30 / math.pi) - decades) <= NEAR / 4]
    if pairs:
        count = " or ".join(map(str, pairs))
        return f"electrical rpm of a motor with {count} pole pairs, or a motor before its gear"
    return "counts of an encoder, or a motor before its gear"


def torque_words(decades: float, robot: RobotParameters) -> str:
    """What torques are that are 10^decades times too large against what they do."""
    radius = robot.wheel_radius_m
    if decades < 0:
        return f"torques of a motor before a gear of about {10**-decades:.2g}, or its current"
    known = known_factor(decades, TORQUE, NEAR_TORQUE)
    if not known and radius is not None and radius < 1 and abs(-math.log10(radius) - decades) <= NEAR_TORQUE:
        known = "forces at the rim in place of torques"
    return known or "a motor's current, or raw values"

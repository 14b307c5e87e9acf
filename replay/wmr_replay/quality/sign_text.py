"""Findings on signs and sides in words: what was found with its numbers, and what to do."""

from wmr_replay.quality.signs import Torques, Wheels
from wmr_replay.quality.snapshot import Snapshot

Told = tuple[str, str]
"""What was found, and advice in place of the kind's; empty: the kind's own."""
UNDER_TORQUE = "in the torque section of --map"
BOTH_TORQUES = f"give left_torque_sign = -1 and right_torque_sign = -1 {UNDER_TORQUE}"


def torque_sign(s: Snapshot) -> Told:
    """Reversed torques, both or one."""
    if s.torques == Torques.TURN_REVERSED:
        text = f"{turned(s)}: both are reversed, or left and right are exchanged"
        return text, f"{BOTH_TORQUES}, or exchange left and right"
    if s.torques in (Torques.LEFT_REVERSED, Torques.RIGHT_REVERSED):
        side = "left" if s.torques == Torques.LEFT_REVERSED else "right"
        text = (
            "the difference of the torques drives the robot and their sum turns it "
            f"(|t| = {abs(s.alpha_t):.0f} and {abs(s.turn_t):.0f} over {s.seconds:.0f} s): "
            f"the {side} torque is reversed"
        )
        return text, f"give {side}_torque_sign = -1 {UNDER_TORQUE}"
    measured = f"alpha is {s.alpha:.3g} (m/s²)/(N·m) (t = {s.alpha_t:.0f} over {s.seconds:.0f} s)"
    if s.torques == Torques.REVERSED_AND_SWAPPED:
        text = f"{measured}: both torques are reversed, and left and right exchanged"
        return text, f"{BOTH_TORQUES}, and exchange left and right"
    return f"{measured}: both torques are reversed", BOTH_TORQUES


def turned(s: Snapshot) -> str:
    """That the torques turn the robot the other way."""
    return f"the torques turn the robot the other way (t = {s.turn_t:.0f} over {s.seconds:.0f} s)"


def sides_swapped(s: Snapshot) -> Told:
    """Left and right exchanged, or a pose whose y axis points right."""
    torques, wheels = s.torques in (Torques.SWAPPED, Torques.TURN_REVERSED), s.wheels == Wheels.SWAPPED
    if torques and wheels:
        text = (
            f"{turned(s)}, and so do the wheel speeds: the pose's y axis is to the right (NED), or left and "
        )
        advice = "publish the pose in a frame whose z axis points up, or exchange left and right in --map"
        return f"{text}right are exchanged", advice
    if torques:
        return f"{turned(s)}: left and right are exchanged", "exchange left and right of the torques in --map"
    text = "the wheel speeds turn the other way than the pose: left and right are exchanged"
    return text, "exchange left and right of the wheel speeds in --map; the modes do not need them"


def wheel_speed_sign(s: Snapshot) -> Told:
    """Reversed wheel speeds, both or one."""
    side = {Wheels.LEFT_REVERSED: "left", Wheels.RIGHT_REVERSED: "right"}.get(s.wheels)
    keys = f"{side}_sign = -1" if side else "left_sign = -1 and right_sign = -1"
    which = f"the {side} wheel turns" if side else "both wheels turn"
    return (
        f"{which} backwards while the robot moves ahead",
        f"give {keys} in the wheel_speeds section of --map",
    )

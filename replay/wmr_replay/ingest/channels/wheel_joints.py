"""Left and right wheels among joints, by their names and never by their positions in a message."""

import re
from collections.abc import Sequence

_LEFT = {"l", "fl", "rl", "bl", "ml", "lf", "lr", "lb", "lm"}
_RIGHT = {"r", "fr", "rr", "br", "mr", "rf", "rb", "rm"}
_DRIVE = ("wheel", "motor", "drive", "track")
_ROWS = ("front", "rear", "back", "mid", "center", "centre")
_NOT_DRIVEN = (
    "steer",
    "caster",
    "castor",
    "finger",
    "gripper",
    "arm",
    "shoulder",
    "elbow",
    "wrist",
    "knuckle",
    "susp",
)
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")

Sides = tuple[tuple[int, ...], tuple[int, ...]]


def side_of(name: str) -> str | None:
    """``left`` or ``right``, or None for a joint that names no side or is plainly no driven wheel."""
    lower = name.lower()
    if any(word in lower for word in _NOT_DRIVEN):
        return None
    words = {word.lower() for word in _WORDS.findall(name)}
    driven = any(word in lower for word in _DRIVE)
    left = "left" in lower or (driven and bool(words & _LEFT))
    right = "right" in lower or (driven and bool(words & _RIGHT))
    return ("left" if left else "right") if left != right else None


def wheel_joints(names: Sequence[str], left: Sequence[str] = (), right: Sequence[str] = ()) -> Sides | None:
    """Indices of the left and the right wheels among ``names``; None unless both sides are there.

    Given names count alone. Otherwise a joint belongs to a side when its name says so
    (``left_wheel_joint``, ``wheel_left_joint``, ``front_left_wheel``, ``fl_wheel``) and speaks of a wheel;
    without any such pair, one joint on each side is enough, or as many on each side whose names say in which
    row they are (``front_left``, ``rear_left``).
    """
    if left or right:
        given = tuple(tuple(names.index(name) for name in side if name in names) for side in (left, right))
        return (given[0], given[1]) if (len(given[0]), len(given[1])) == (len(left), len(right)) else None
    wheels = [k for k, name in enumerate(names) if any(word in name.lower() for word in _DRIVE)]
    found = _sides(names, wheels)
    if all(found):
        return found
    found = _sides(names, range(len(names)))
    if not found[0] or len(found[0]) != len(found[1]):
        return None
    in_rows = all(any(row in names[k].lower() for row in _ROWS) for side in found for k in side)
    return found if len(found[0]) == 1 or in_rows else None


def _sides(names: Sequence[str], indices: Sequence[int]) -> Sides:
    """Those of ``indices`` whose names say left, and those whose names say right."""
    return (
        tuple(k for k in indices if side_of(names[k]) == "left"),
        tuple(k for k in indices if side_of(names[k]) == "right"),
    )

"""A topic that was named and does not serve: what its channel holds instead, and the nearest names."""

import difflib
import re
from collections.abc import Iterable, Mapping

MOST_NEAR = 3
COMMANDED = re.compile(r"cmd|command|set_?point|target|desired|reference|goal", re.I)
"""Topics of what is wanted, not measured."""


def near_topics(topic: str, others: Iterable[str]) -> str:
    """``there is no topic /psoe; did you mean /pose?``, with the nearest by spelling, or by the last word."""
    there = sorted(set(others))
    if topic in there:
        return ""
    near = difflib.get_close_matches(topic, there, n=MOST_NEAR)
    tail = topic.rsplit("/", 1)[-1]
    near = near or [other for other in there if tail and other.rsplit("/", 1)[-1] == tail][:MOST_NEAR]
    meant = f"; did you mean {' or '.join(near)}?" if near else ""
    return f"There is no topic {topic}{meant or '.'}"


def kinds(role: str, serves_as: Mapping[str, tuple[str, ...]]) -> str:
    """What a channel serves as, where that is not the role looked for: ``torque, no pose``."""
    others = [kind for kinds in serves_as.values() for kind in kinds]
    return f"{', '.join(others)}, no {role.replace('_', ' ')}" if others and role not in serves_as else ""

"""Robots that the model does not describe, recognised by names: steered and omnidirectional ones.

The model is a differential drive (skid steering included): two driven sides, no steering, no sideways wheel.
"""

import re
from collections.abc import Sequence

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.decoding.layout import Undecodable

_STEERED = re.compile(r"steer|ackermann", re.I)
_SIDEWAYS = re.compile(r"mecanum|omni_?wheel|swerve|holonomic", re.I)
_CONSEQUENCE = (
    "the model is a differential drive, so its modes and α would not mean anything for such a robot"
)


def unsupported_kinds(found: Sequence[Candidate]) -> list[str]:
    """A remark for each kind of drive that the log's names indicate and the model does not describe."""
    names = [name for candidate in found for name in _names(candidate)]
    remarks = []
    for kind, pattern in (("steered", _STEERED), ("omnidirectional", _SIDEWAYS)):
        signs = list(dict.fromkeys(name for name in names if pattern.search(name)))
        if signs:
            remarks.append(f"the robot seems to be {kind} ({', '.join(signs[:4])}): {_CONSEQUENCE}")
    return remarks


def _names(candidate: Candidate) -> list[str]:
    """Topic and schema of a channel, and the joints of its first message."""
    names = [candidate.channel.topic, candidate.schema_name] if candidate.samples else []
    if candidate.mentions(b"effort") or candidate.short_name == "DynamicJointState":
        try:
            layout = candidate.definition.layout(candidate.samples[0].data)
        except (DoesNotServe, Undecodable, IndexError):
            return names
        names += [
            text.content for path, text in layout.texts.items() if path.startswith(("name[", "joint_names["))
        ]
    return names

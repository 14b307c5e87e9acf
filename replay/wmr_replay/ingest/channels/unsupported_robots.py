"""Robots that the model does not describe, recognised by names: steered and omnidirectional ones.

The model is a differential drive (skid steering included): two driven sides, no steering, no sideways wheel.
"""

import re
from collections.abc import Sequence

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.decoding.layout import Undecodable
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.mapping_file import LogMapping

_STEERED = re.compile(r"(?<!skid)(?<!skid[_\- /])(?<!differential_)(?<!diff_)steer|ackermann", re.I)
_SIDEWAYS = re.compile(r"mecanum|omni_?(wheel|drive|directional)|swerve|(?<!non)(?<!non[_\-])holonomic", re.I)
_SHOWN = 4


def drive_findings(found: Sequence[Candidate], mapping: LogMapping) -> list[Finding]:
    """A finding for each kind of drive that the log's names indicate and the model does not describe.

    A log may hold several robots: where the user names the channels, other channels' names bar nothing.
    """
    named = {mapping.pose_topic, mapping.torque_topic, mapping.wheel_speed_topic} - {None}
    chosen = [candidate for candidate in found if not named or candidate.channel.topic in named]
    findings = []
    if signs := _signs(found, _SIDEWAYS):
        severity = Severity.BARS if _signs(chosen, _SIDEWAYS) else Severity.WARNING
        findings.append(
            finding("drives_sideways", severity, f"the robot seems to be omnidirectional ({signs})")
        )
    if signs := _signs(found, _STEERED):
        severity = Severity.WARNING if _signs(chosen, _STEERED) else Severity.NOTE
        findings.append(finding("steered", severity, f"the robot seems to be steered ({signs})"))
    return findings


def _signs(found: Sequence[Candidate], pattern: re.Pattern[str]) -> str:
    """The first names that match, as a text."""
    names = dict.fromkeys(name for candidate in found for name in _names(candidate) if pattern.search(name))
    return ", ".join(list(names)[:_SHOWN])


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

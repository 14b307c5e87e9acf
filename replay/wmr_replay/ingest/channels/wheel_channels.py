"""Which channels hold measured and which hold commanded wheel speeds.

A joint state in use for its torques serves for its wheel speeds too. Where it has none, or there is no joint
state, the best channel of wheel speeds is looked for. It stands under the role ``torque`` where no channel
holds efforts, since a replay takes wheel speeds there, and otherwise under ``wheel_speed``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.channels.detect import Plan, Use, not_found
from wmr_replay.ingest.channels.first_rows import first_rows, has_efforts, has_speeds
from wmr_replay.ingest.channels.roles import UNRELATED, Rank
from wmr_replay.ingest.channels.wheel_bindings import InputBinding, made_up
from wmr_replay.ingest.channels.wheel_roles import NOTHING, command_role, wheel_speed_role
from wmr_replay.ingest.decoding.bindings import Binding
from wmr_replay.ingest.storage.source import LogPath
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.wheel_fields import WheelSpeedFields

WORDS = {"wheel_speed": "wheel speed", "command": "command"}
_TESTS = {"wheel_speed": wheel_speed_role, "command": command_role}
_RESERVED = ("pose", "truth")


@dataclass(frozen=True)
class Found:
    """A channel that serves, and how its messages are read."""

    rank: Rank
    candidate: Candidate
    binding: Binding

    @property
    def id(self) -> int:
        """The channel's id."""
        return self.candidate.channel.id

    @property
    def topic(self) -> str:
        """The channel's topic."""
        return self.candidate.channel.topic


def find_wheel_channels(
    path: LogPath, plan: Plan, candidates: Sequence[Candidate], mapping: LogMapping
) -> None:
    """Add wheel speeds and commands to a plan; ``mapping.robot`` holds all that is known of the robot.

    Raises ChannelNotFound where a topic that the user named does not serve.
    """
    _find_wheel_speeds(path, plan, candidates, mapping)
    ranked = _ranked(path, plan, "command", candidates, mapping, mapping.command_topic)
    if ranked:
        _choose(plan, "command", ranked, ranked[0].binding, mapping)


def _find_wheel_speeds(
    path: LogPath, plan: Plan, candidates: Sequence[Candidate], mapping: LogMapping
) -> None:
    """Give wheel speeds a channel, unless that of the torques has them."""
    torque, topic = plan.uses.get("torque"), mapping.wheel_speed_topic
    efforts, speeds = (False, False) if torque is None else held_by(torque)
    asked = topic is not None or mapping.wheel_speeds != WheelSpeedFields() or any(mapping.wheel_speed_joints)
    if not asked and (speeds or (torque is not None and mapping.torque_topic)):
        return
    ranked = _ranked(path, plan, "wheel_speed", candidates, mapping, topic)
    if efforts and not asked:
        ranked = [found for found in ranked if not _is_made_up(found.binding)]
    if not ranked:
        return
    if topic is None and torque is not None:
        ranked.sort(key=lambda found: found.id != torque.channel.id)
    best = ranked[0]
    if torque is not None and torque.channel.id == best.id:
        _choose(plan, "torque", ranked, InputBinding(best.binding, torque.binding), mapping)
    elif efforts:
        _choose(plan, "wheel_speed", ranked, best.binding, mapping)
    else:
        if torque is not None:
            plan.why_not[torque.channel.id] = f"{best.topic} comes first as wheel speed"
        _choose(plan, "torque", ranked, InputBinding(best.binding), mapping)


def held_by(use: Use) -> tuple[bool, bool]:
    """Whether the first messages of a channel hold efforts, and speeds, of both sides."""
    rows = first_rows(use.definition, use.binding, use.samples).values
    return has_efforts(rows), has_speeds(rows)


def _is_made_up(binding: Binding) -> bool:
    """Whether speeds were made by wheels that are not the robot's."""
    return bool(made_up(binding))


def _ranked(
    path: LogPath,
    plan: Plan,
    role: str,
    candidates: Sequence[Candidate],
    mapping: LogMapping,
    topic: str | None,
) -> list[Found]:
    """The channels that serve, best first; for others that came close the reason goes into the plan."""
    unnamed = replace(mapping, wheel_speed_topic=None, command_topic=None)
    ranked = []
    for candidate in candidates:
        if plan.role(candidate.channel.id) in _RESERVED or topic not in {None, candidate.channel.topic}:
            continue
        try:
            binding, rank = _TESTS[role](candidate, mapping if topic else unnamed, plan.frames)
        except DoesNotServe as reason:
            if topic or str(reason) != NOTHING:
                plan.lacks[role, candidate.channel.id] = str(reason)
                if plan.why_not.get(candidate.channel.id) == UNRELATED:
                    plan.why_not[candidate.channel.id] = str(reason)
            continue
        found = Found(rank, candidate, binding)
        plan.serves_as[found.id] = tuple(dict.fromkeys((*plan.serves_as.get(found.id, ()), WORDS[role])))
        ranked.append(found)
    fields = mapping.commands if role == "command" else mapping.wheel_speeds
    if (topic or fields.name_values) and not ranked:
        raise not_found(path, role, list(candidates), plan, topic)
    return sorted(ranked, key=lambda found: (found.rank, found.id))


def _choose(plan: Plan, role: str, ranked: list[Found], binding: Binding, mapping: LogMapping) -> None:
    """Give the role to the best, and note for the others that it comes first."""
    best, is_command = ranked[0], role == "command"
    for found in ranked[1:]:
        if plan.role(found.id) is None:
            what = WORDS["command" if is_command else "wheel_speed"]
            plan.why_not[found.id] = f"{best.topic} comes first as {what}"
    fields = mapping.commands if is_command else mapping.wheel_speeds
    candidate = best.candidate
    plan.uses[role] = Use(
        candidate.channel,
        candidate.schema_name,
        candidate.definition,
        binding,
        candidate.samples,
        fields.clock or mapping.clock,
    )
    plan.why_not.pop(best.id, None)

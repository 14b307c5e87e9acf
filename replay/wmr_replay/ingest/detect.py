"""Which channel is the pose, which the torques, which the truth, and why every other one is not.

What the user named wins. Otherwise an external pose comes before odometry, canonical topics come first, and
a joint state counts when it names a left and a right wheel.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from wmr_replay.ingest.bindings import Binding
from wmr_replay.ingest.encodings import Definition
from wmr_replay.ingest.records import Channel
from wmr_replay.ingest.roles import (
    POSE_SCHEMAS,
    UNRELATED,
    Candidate,
    DoesNotServe,
    Rank,
    is_odometry,
    pose_role,
    torque_role,
    truth_role,
)
from wmr_replay.ingest.sampling import Sample
from wmr_schemas.errors import ChannelNotFound
from wmr_schemas.mapping_file import LogMapping

Test = Callable[[Candidate, LogMapping], tuple[Binding, Rank]]
ROLES: dict[str, Test] = {"pose": pose_role, "torque": torque_role, "truth": truth_role}
WANTED = {
    "pose": f"pose ({', '.join(POSE_SCHEMAS)})",
    "torque": "wheel torques (a JointState with a left and a right wheel joint)",
    "truth": "true contact mode (ContactMode)",
}


@dataclass(frozen=True)
class Use:
    """A channel in use, and how its messages are read."""

    channel: Channel
    schema_name: str
    definition: Definition
    binding: Binding
    samples: tuple[Sample, ...]


@dataclass
class Plan:
    """The channels in use by role (``pose``, ``torque``, ``truth``); for every other id why not."""

    uses: dict[str, Use] = field(default_factory=dict)
    why_not: dict[int, str] = field(default_factory=dict)
    pose_is_odometry: bool = False

    @property
    def pose(self) -> Channel | None:
        """The pose channel."""
        return self.channel("pose")

    @property
    def torque(self) -> Channel | None:
        """The torque channel."""
        return self.channel("torque")

    @property
    def truth(self) -> Channel | None:
        """The channel with the true mode."""
        return self.channel("truth")

    def channel(self, role: str) -> Channel | None:
        """The channel in that role."""
        return self.uses[role].channel if role in self.uses else None

    def role(self, channel_id: int) -> str | None:
        """The role of a channel."""
        return next((role for role, use in self.uses.items() if use.channel.id == channel_id), None)

    def as_dict(self) -> dict[str, dict[str, object]]:
        """The channels in use by role, for the record."""
        return {
            role: {"id": use.channel.id, "topic": use.channel.topic, "schema": use.schema_name}
            for role, use in self.uses.items()
        }


def detect(path: Path, found: list[Candidate], mapping: LogMapping) -> Plan:
    """Assign the roles. Raises ChannelNotFound when something that the user named does not serve."""
    plan = Plan()
    topics = {"pose": mapping.pose_topic, "torque": mapping.torque_topic, "truth": mapping.truth_topic}
    joints = ", ".join((*mapping.left_joints, *mapping.right_joints))
    for role in ROLES:
        free = [
            c for c in found if plan.role(c.channel.id) is None and topics[role] in {None, c.channel.topic}
        ]
        _assign(plan, role, free, mapping)
        named = topics[role] or (joints if role == "torque" else "")
        if named and role not in plan.uses:
            raise not_found(path, role, found, plan, named)
    return plan


def _assign(plan: Plan, role: str, free: list[Candidate], mapping: LogMapping) -> None:
    ranked: list[tuple[Rank, int, Candidate, Binding]] = []
    for candidate in free:
        try:
            binding, rank = ROLES[role](candidate, mapping)
            ranked.append((rank, candidate.channel.id, candidate, binding))
        except DoesNotServe as reason:
            if str(reason) != UNRELATED:
                plan.why_not[candidate.channel.id] = str(reason)
            plan.why_not.setdefault(candidate.channel.id, UNRELATED)
    ranked.sort(key=lambda entry: entry[:2])
    for _, channel_id, _, _ in ranked[1:]:
        plan.why_not[channel_id] = f"{ranked[0][2].channel.topic} comes first as {role}"
    if ranked:
        _, channel_id, best, binding = ranked[0]
        plan.uses[role] = Use(best.channel, best.schema_name, best.definition, binding, best.samples)
        plan.why_not.pop(channel_id, None)
        plan.pose_is_odometry = is_odometry(best) if role == "pose" else plan.pose_is_odometry


def not_found(path: Path, role: str, found: list[Candidate], plan: Plan, named: str = "") -> ChannelNotFound:
    """The error that says what was looked for, what there is instead, and what to do."""
    wanted = f"{WANTED[role]} in {named}" if named else WANTED[role]
    available = [(c.channel.topic, c.schema_name, reason_against(plan, role, c.channel.id)) for c in found]
    advice = f"Name the topic with --{role} TOPIC, or map the log's topics and joints with --map FILE."
    return ChannelNotFound(wanted, path, available, advice)


def reason_against(plan: Plan, role: str, channel_id: int) -> str:
    """Why a channel is not used in a role."""
    other = plan.role(channel_id)
    if other is not None:
        return f"used as {other}"
    return plan.why_not.get(channel_id, f"not the {role} topic that was named")

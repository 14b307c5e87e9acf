"""Detection: a channel for each of pose, torque and true mode, and for every other channel a reason.

A topic that the user names is used. Otherwise an external pose comes before odometry, canonical topics come
first, and a joint state counts when it names a left and a right wheel. Wheel speeds and commands are found
last, see :mod:`wmr_replay.ingest.channels.wheel_channels`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.channels.first_rows import first_rows, has_efforts, has_speeds
from wmr_replay.ingest.channels.frames import Frames
from wmr_replay.ingest.channels.named import kinds, near_topics
from wmr_replay.ingest.channels.roles import (
    POSE_SCHEMAS,
    UNRELATED,
    Rank,
    is_odometry,
    pose_role,
    torque_role,
    truth_role,
)
from wmr_replay.ingest.channels.wheel_bindings import read_as
from wmr_replay.ingest.decoding.bindings import Binding
from wmr_replay.ingest.decoding.encodings import Definition
from wmr_replay.ingest.mcap.records import Channel
from wmr_replay.ingest.mcap.sampling import Sample
from wmr_replay.ingest.storage.source import LogPath
from wmr_schemas.errors import ChannelNotFound
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.units import Clock as ClockWish

Test = Callable[[Candidate, LogMapping, Frames], tuple[Binding, Rank]]
ROLES: dict[str, Test] = {"pose": pose_role, "torque": torque_role, "truth": truth_role}
WANTED = {
    "pose": f"pose ({', '.join(POSE_SCHEMAS)})",
    "torque": "wheel torques (a JointState or DynamicJointState with a left and a right wheel joint)",
    "truth": "true contact mode (ContactMode)",
    "wheel_speed": "wheel speeds (a JointState, a controller's state or odometry)",
    "command": "commands (a Twist, or wheel speeds by joints)",
}
_SECTIONS = {"wheel_speed": "wheel_speeds", "command": "commands"}
"""Of the mapping file, for roles that no option names."""


@dataclass(frozen=True)
class Use:
    """A channel in use, and how its messages are read."""

    channel: Channel
    schema_name: str
    definition: Definition
    binding: Binding
    samples: tuple[Sample, ...]
    clock: ClockWish | None = None


@dataclass
class Plan:
    """The channels in use by role (``pose``, ``torque``, ``truth``); for every other id why not."""

    uses: dict[str, Use] = field(default_factory=dict)
    why_not: dict[int, str] = field(default_factory=dict)
    serves_as: dict[int, tuple[str, ...]] = field(default_factory=dict)
    """By channel id what its first messages would serve for; see :func:`signals_in`."""
    lacks: dict[tuple[str, int], str] = field(default_factory=dict)
    """By role and channel id why a channel holds no wheel speeds or commands."""
    pose_is_odometry: bool = False
    frames: Frames = field(default_factory=Frames)

    @property
    def pose(self) -> Channel | None:
        """The channel of the pose, if there is one."""
        return self.channel("pose")

    @property
    def torque(self) -> Channel | None:
        """The channel of the torques, if there is one."""
        return self.channel("torque")

    @property
    def truth(self) -> Channel | None:
        """The channel of the true contact mode, if there is one."""
        return self.channel("truth")

    def channel(self, role: str) -> Channel | None:
        """The channel in that role, if there is one."""
        return self.uses[role].channel if role in self.uses else None

    def role(self, channel_id: int) -> str | None:
        """The role of a channel, or None."""
        return next((role for role, use in self.uses.items() if use.channel.id == channel_id), None)

    def as_dict(self) -> dict[str, dict[str, object]]:
        """Id, topic and schema of the channels in use, by role; ``read_as`` where wheel speeds are made of
        something else.
        """
        return {
            role: {
                "id": use.channel.id,
                "topic": use.channel.topic,
                "schema": use.schema_name,
                **({"read_as": words} if (words := read_as(use.binding)) else {}),
            }
            for role, use in self.uses.items()
        }


def detect(path: LogPath, found: list[Candidate], mapping: LogMapping) -> Plan:
    """Assign the roles. Raises ChannelNotFound when something that the user named does not serve."""
    plan = Plan(frames=Frames.of(found))
    topics = {"pose": mapping.pose_topic, "torque": mapping.torque_topic, "truth": mapping.truth_topic}
    joints = ", ".join((*mapping.left_joints, *mapping.right_joints))
    for role, topic in topics.items():
        free = [candidate for candidate in found if plan.role(candidate.channel.id) is None]
        ranked = _rank(plan, role, free, mapping, topic)
        if ranked:
            _choose(plan, role, ranked, mapping)
        elif topic or (joints and role == "torque"):
            raise not_found(path, role, found, plan, topic, "" if topic else f" with joints {joints}")
    return plan


def _rank(
    plan: Plan, role: str, free: list[Candidate], mapping: LogMapping, topic: str | None
) -> list[tuple[Rank, int, Candidate, Binding]]:
    """Those that serve, best first; for the others the reason goes into the plan."""
    ranked = []
    unnamed = replace(mapping, pose_topic=None, torque_topic=None, truth_topic=None)
    for candidate in free:
        named = topic == candidate.channel.topic
        try:
            binding, rank = ROLES[role](candidate, mapping if named else unnamed, plan.frames)
        except DoesNotServe as reason:
            if str(reason) != UNRELATED:
                plan.why_not[candidate.channel.id] = str(reason)
            plan.why_not.setdefault(candidate.channel.id, UNRELATED)
        else:
            plan.serves_as[candidate.channel.id] = signals_in(role, candidate, binding)
            plan.why_not[candidate.channel.id] = f"would serve as {role}, but {topic} was named"
            if named or topic is None:
                ranked.append((rank, candidate.channel.id, candidate, binding))
    return sorted(ranked, key=lambda entry: entry[:2])


def _choose(
    plan: Plan, role: str, ranked: list[tuple[Rank, int, Candidate, Binding]], mapping: LogMapping
) -> None:
    """Give the role to the best candidate, and note for the others that it comes first."""
    _, chosen_id, best, binding = ranked[0]
    for _, channel_id, _, _ in ranked[1:]:
        plan.why_not[channel_id] = f"{best.channel.topic} comes first as {role}"
    own = {"pose": mapping.pose.clock, "torque": mapping.torque.clock, "truth": mapping.truth.clock}[role]
    plan.uses[role] = Use(
        best.channel, best.schema_name, best.definition, binding, best.samples, own or mapping.clock
    )
    plan.why_not.pop(chosen_id)
    if role == "pose":
        plan.pose_is_odometry = is_odometry(best, binding)


def signals_in(role: str, candidate: Candidate, binding: Binding) -> tuple[str, ...]:
    """What a channel would serve for in words: ``pose``, ``odometry``, ``torque``, ``wheel speed``,
    ``truth``. A joint state without efforts is no torque.
    """
    if role == "pose":
        return ("odometry",) if is_odometry(candidate, binding) else ("pose",)
    if role == "truth":
        return ("truth",)
    values = first_rows(candidate.definition, binding, candidate.samples).values
    found = {"torque": has_efforts(values), "wheel speed": has_speeds(values)}
    return tuple(name for name, there in found.items() if there)


def not_found(
    path: LogPath,
    role: str,
    found: list[Candidate],
    plan: Plan,
    topic: str | None = None,
    joints: str = "",
) -> ChannelNotFound:
    """The error that says what was looked for, what there is instead, and what to do.

    ``topic``: the one that was named, if any; ``joints``: those that were named, in words.
    """
    available = [(c.channel.topic, c.schema_name, reason(c, role, plan)) for c in found]
    wanted = WANTED[role] + (f" on topic {topic}" if topic else joints)
    advice = f"Name the topic with --{role} TOPIC, or map the log's topics and joints with --map FILE."
    if role in _SECTIONS:
        advice = f"Name topic and fields in [{_SECTIONS[role]}] of --map FILE."
    near = near_topics(topic, (c.channel.topic for c in found)) if topic else ""
    return ChannelNotFound(wanted, path, available, f"{near}\n{advice}" if near else advice)


def reason(candidate: Candidate, role: str, plan: Plan) -> str:
    """Why a channel does not serve in a role: what it is instead, else what it lacks."""
    serves_as, lacks = {}, []
    for name, test in ROLES.items():
        try:
            binding, _ = test(candidate, LogMapping(), plan.frames)
            serves_as[name] = signals_in(name, candidate, binding)
        except DoesNotServe as why:
            lacks += [str(why)] if str(why) != UNRELATED else []
    used_as = plan.role(candidate.channel.id)
    if (role, candidate.channel.id) in plan.lacks:
        return plan.lacks[role, candidate.channel.id]
    if used_as in ROLES and used_as != role:
        return f"in use as {used_as}"
    noted = plan.why_not.get(candidate.channel.id, UNRELATED)
    return kinds(role, serves_as) or (lacks[0] if lacks and noted == UNRELATED else noted)

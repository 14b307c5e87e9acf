"""Whether a channel can serve as pose, torque or truth, by schema and content, and how well."""

import re
from dataclasses import dataclass
from functools import cached_property

from wmr_replay.ingest.bindings import Binding, ModeBinding, NotConcerned, PoseBinding, Recipe, TorqueBinding
from wmr_replay.ingest.definitions import UnknownDefinition
from wmr_replay.ingest.encodings import Definition, define
from wmr_replay.ingest.layout import Undecodable
from wmr_replay.ingest.records import Channel, Schema
from wmr_replay.ingest.sampling import Sample
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.messages import MODE_TOPIC, POSE_TOPIC, TORQUE_TOPIC

POSE_SCHEMAS = ("PoseStamped", "PoseInFrame", "TransformStamped", "PoseWithCovarianceStamped", "Odometry")
"""In the order of preference."""
_POSE_FORMS = (
    ("pose.position", "pose.orientation"),
    ("pose.pose.position", "pose.pose.orientation"),
    ("transform.translation", "transform.rotation"),
    ("position", "orientation"),
    ("translation", "rotation"),
)
_STAMPS = ("header.stamp", "timestamp", "stamp", "header.timestamp", "time")
_SECONDS = (("sec", "nanosec"), ("sec", "nsec"), ("seconds", "nanos"), ("secs", "nsecs"))
_NO_MEASUREMENT = re.compile(
    r"goal|initial_?pose|target|setpoint|command|cmd|desired|reference|plan|waypoint", re.I
)
UNRELATED = "no pose, joint state or contact mode"
_OTHER_USES = {
    "Twist": "velocities, no pose",
    "TwistStamped": "velocities, no pose",
    "Imu": "rates and accelerations, no pose",
    "NavSatFix": "a position without a heading",
    "TFMessage": "transforms are not read",
    "FrameTransform": "transforms are not read",
    "FrameTransforms": "transforms are not read",
}

Rank = tuple[int, ...]
"""The smallest serves best."""


class DoesNotServe(Exception):
    """Why a channel does not serve."""


@dataclass(frozen=True)
class Candidate:
    """A channel with its schema and its first messages."""

    channel: Channel
    schema: Schema | None
    samples: tuple[Sample, ...]
    n_messages: int = 0
    """As far as the file's index and statistics tell; a lower bound otherwise."""

    @property
    def schema_name(self) -> str:
        """The schema's name, for people."""
        return self.schema.name if self.schema else "no schema"

    @property
    def short_name(self) -> str:
        """The schema's name without its package."""
        return re.split(r"[/.:]", self.schema.name)[-1] if self.schema else ""

    def mentions(self, word: bytes) -> bool:
        """Whether the word occurs in the schema or, for want of one, in a message: a cheap first test."""
        if self.schema and word in self.schema.data:
            return True
        return self.channel.message_encoding == "json" and any(word in sample.data for sample in self.samples)

    @cached_property
    def definition(self) -> Definition:
        """What its messages are made of. Raises DoesNotServe."""
        if not self.samples:
            raise DoesNotServe("no message")
        try:
            return define(self.channel, self.schema, [sample.data for sample in self.samples])
        except UnknownDefinition as error:
            raise DoesNotServe(str(error)) from None

    def try_out(self, binding: Binding) -> Recipe:
        """What the binding takes from the first message that concerns it. Raises DoesNotServe."""
        problem = ""
        for sample in self.samples:
            try:
                return binding.recipe(self.definition.layout(sample.data))
            except NotConcerned as reason:
                problem = problem or str(reason)
            except Undecodable as error:
                problem = problem or f"its first messages do not fit its schema ({error})"
        raise DoesNotServe(problem)


def stamp_paths(definition: Definition) -> tuple[str, str] | None:
    """Where the messages carry their own time."""
    for stem in _STAMPS:
        for names in _SECONDS:
            paths = f"{stem}.{names[0]}", f"{stem}.{names[1]}"
            if all(definition.has(path) for path in paths):
                return paths
    return None


def is_odometry(candidate: Candidate) -> bool:
    """Whether the pose may well have been integrated from wheel speeds, by its name."""
    return candidate.short_name == "Odometry" or "odom" in candidate.channel.topic.lower()


def pose_role(candidate: Candidate, mapping: LogMapping) -> tuple[Binding, Rank]:
    """Position and orientation; external before odometry, then the canonical topic, then the schema."""
    topic, name = candidate.channel.topic, candidate.short_name
    if mapping.pose_topic is None:
        if name not in POSE_SCHEMAS and not (candidate.schema is None and candidate.mentions(b"orientation")):
            raise DoesNotServe(_OTHER_USES.get(name, UNRELATED))
        if _NO_MEASUREMENT.search(topic):
            raise DoesNotServe("by its topic a wanted pose, not a measured one")
    definition = candidate.definition
    form = next((f for f in _POSE_FORMS if definition.has(f"{f[0]}.x") and definition.has(f"{f[1]}.w")), None)
    if form is None:
        raise DoesNotServe("no position with an orientation")
    binding = PoseBinding(*form, stamp_paths(definition))
    candidate.try_out(binding)
    kind = POSE_SCHEMAS.index(name) if name in POSE_SCHEMAS else len(POSE_SCHEMAS)
    return binding, (is_odometry(candidate), topic != POSE_TOPIC, kind, -candidate.n_messages)


def torque_role(candidate: Candidate, mapping: LogMapping) -> tuple[Binding, Rank]:
    """Joint states that name wheels; those with efforts first, then the canonical topic."""
    if mapping.torque_topic is None and not candidate.mentions(b"effort"):
        raise DoesNotServe(UNRELATED)
    definition = candidate.definition
    if not all(definition.has(path) for path in ("name", "effort")):
        raise DoesNotServe(UNRELATED if mapping.torque_topic is None else "no field name with a field effort")
    binding = TorqueBinding(stamp_paths(definition), mapping.left_joints, mapping.right_joints)
    recipe = candidate.try_out(binding)
    return binding, (
        not recipe.columns[0].terms,
        candidate.channel.topic != TORQUE_TOPIC,
        -candidate.n_messages,
    )


def truth_role(candidate: Candidate, mapping: LogMapping) -> tuple[Binding, Rank]:
    """A contact mode; the canonical topic first."""
    if mapping.truth_topic is None and not candidate.short_name.endswith("ContactMode"):
        raise DoesNotServe(UNRELATED)
    if not candidate.definition.has("mode"):
        raise DoesNotServe("no field mode")
    binding = ModeBinding(stamp_paths(candidate.definition))
    candidate.try_out(binding)
    return binding, (candidate.channel.topic != MODE_TOPIC, -candidate.n_messages)

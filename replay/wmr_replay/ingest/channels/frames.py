"""The frames of a log: moving transforms by channel and static ones, from the first messages."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.channels.composed_transforms import ComposedBinding
from wmr_replay.ingest.channels.transforms import Edge, Entry, Rigid, TransformBinding, entries
from wmr_replay.ingest.decoding.bindings import Binding
from wmr_replay.ingest.decoding.layout import Layout, Undecodable
from wmr_replay.ingest.decoding.ros_definitions import UnknownDefinition

TRANSFORM_SCHEMAS = ("TFMessage", "TransformStamped", "FrameTransform", "FrameTransforms")
_WORLDS = ("map", "world", "earth", "vicon", "mocap", "optitrack", "utm", "enu", "odom")
"""Names of frames that stand still, best first; the last is the start of wheel odometry."""
_BODIES = ("base_link", "base_footprint", "base", "body", "robot")


@dataclass
class Frames:
    """Edges (parent, child): moving ones by channel id with an example, and rigid ones with their value."""

    moving: dict[int, dict[Edge, Entry]] = field(default_factory=dict)
    rigid: dict[Edge, Rigid] = field(default_factory=dict)

    @classmethod
    def of(cls, found: Sequence[Candidate]) -> "Frames":
        """From the first messages of all channels with transforms."""
        frames = cls()
        for candidate in found:
            if candidate.short_name in TRANSFORM_SCHEMAS:
                frames._add(candidate)
        return frames

    def _add(self, candidate: Candidate) -> None:
        """Enter the transforms of a channel's first messages; those of a static topic are rigid."""
        for sample in candidate.samples:
            try:
                layout = candidate.definition.layout(sample.data)
            except (Undecodable, DoesNotServe, UnknownDefinition):
                continue
            for entry in entries(layout):
                if "static" in candidate.channel.topic:
                    self.rigid[entry.edge] = _value(candidate, layout, entry)
                else:
                    self.moving.setdefault(candidate.channel.id, {})[entry.edge] = entry

    def rigid_path(self, start: str, end: str) -> Rigid | None:
        """The rigid transform from one frame to another, composed of rigid edges alone; None if there is
        none.
        """
        waiting, ways = deque([start]), {start: Rigid()}
        while waiting and end not in ways:
            here = waiting.popleft()
            for (parent, child), value in self.rigid.items():
                for a, b, step in ((parent, child, value), (child, parent, value.inverse())):
                    if a == here and b not in ways:
                        ways[b] = ways[here].then(step)
                        waiting.append(b)
        return ways.get(end)

    def binding(
        self, channel_id: int, parent: str | None, child: str | None, *, alone: bool = False
    ) -> Binding:
        """The pose of ``child`` in ``parent``, of the likeliest frames where they are None.

        ``alone``: the channel is there for one transform, whatever its frames' names. Raises DoesNotServe.
        """
        edges = self.moving.get(channel_id, {})
        known = ", ".join(f"{a} → {b}" for a, b in edges) or "nothing"
        if parent is not None and child is not None:
            if (
                found := self._single(edges, parent, child) or self._double(edges, parent, child)
            ) is not None:
                return found
            raise DoesNotServe(f"no one or two moving transforms from {parent} to {child}; it moves {known}")
        fitting = [e for e in edges if parent in {None, e[0]} and child in {None, e[1]}]
        ranked = sorted((rank, e) for e in fitting if (rank := _rank(e)) is not None)
        if parent is not None or child is not None or (alone and len(edges) == 1):
            ranked = ranked or [((0, 0), e) for e in fitting]
        if not ranked:
            raise DoesNotServe(f"it moves {known}: name the frames of a pose, parent and child")
        edge = ranked[0][1]
        return TransformBinding(edge, edges[edge].stamp)

    def _single(self, edges: dict[Edge, Entry], parent: str, child: str) -> Binding | None:
        """One moving transform between two rigid ones that together lead from parent to child."""
        for edge, entry in edges.items():
            before, after = self.rigid_path(parent, edge[0]), self.rigid_path(edge[1], child)
            if before is not None and after is not None:
                return TransformBinding(edge, entry.stamp, before, after)
        return None

    def _double(self, edges: dict[Edge, Entry], parent: str, child: str) -> Binding | None:
        """Two moving transforms with rigid ones around them that together lead from parent to child."""
        for first, second in permutations(edges, 2):
            ways = (
                self.rigid_path(parent, first[0]),
                self.rigid_path(first[1], second[0]),
                self.rigid_path(second[1], child),
            )
            before, between, after = ways
            if before is not None and between is not None and after is not None:
                return ComposedBinding(first, second, edges[second].stamp, before, between, after)
        return None


def _rank(edge: Edge) -> tuple[int, int] | None:
    """How likely an edge is to be a robot's pose."""
    parent, child = (name.rpartition("/")[2].lower() for name in edge)
    if parent not in _WORLDS or child not in _BODIES:
        return None
    return _WORLDS.index(parent), _BODIES.index(child)


def _value(candidate: Candidate, layout: Layout, entry: Entry) -> Rigid:
    """A rigid transform's numbers; a rotation of norm 0 counts as none."""
    data = np.frombuffer(layout.exemplar, np.uint8)
    source = candidate.definition.source(data, np.zeros(1, np.int64), np.array([len(data)]))

    def number(path: str) -> float:
        leaf = layout.leaf(path)
        return float(source.table(np.zeros(1, np.int64), [leaf])[0, 0]) if leaf else 0.0

    place = [number(f"{entry.translation}.{axis}") for axis in "xyz"]
    turn = np.array([number(f"{entry.rotation}.{axis}") for axis in "xyzw"])
    norm = float(np.linalg.norm(turn))
    x, y, z, w = (turn / norm).tolist() if norm else (0.0, 0.0, 0.0, 1.0)
    return Rigid((place[0], place[1], place[2]), (x, y, z, w))

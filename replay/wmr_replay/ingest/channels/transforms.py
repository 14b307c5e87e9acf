"""Poses out of transforms: ``tf2_msgs/TFMessage``, ``TransformStamped``, ``foxglove.FrameTransform(s)``.

One transform of a message moves (parent → child); static transforms may precede and follow it.
"""

from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest.decoding.bindings import NotConcerned, Recipe, one, stamp_terms, upright_of, yaw_of
from wmr_replay.ingest.decoding.layout import Layout, Text
from wmr_schemas.arrays import F64

_STAMPS = (
    ("header.stamp.sec", "header.stamp.nanosec"),
    ("timestamp.sec", "timestamp.nanosec"),
    ("timestamp.sec", "timestamp.nsec"),
    ("timestamp.seconds", "timestamp.nanos"),
)
_FORMS = (
    ("header.frame_id", "child_frame_id", "transform.translation", "transform.rotation"),
    ("parent_frame_id", "child_frame_id", "translation", "rotation"),
)
_ARRAY = "transforms"
Edge = tuple[str, str]


@dataclass(frozen=True)
class Rigid:
    """A rotation (quaternion x, y, z, w of norm 1) followed by a translation."""

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    def inverse(self) -> "Rigid":
        """The inverse transform, from the child to the parent."""
        x, y, z, w = self.rotation
        back = np.array((-x, -y, -z, w))
        place = -rotate(back, np.array(self.translation))
        return Rigid(tuple(place.tolist()), tuple(back.tolist()))

    def then(self, after: "Rigid") -> "Rigid":
        """Self ∘ after: a point of the frame behind ``after`` in the frame in front of ``self``."""
        quaternion = np.array(self.rotation)
        place = np.array(self.translation) + rotate(quaternion, np.array(after.translation))
        turn = multiply(quaternion, np.array(after.rotation))
        return Rigid(tuple(place.tolist()), tuple(turn.tolist()))


@dataclass(frozen=True)
class Entry:
    """One transform of a message: the frames, and the paths of its fields."""

    edge: Edge
    stamp: tuple[str, str] | None
    translation: str
    rotation: str
    frames: tuple[Text, Text]

    @property
    def numbers(self) -> list[str]:
        """Paths of the translation's x, y, z and the rotation's x, y, z, w."""
        return [f"{self.translation}.{a}" for a in "xyz"] + [f"{self.rotation}.{a}" for a in "xyzw"]


def entries(layout: Layout) -> list[Entry]:
    """The transforms that a message holds."""
    n = layout.counts.get(_ARRAY)
    stems = [""] if n is None else [f"{_ARRAY}[{k}]." for k in range(n)]
    return [entry for stem in stems if (entry := _entry(layout, stem)) is not None]


def _entry(layout: Layout, stem: str) -> Entry | None:
    """The transform whose fields start with ``stem``, in one of the known forms."""
    for parent, child, translation, rotation in _FORMS:
        frames = layout.texts.get(stem + parent), layout.texts.get(stem + child)
        if frames[0] is not None and frames[1] is not None:
            edge = frames[0].content.lstrip("/"), frames[1].content.lstrip("/")
            stamps = [(stem + seconds, stem + nanoseconds) for seconds, nanoseconds in _STAMPS]
            there = [sum(layout.leaf(path) is not None for path in paths) for paths in stamps]
            stamp = stamps[there.index(max(there))] if any(there) else None
            return Entry(edge, stamp, stem + translation, stem + rotation, (frames[0], frames[1]))
    return None


def fixed_entries(layout: Layout) -> list[Entry]:
    """The transforms that a message holds; the names of all their frames join the skeleton."""
    found = entries(layout)
    for entry in found:
        for text in entry.frames:
            layout.fix(text.offset, text.offset + text.extent)
    return found


@dataclass(frozen=True)
class TransformBinding:
    """The moving transform ``edge``, with what is rigidly in front of it and behind it; values x, y, yaw."""

    edge: Edge
    stamp: tuple[str, str] | None
    before: Rigid = Rigid()
    after: Rigid = Rigid()
    n_raw: int = 7

    def recipe(self, layout: Layout) -> Recipe:
        """Translation x, y, z and rotation x, y, z, w. The names of all frames join the skeleton."""
        mine = next((entry for entry in fixed_entries(layout) if entry.edge == self.edge), None)
        if mine is None:
            raise NotConcerned(f"no transform {' → '.join(self.edge)}")
        return Recipe(stamp_terms(layout, mine.stamp), tuple(one(layout, path) for path in mine.numbers))

    def values(self, raw: F64) -> F64:
        """x, y and yaw (3, n) of before ∘ transform ∘ after."""
        place, turn = self._whole(raw)
        return np.stack((place[0], place[1], yaw_of(turn)))

    def attitude(self, raw: F64) -> F64:
        """The upright axis in the body's frame and the height (4, n)."""
        place, turn = self._whole(raw)
        return np.concatenate([upright_of(turn), place[2:3]])

    def _whole(self, raw: F64) -> tuple[F64, F64]:
        """Translation (3, n) and rotation (4, n) of before ∘ transform ∘ after."""
        place, turn = raw[:3], raw[3:]
        with np.errstate(invalid="ignore"):
            turn = turn / np.sqrt((turn**2).sum(axis=0))
        if self.after != Rigid():
            place = place + rotate(turn, np.array(self.after.translation)[:, None])
            turn = multiply(turn, np.array(self.after.rotation)[:, None])
        if self.before != Rigid():
            first = np.array(self.before.rotation)[:, None]
            place = np.array(self.before.translation)[:, None] + rotate(first, place)
            turn = multiply(first, turn)
        return place, turn


def multiply(p: F64, q: F64) -> F64:
    """Hamilton's product p·q of quaternions (x, y, z, w), (4,) or (4, n)."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return np.stack((
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    ))  # fmt: skip


def rotate(q: F64, v: F64) -> F64:
    """The vector v (3,) or (3, n) turned by the unit quaternion q: v + 2w(u × v) + 2u × (u × v)."""
    shape = np.broadcast_shapes(q[:3].shape, v.shape)
    u, v = np.broadcast_to(q[:3], shape), np.broadcast_to(v, shape)
    once = np.cross(u, v, axis=0)
    turned: F64 = v + 2 * (q[3] * once + np.cross(u, once, axis=0))
    return turned

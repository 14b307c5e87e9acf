"""Groups of chunks: which chunks are read together, and that the rows do not depend on it."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from wmr_replay.ingest import open_log
from wmr_replay.ingest.mcap import prefetch
from wmr_replay.ingest.mcap.chunks import Span
from wmr_schemas import PoseTrack, TorqueTrack
from wmr_schemas.messages import ros2

T0, STEP = 1_700_000_000_000_000_000, 1_000_000
BYTES, MESSAGES = prefetch._GROUP_BYTES, prefetch._GROUP_MESSAGES

spans = st.builds(
    lambda part, size, n: (part, size, n),
    st.integers(0, 2),
    st.integers(0, 2 * BYTES),
    st.integers(0, 2 * MESSAGES),
)


@given(st.lists(spans, max_size=30))
def test_a_group_is_of_one_file_and_within_both_bounds_and_could_not_be_longer(drawn):
    given_spans = [
        Span(k, k, size, counts={1: n} if n else {}, file_index=part)
        for k, (part, size, n) in enumerate(sorted(drawn, key=lambda each: each[0]))
    ]
    found = list(prefetch.groups(given_spans))
    assert [span for group in found for span in group] == given_spans

    def extent(group):
        n_messages = [sum(span.counts.values()) or span.data_bytes // 128 for span in group]
        return sum(span.data_bytes for span in group), sum(n_messages)

    def fits(group):
        n_bytes, n_messages = extent(group)
        return len({span.file_index for span in group}) == 1 and n_bytes <= BYTES and n_messages <= MESSAGES

    assert all(fits(group) or len(group) == 1 for group in found)
    assert not any(fits([*group, following[0]]) for group, following in pairwise(found))


def log(path, rows_per_layout, **options):
    """Poses and torques in turns; frames of two lengths give the poses two layouts, in stretches."""
    n = 600
    rng = np.random.default_rng(0)
    t_ns = T0 + np.arange(n) * STEP
    pose = PoseTrack(t_ns, *rng.normal(size=(3, n)))
    poses = ros2.CODEC.encode_pose(pose)
    longer = [m[:12] + (8).to_bytes(4, "little") + b"chassis\0\0\0\0\0" + m[20:] for m in poses]
    torques = ros2.CODEC.encode_torque(TorqueTrack(t_ns, *rng.normal(size=(4, n))), None)
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4000, **options)
        writer.start("ros2")
        ids = [
            writer.register_channel(topic, "cdr", writer.register_schema(s.name, "ros2msg", s.definition))
            for topic, s in (("/pose", ros2.CODEC.pose), ("/torques", ros2.CODEC.torque))
        ]
        for k in range(n):
            body = (poses, longer)[k // rows_per_layout % 2][k]
            writer.add_message(ids[0], int(t_ns[k]), body, int(t_ns[k]))
            writer.add_message(ids[1], int(t_ns[k]), torques[k], int(t_ns[k]))
        writer.finish()
    return path, pose


def rows(path):
    """What the log gives, joined, and in how many batches."""
    batches = list(open_log(path).batches())
    return len(batches), {
        (signal, name): np.concatenate([getattr(getattr(b, signal), name) for b in batches], axis=-1)
        for signal in ("pose", "torque")
        for name in ("t_ns", "order", "values")
    }


@pytest.mark.parametrize("options", [{}, {"use_statistics": False}, {"compression": CompressionType.LZ4}])
@pytest.mark.parametrize("rows_per_layout", [1, 7, 250])
def test_the_cut_into_groups_changes_no_bit(tmp_path, monkeypatch, options, rows_per_layout):
    path, pose = log(tmp_path / "a.mcap", rows_per_layout, **options)
    n_whole, whole = rows(path)
    assert n_whole == 1
    assert np.array_equal(whole["pose", "t_ns"], pose.t_ns)
    assert np.array_equal(whole["pose", "values"][:2], (pose.x_m, pose.y_m))
    for n_bytes in (1, 9000, 50_000):
        monkeypatch.setattr(prefetch, "_GROUP_BYTES", n_bytes)
        n_batches, cut = rows(path)
        assert n_batches > 1
        assert all(np.array_equal(cut[key], whole[key], equal_nan=True) for key in whole)


def torque_log(path, messages, t_ns):
    """These joint states and nothing else, in short chunks; how many are in each."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=3000, compression=CompressionType.ZSTD)
        writer.start("ros2")
        schema = writer.register_schema(ros2.CODEC.torque.name, "ros2msg", ros2.CODEC.torque.definition)
        channel = writer.register_channel("/t", "cdr", schema)
        for t, message in zip(t_ns.tolist(), messages, strict=True):
            writer.add_message(channel, t, message, t)
        writer.finish()
    reader = open_log(path, need_pose=False)
    return reader, [sum(span.counts.values()) for span in reader.survey.spans]


def test_joint_states_without_wheels_are_left_out_whatever_is_read_behind_them(tmp_path, monkeypatch):
    """Chunk by chunk in turns, built alike, so that one lies where the other was."""
    monkeypatch.setattr(prefetch, "_GROUP_BYTES", 1)
    t_ns = T0 + np.arange(400) * STEP
    wheels = ros2.CODEC.encode_torque(TorqueTrack(t_ns, *np.ones((4, 400))), None)
    arms = [message.replace(b"_wheel_", b"_elbow_") for message in wheels]
    _, counts = torque_log(tmp_path / "wheels.mcap", wheels, t_ns)
    is_arm = np.repeat(np.arange(len(counts)) % 3 > 0, counts)
    mixed = [(wheel, arm)[k] for wheel, arm, k in zip(wheels, arms, is_arm.tolist(), strict=True)]
    reader, same_counts = torque_log(tmp_path / "mixed.mcap", mixed, t_ns)
    assert same_counts == counts
    batches = list(reader.batches())
    assert len(batches) == len(counts) > 20
    assert np.array_equal(np.concatenate([batch.torque.t_ns for batch in batches]), t_ns[~is_arm])
    assert reader.remarks == [f"/t: {is_arm.sum()} messages name no wheel joint"]

"""``info`` of logs with many chunks or rows: its cost hardly grows with them, and it says what it read."""

import sqlite3
import struct
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import Stores, get_typestore

import wmr_replay as wr
from wmr_replay.cli.printing.info import part_read
from wmr_replay.ingest.bags.ros1_bag import Ros1Bag
from wmr_replay.ingest.mcap import chunk_index as chunk_indexes
from wmr_replay.ingest.mcap import index_survey, stretches
from wmr_replay.ingest.mcap.chunk_index import ChunkIndex, chunk_index, joined
from wmr_replay.ingest.mcap.index_survey import indexed_survey
from wmr_replay.ingest.mcap.records import Malformed
from wmr_schemas import PoseTrack
from wmr_schemas.messages import ros2

T0, STEP_NS = 1_700_000_000_000_000_000, 10_000_000
POSE = "geometry_msgs/msg/PoseStamped"


def poses(n: int) -> list[bytes]:
    """Messages of a robot that drives in a circle."""
    t_ns, angle = T0 + np.arange(n) * STEP_NS, np.arange(n) * 0.01
    return ros2.CODEC.encode_pose(PoseTrack(t_ns, np.sin(angle), -np.cos(angle), angle))


def mcap(path: Path, n: int) -> Path:
    """A log of n poses, a chunk for each; a text with every 50th."""
    codec = ros2.CODEC
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=64, compression=CompressionType.NONE)
        writer.start()
        text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        schema = writer.register_schema(codec.pose.name, "ros2msg", codec.pose.definition)
        chat, pose = (
            writer.register_channel("/chat", "cdr", text),
            writer.register_channel("/pose", "cdr", schema),
        )
        for k, message in enumerate(poses(n)):
            t = T0 + k * STEP_NS
            if k % 50 == 7:
                writer.add_message(chat, t, b"\0\1\0\0\1\0\0\0\0", t)
            writer.add_message(pose, t, message, t)
        writer.finish()
    return path


def db3(path: Path, n: int, *, indexed: bool = True) -> Path:
    """A bag of n poses in SQLite form, without and with rosbag2's index; a second pose from the middle on."""
    rows = [(1, T0 + k * STEP_NS, message) for k, message in enumerate(poses(n))]
    rows[n // 2 :: 10] = [(2, *row[1:]) for row in rows[n // 2 :: 10]]
    with sqlite3.connect(path) as bag:
        bag.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format)")
        bag.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        topics = [(1, "/pose", POSE, "cdr"), (2, "/late", POSE, "cdr"), (3, "/never", POSE, "cdr")]
        bag.executemany("INSERT INTO topics VALUES (?, ?, ?, ?)", topics)
        bag.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
        if indexed:
            bag.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    return path


def bag(path: Path, n: int) -> Path:
    """A ROS 1 bag of n poses by two publishers, a chunk for each; a text with every 50th."""
    path = path.with_suffix(".bag")
    kinds = get_typestore(Stores.ROS1_NOETIC)
    writer = Ros1Writer(path)
    writer.chunk_threshold = 64
    with writer:
        poses = [
            writer.add_connection("/pose", POSE, typestore=kinds, callerid=f"/node{k}") for k in range(2)
        ]
        chat = writer.add_connection("/chat", "std_msgs/msg/String", typestore=kinds)
        for k in range(n):
            t = T0 + k * STEP_NS
            stamp = struct.pack("<3I", k, t // 10**9, t % 10**9)
            frame, numbers = struct.pack("<I3s", 3, b"map"), struct.pack("<7d", np.sin(k * 0.01), *[0] * 5, 1)
            if k % 50 == 7:
                writer.write(chat, t, struct.pack("<I2s", 2, b"hi"))
            writer.write(poses[k % 2], t, stamp + frame + numbers)
    return path


def info_s(path: Path) -> float:
    """Processor time of ``info``, the better of three."""
    taken = []
    for _ in range(3):
        start = time.process_time()
        assert not wr.open_log(path).info().complete
        taken.append(time.process_time() - start)
    return min(taken)


@pytest.mark.parametrize("make", [mcap, db3, bag])
def test_ten_times_the_chunks_or_rows_cost_less_than_three_times_as_much(tmp_path, monkeypatch, make):
    monkeypatch.setattr(stretches, "WHOLE_BYTES", 12 << 20)
    monkeypatch.setattr(stretches, "SAMPLED_BYTES", 8 << 20)
    n = {mcap: 1500, db3: 24_000, bag: 2000}[make]
    small, large = make(tmp_path / "small", n), make(tmp_path / "large", 10 * n)
    assert info_s(large) < 3 * info_s(small)


def test_chunks_by_the_index_are_those_that_the_mcap_library_reads(tmp_path):
    path = mcap(tmp_path / "a.mcap", 200)
    with path.open("rb") as file:
        expected = make_reader(file).get_summary().chunk_indexes
        spans = indexed_survey(file, path.stat().st_size).spans
    assert isinstance(spans, ChunkIndex)
    assert len(spans) == len(expected) >= 200
    for span, chunk in zip(spans, expected, strict=True):
        assert span.offset == chunk.chunk_start_offset
        assert span.times_ns == (chunk.message_start_time, chunk.message_end_time)
        assert span.head.uncompressed_bytes == chunk.uncompressed_size
        assert (span.head.compression, span.data_bytes) == (chunk.compression, chunk.compressed_size)
        assert span.counts.keys() == chunk.message_index_offsets.keys()
    assert sum(span.counts[2] for span in spans) == 200
    assert sum(span.counts.get(1, 0) for span in spans) == 4


def test_chunks_by_a_bags_index_are_those_that_rosbags_reads(tmp_path):
    path = bag(tmp_path / "a", 200)
    found = Ros1Bag(path).survey()
    with Ros1Reader(path) as reader:
        expected, topics = list(reader.chunk_infos), {c.id: c.topic for c in reader.connections}
    assert isinstance(found.spans, ChunkIndex)
    assert len(found.spans) == len(expected) >= 200
    for span, chunk in zip(found.spans, expected, strict=True):
        assert (span.offset, span.data_offset, span.head) == (chunk.pos, chunk.pos, None)
        assert span.times_ns == (chunk.start_time, chunk.end_time - 1)
        counts = Counter()
        for connection, n in chunk.connection_counts.items():
            counts[topics[connection]] += n
        assert {found.catalogue.channels[k].topic: n for k, n in span.counts.items()} == counts
    stops = [span.offset for span in found.spans[1:]]
    assert [span.offset + span.data_bytes for span in found.spans[:-1]] == stops
    assert {found.catalogue.channels[k].topic: n for k, n in found.statistics.items()} == {
        "/pose": 200,
        "/chat": 4,
    }


@pytest.mark.parametrize("field", [b"chunk_pos=", b"start_time=", b"count=", b"op=\x06"])
def test_a_bag_whose_index_is_of_another_form_is_walked(tmp_path, field):
    path = bag(tmp_path / "a", 30)
    content = bytearray(path.read_bytes())
    at = content.rindex(field)
    content[at + (len(field) - 1 if field.startswith(b"op") else 0)] ^= 0x10
    path.write_bytes(content)
    found = Ros1Bag(path).survey()
    assert not isinstance(found.spans, ChunkIndex)
    assert found.truncated
    assert len(found.spans) >= 30


def test_chunks_of_two_files_stand_one_after_another_under_common_ids(tmp_path):
    path = mcap(tmp_path / "a.mcap", 30)
    with path.open("rb") as file:
        spans = indexed_survey(file, path.stat().st_size).spans
    ids = np.arange(1 << 16)
    ids[1], ids[2] = 9, 8
    both = joined([spans, spans.moved(1, ids)])
    assert [(s.file_index, s.offset) for s in both] == [(k, s.offset) for k in (0, 1) for s in spans]
    assert [s.counts for s in both[len(spans) :]] == [
        {int(ids[k]): n for k, n in s.counts.items()} for s in spans
    ]
    turned = both.take(np.arange(len(both))[::-1])
    assert list(turned) == list(both)[::-1]


@pytest.mark.parametrize("at", range(36))
def test_a_damaged_chunk_index_gives_no_chunk_beyond_the_file(tmp_path, at):
    path = mcap(tmp_path / "a.mcap", 3)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    first = summary.chunk_indexes[0]
    content = bytearray()
    for number in (
        first.message_start_time,
        first.message_end_time,
        first.chunk_start_offset,
        first.chunk_length,
    ):
        content += number.to_bytes(8, "little")
    content += (0).to_bytes(4, "little") + first.message_index_length.to_bytes(8, "little")
    content += (0).to_bytes(4, "little") + first.compressed_size.to_bytes(8, "little")
    content += first.uncompressed_size.to_bytes(8, "little")
    size = path.stat().st_size
    bounds = np.array([0]), np.array([len(content)])
    (whole,) = chunk_index(bytes(content), *bounds, size)
    assert whole.offset == first.chunk_start_offset
    content[at] ^= 0xFF
    try:
        (span,) = chunk_index(bytes(content), *bounds, size)
    except Malformed:
        return
    assert 0 <= span.offset <= span.data_offset + span.data_bytes <= size


@pytest.mark.parametrize(
    ("module", "limit"), [(chunk_indexes, "MOST_ENTRIES"), (index_survey, "MOST_RECORDS")]
)
def test_an_index_beyond_what_a_log_needs_is_not_used_and_the_log_is_read(
    tmp_path, monkeypatch, module, limit
):
    path = mcap(tmp_path / "a.mcap", 200)
    monkeypatch.setattr(stretches, "WHOLE_BYTES", 1 << 18)
    monkeypatch.setattr(stretches, "SAMPLED_BYTES", 1 << 17)
    monkeypatch.setattr(module, limit, 100)
    with path.open("rb") as file:
        assert indexed_survey(file, path.stat().st_size) is None
    info = wr.open_log(path).info()
    assert {c["topic"]: c["messages"] for c in info.channels} == {"/chat": 4, "/pose": 200}


def test_a_large_bag_is_sampled_its_counts_are_estimates_and_both_is_said(tmp_path, monkeypatch):
    path = db3(tmp_path / "a.db3", 60_000, indexed=False)
    monkeypatch.setattr(stretches, "WHOLE_BYTES", 12 << 20)
    monkeypatch.setattr(stretches, "SAMPLED_BYTES", 8 << 20)
    log = wr.open_log(path)
    quick, full = log.info(), log.info(full=True)
    exact = {"/pose": 57_000, "/late": 3000, "/never": 0}
    assert {c["topic"]: c["messages"] for c in full.channels} == exact
    told = {c["topic"]: c["messages"] for c in quick.channels}
    assert told["/pose"] == pytest.approx(57_000, rel=0.05)
    assert 1000 < told["/late"] < 6000
    assert told["/never"] == 0
    assert [c["serves_as"] for c in quick.channels] == [["pose"], ["pose"], []]
    assert (quick.complete, quick.counts_estimated) == (False, True)
    assert (full.complete, full.counts_estimated) == (True, False)
    assert quick.duration_s == full.duration_s
    assert "ranges of rows, so clocks, stamps and losses are of these alone, and numbers of" in part_read(
        quick
    )
    assert quick.n_chunks_read < quick.n_chunks == full.n_chunks_read

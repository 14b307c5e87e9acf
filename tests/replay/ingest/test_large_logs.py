"""``info`` of logs with many chunks or rows: its cost hardly grows with them, and it says what it read."""

import sqlite3
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

import wmr_replay as wr
from wmr_replay.cli.printing.info import part_read
from wmr_replay.ingest.mcap import chunk_index as chunk_indexes
from wmr_replay.ingest.mcap import index_survey, stretches
from wmr_replay.ingest.mcap.chunk_index import ChunkIndex, chunk_index, joined
from wmr_replay.ingest.mcap.index_survey import indexed_survey
from wmr_replay.ingest.mcap.records import Malformed
from wmr_schemas import PoseTrack
from wmr_schemas.messages import ros2

T0, STEP_NS = 1_700_000_000_000_000_000, 10_000_000


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
        kind = "geometry_msgs/msg/PoseStamped"
        topics = [(1, "/pose", kind, "cdr"), (2, "/late", kind, "cdr"), (3, "/never", kind, "cdr")]
        bag.executemany("INSERT INTO topics VALUES (?, ?, ?, ?)", topics)
        bag.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
        if indexed:
            bag.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    return path


def info_s(path: Path) -> float:
    """Processor time of ``info``, the better of three."""
    taken = []
    for _ in range(3):
        start = time.process_time()
        assert not wr.open_log(path).info().complete
        taken.append(time.process_time() - start)
    return min(taken)


@pytest.mark.parametrize("make", [mcap, db3])
def test_ten_times_the_chunks_or_rows_cost_less_than_three_times_as_much(tmp_path, monkeypatch, make):
    monkeypatch.setattr(stretches, "WHOLE_BYTES", 12 << 20)
    monkeypatch.setattr(stretches, "SAMPLED_BYTES", 8 << 20)
    n = 1500 if make is mcap else 24_000
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

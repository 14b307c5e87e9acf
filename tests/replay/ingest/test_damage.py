"""Damaged and unusual files: the intact part is read, losses are stated, nothing hangs, crashes or grows."""

import io
import struct
import tracemalloc
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

from wmr_replay.ingest import open_log
from wmr_schemas import PoseTrack
from wmr_schemas.errors import WmrError
from wmr_schemas.messages import ros2

T0 = 1_700_000_000_000_000_000
N = 12
FORMS = {
    "zstd": {"compression": CompressionType.ZSTD, "chunk_size": 500},
    "lz4": {"compression": CompressionType.LZ4, "chunk_size": 500},
    "stored": {"compression": CompressionType.NONE, "chunk_size": 500},
    "unchunked": {"use_chunking": False},
    "bare": {
        "compression": CompressionType.ZSTD,
        "chunk_size": 500,
        "index_types": IndexType.NONE,
        "repeat_channels": False,
        "repeat_schemas": False,
        "use_statistics": False,
        "use_summary_offsets": False,
    },
}
MESSAGES = ros2.CODEC.encode_pose(
    PoseTrack(T0 + np.arange(N), np.arange(N) + 0.5, np.linspace(-1, 1, N), np.linspace(0, 1, N))
)


def log_bytes(messages=MESSAGES, **options) -> bytes:
    """A log with one pose channel."""
    out = io.BytesIO()
    writer = Writer(out, **options)
    writer.start(profile="ros2", library="test")
    schema = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode())
    channel = writer.register_channel("/pose", "cdr", schema)
    for k, message in enumerate(messages):
        writer.add_message(channel, T0 + k, message, T0 + k)
    writer.finish()
    return out.getvalue()


def read(path: Path, content: bytes):
    """The reader with its joined pose rows."""
    path.write_bytes(content)
    reader = open_log(path)
    poses = [batch.pose for batch in reader.batches()]
    t_ns = np.concatenate([p.t_ns for p in poses]) if poses else np.empty(0, np.int64)
    values = np.concatenate([p.values for p in poses], axis=1) if poses else np.empty((3, 0))
    return SimpleNamespace(
        reader=reader, losses=reader.losses, rows=list(zip(t_ns.tolist(), *values.tolist(), strict=True))
    )


def reference_count(content: bytes) -> int:
    """Messages that mcap's own reader gives before it stops."""
    n = 0
    try:
        for record in StreamReader(io.BytesIO(content), validate_crcs=True).records:
            n += isinstance(record, Message)
    except (McapError, EOFError, struct.error, ValueError):
        pass
    return n


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The rows of the intact log, the same in every form."""
    folder = tmp_path_factory.mktemp("whole")
    found = {form: read(folder / "a.mcap", log_bytes(**options)) for form, options in FORMS.items()}
    rows = found["zstd"].rows
    assert len(rows) == N
    for form, log in found.items():
        assert log.rows == rows, form
        assert not log.losses.any(), form
    return rows


@pytest.mark.parametrize("form", FORMS)
def test_truncated_anywhere_the_intact_part_is_read(tmp_path, whole, form):
    options = FORMS[form] | {"repeat_schemas": False}
    content = log_bytes(MESSAGES[:5], **options)
    for stop in range(0, len(content), 1 if form in {"zstd", "unchunked"} else 3):
        cut = content[:stop]
        intact = reference_count(cut)
        log = None
        with suppress(WmrError):
            log = read(tmp_path / "a.mcap", cut)
        if log is None:
            assert not intact, stop
            continue
        assert log.rows == whole[: len(log.rows)], stop
        assert len(log.rows) >= intact, stop
        assert log.losses.truncated, stop
        assert log.losses.notes, stop


def test_of_a_chunk_that_the_files_end_cuts_off_the_front_is_recovered(tmp_path, whole):
    for compression in (CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD):
        rng = np.random.default_rng(0)
        n = 30_000
        noise = rng.normal(size=(3, n))
        messages = ros2.CODEC.encode_pose(PoseTrack(T0 + np.arange(n), *noise))
        content = log_bytes(messages, compression=compression, chunk_size=1 << 24)
        log = read(tmp_path / "a.mcap", content[: len(content) // 2])
        assert len(log.rows) > n // 4
        assert [row[1] for row in log.rows] == noise[0, : len(log.rows)].tolist()
        assert "were recovered" in log.losses.notes[-1]
        assert log.losses.truncated
        assert log.losses.n_chunks_damaged == 0


@settings(max_examples=300, deadline=None)
@given(form=st.sampled_from(sorted(FORMS)), flips=st.lists(st.integers(0, 1 << 20), min_size=1, max_size=4))
def test_bit_flips_give_true_rows_or_a_named_error(tmp_path_factory, whole, form, flips):
    content = bytearray(log_bytes(**FORMS[form]))
    for flip in flips:
        content[flip // 8 % len(content)] ^= 1 << flip % 8
    try:
        log = read(tmp_path_factory.mktemp("flip") / "a.mcap", bytes(content))
    except WmrError:
        return
    if form != "unchunked":  # no checksum covers those messages
        assert all(row in whole for row in log.rows)
    if len(log.rows) < N and form != "bare":  # nothing in that file tells how many there were
        assert log.losses.any()


def chunk_starts(content: bytes) -> list[int]:
    starts, position = [], 8
    while position < len(content) - 8:
        opcode, length = struct.unpack_from("<BQ", content, position)
        if opcode == 6:
            starts.append(position)
        position += 9 + length
    return starts


def test_a_chunk_with_a_bad_checksum_is_left_out_and_the_rest_is_read(tmp_path, whole):
    content = bytearray(log_bytes(**FORMS["stored"]))
    second = chunk_starts(content)[2]
    content[second + 9 + 28 + 4 + 8 + 31 + 20] ^= 1
    log = read(tmp_path / "a.mcap", bytes(content))
    assert len(log.rows) < N
    assert set(log.rows) < set(whole)
    assert log.losses.n_chunks_damaged == 1
    lost = N - len(log.rows)
    assert log.losses.notes == [
        f"the chunk at byte {second} is left out: its checksum does not match ({lost} messages by its index)"
    ]


def test_unknown_compression_is_named(tmp_path):
    content = bytearray(log_bytes(**FORMS["zstd"]))
    for start in chunk_starts(content)[1:]:
        content[start + 9 + 32 : start + 9 + 36] = b"brot"
    log = read(tmp_path / "a.mcap", bytes(content))
    assert log.losses.n_chunks_damaged == len(chunk_starts(content)) - 1
    assert "unknown compression 'brot'" in log.losses.notes[0]


@pytest.mark.parametrize("form", ["zstd", "lz4", "stored"])
@pytest.mark.parametrize("claim", [1 << 40, (1 << 31) - 1, 1 << 63])
def test_a_chunk_that_claims_a_tebibyte_does_not_get_it(tmp_path, form, claim):
    content = bytearray(log_bytes(**FORMS[form]))
    struct.pack_into("<Q", content, chunk_starts(content)[1] + 9 + 16, claim)
    tracemalloc.start()
    try:
        log = read(tmp_path / "a.mcap", bytes(content))
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert log.losses.n_chunks_damaged == 1
    assert 0 < len(log.rows) < N
    assert peak_bytes < 100 << 20


@pytest.mark.parametrize("claim", [1 << 40, 1 << 63, (1 << 64) - 1])
def test_a_chunk_of_absurd_length_costs_nothing_when_one_of_its_two_lengths_is_right(tmp_path, whole, claim):
    content = log_bytes(**FORMS["zstd"])
    start = chunk_starts(content)[1]
    for place in (start + 1, start + 9 + 36):
        damaged = bytearray(content)
        struct.pack_into("<Q", damaged, place, claim)
        log = read(tmp_path / "a.mcap", bytes(damaged))
        assert log.rows == whole
        assert not log.losses.truncated


def test_reading_goes_on_behind_a_chunk_whose_lengths_are_both_wrong(tmp_path, whole):
    content = bytearray(log_bytes(**FORMS["zstd"]))
    start = chunk_starts(content)[1]
    for place in (start + 1, start + 9 + 36):
        struct.pack_into("<Q", content, place, 1 << 40)
    log = read(tmp_path / "a.mcap", bytes(content))
    assert set(log.rows) <= set(whole)
    assert {whole[0], whole[-1]} <= set(log.rows)
    assert log.losses.notes[0].startswith(
        f"byte {start}: a record of type 0x06 claims {1 << 40} bytes; reading goes on"
    )


def test_a_flip_in_the_summary_does_not_change_what_the_data_say(tmp_path, whole):
    content = log_bytes(**FORMS["zstd"])
    place = content.rindex(b"float64 x\n")
    log = read(tmp_path / "a.mcap", content[:place] + b"float32" + content[place + 7 :])
    assert log.rows == whole


def test_a_message_of_an_undescribed_channel_is_noted(tmp_path, whole):
    content = log_bytes(**FORMS["unchunked"])
    stray = struct.pack("<BQHIQQ", 5, 22 + 3, 77, 0, 0, 0) + b"abc"
    end = content.rindex(struct.pack("<BQ", 15, 4))
    log = read(tmp_path / "a.mcap", content[:end] + stray + content[end:])
    assert log.rows == whole
    assert log.losses.notes == ["1 messages of channel 77, which the file does not describe"]


def test_records_of_types_to_come_and_private_ones_are_passed_over(tmp_path, whole):
    content = log_bytes(**FORMS["unchunked"])
    foreign = b"".join(struct.pack("<BQ", opcode, 5) + b"hello" for opcode in (0x10, 0x7F, 0x80, 0xFF))
    first = content.index(struct.pack("<BQ", 5, 22 + len(MESSAGES[0])))
    log = read(tmp_path / "a.mcap", content[:first] + foreign + content[first:])
    assert log.rows == whole
    assert not log.losses.any()


def test_the_bytes_of_a_message_record_never_exceed_its_chunk(tmp_path):
    content = bytearray(log_bytes(**FORMS["stored"], enable_crcs=False))
    start = chunk_starts(content)[1]
    records = start + 9 + 8 + 8 + 8 + 4 + 4 + 8
    struct.pack_into("<Q", content, records + 1, 1 << 20)
    log = read(tmp_path / "a.mcap", bytes(content))
    assert log.losses.n_chunks_damaged == 1
    assert "is damaged 0 bytes in; the 0 messages before that were used" in log.losses.notes[0]


def test_any_bytes_behind_the_magic_give_a_named_error_or_rows(tmp_path):
    rng = np.random.default_rng(1)
    for _ in range(200):
        junk = rng.integers(0, 256, rng.integers(1, 400), dtype=np.uint8).tobytes()
        with pytest.raises(WmrError):
            read(tmp_path / "a.mcap", b"\x89MCAP0\r\n" + junk)

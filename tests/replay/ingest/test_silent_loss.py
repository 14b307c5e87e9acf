"""Messages that a changed bit takes away are missed: by the index, the statistics, the sequence numbers, the
usual step, or a record's type. Where nothing can show it, the report says that the file has no checksums.
"""

import importlib.util
import json
import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from wmr_replay.ingest import open_log
from wmr_replay.ingest.channels.stamp_steps import StampSteps
from wmr_replay.ingest.mcap.checksums import NO_CHECKSUMS
from wmr_replay.ingest.mcap.sequence_numbers import SequenceNumbers

SPEC = importlib.util.spec_from_file_location("bit_flips", Path(__file__).parents[1] / "bit_flips.py")
assert SPEC is not None
assert SPEC.loader is not None
bit_flips = importlib.util.module_from_spec(SPEC)
sys.modules["bit_flips"] = bit_flips
SPEC.loader.exec_module(bit_flips)
Form = bit_flips.Form
UNCHUNKED = Form("unchunked", crc=False, index=False, statistics=False, sequences=False)


def said(path: Path, content: bytes, **options) -> list[str]:
    """What is said of a log besides what is said of every log."""
    found = bit_flips.read(path, content, **options)
    assert found is not None
    return sorted(found.said)


def with_changed(content: bytes, number: int, offset: int, value: int) -> bytes:
    """The log with another byte in the head of its n-th message."""
    damaged = bytearray(content)
    head = sorted(bit_flips.message_heads(content))[number]
    assert damaged[head + offset] != value
    damaged[head + offset] = value
    return bytes(damaged)


def channel_of(content: bytes, number: int) -> int:
    head = sorted(bit_flips.message_heads(content))[number]
    return struct.unpack_from("<BQH", content, head)[2]


def pose_number(content: bytes) -> int:
    """A message of the pose in the middle."""
    return next(n for n in range(150, 190) if channel_of(content, n) == 1)


@pytest.mark.parametrize("form", bit_flips.forms())
def test_an_intact_log_is_not_accused(form, tmp_path):
    assert said(tmp_path / "a.mcap", bit_flips.log_bytes(form)) == []


@pytest.mark.parametrize(
    ("form", "text"),
    [
        (
            Form("unchunked", False, False, True, False),
            "/pose: 199 messages were found; the file claims more or",
        ),
        (
            Form("stored", False, True, False, False),
            "/wheel_torques: 201 messages were found; the file claims",
        ),
        (
            Form("unchunked", False, False, False, True),
            "/pose: its sequence numbers skip 1: as many messages",
        ),
        (
            Form("unchunked", False, False, False, False),
            "/pose: 1 messages are missing by the usual step of 20",
        ),
    ],
)
def test_a_message_under_another_channel_is_missed(form, text, tmp_path):
    content = bit_flips.log_bytes(form)
    moved = with_changed(content, pose_number(content), 9, 2)
    assert any(line.startswith(text) for line in said(tmp_path / "a.mcap", moved)), said(
        tmp_path / "a.mcap", moved
    )


@pytest.mark.parametrize("kind", ["stored", "unchunked"])
@pytest.mark.parametrize(
    ("opcode", "text"),
    [
        (0x07, "1 records of type 0x07 stand where none may, and are left out"),
        (0x25, "1 records of a type that this version does not know, 0x25 are passed over"),
        (0x85, "1 records of the private type 0x85 are passed over"),
    ],
)
def test_a_message_of_another_type_is_said(kind, opcode, text, tmp_path):
    content = bit_flips.log_bytes(Form(kind, False, False, False, False))
    assert text in said(tmp_path / "a.mcap", with_changed(content, pose_number(content), 0, opcode))


def test_a_chunk_that_holds_fewer_messages_than_its_index_counts_is_named(tmp_path):
    content = bit_flips.log_bytes(Form("stored", False, True, False, False))
    found = said(tmp_path / "a.mcap", with_changed(content, pose_number(content), 0, 0x25))
    assert any("its index counts" in line for line in found)


def test_a_channel_whose_definition_is_damaged_is_named_where_another_takes_its_role(tmp_path):
    content = bit_flips.log_bytes(UNCHUNKED)
    place = content.index(b"float64 x")
    found = said(tmp_path / "a.mcap", content[:place] + b"fl\xefat64 x" + content[place + 9 :])
    assert any(line.startswith("/pose is of the type of a channel in use, but ") for line in found), found


def test_a_channel_whose_schema_is_not_in_the_file_is_named(tmp_path):
    content = bytearray(bit_flips.log_bytes(UNCHUNKED))
    content[content.index(b"/pose") - 6] ^= 0x40
    assert "/pose names schema 65, which the file does not hold" in said(tmp_path / "a.mcap", bytes(content))


def test_few_logs_with_flipped_bits_lose_messages_silently():
    outcomes = list(bit_flips.campaign(400, seed=5))
    lost = sum(is_lost for _, is_lost, _, _ in outcomes)
    silent = [form for form, _, nothing_said, _ in outcomes if nothing_said]
    assert lost > 200
    assert not silent, silent


def test_the_checksum_of_the_data_section_is_held_against_the_data(tmp_path):
    path, content = tmp_path / "a.mcap", bit_flips.log_bytes(UNCHUNKED, enable_data_crcs=True)
    assert said(path, content) == []
    assert open_log(path).has_checksums
    damaged = bytearray(content)
    damaged[sorted(bit_flips.message_heads(content))[40] + 40] ^= 1
    text = "the checksum of the data section does not match: something in it was changed"
    assert text in said(path, bytes(damaged))


def test_info_says_once_that_a_file_has_no_checksums(tmp_path, command):
    bare, covered = tmp_path / "bare.mcap", tmp_path / "covered.mcap"
    bare.write_bytes(bit_flips.log_bytes(UNCHUNKED))
    covered.write_bytes(bit_flips.log_bytes(Form("zstd", True, True, True, True)))
    assert command("info", bare).stdout.count("no checksums") == 1
    assert "no checksums" not in command("info", covered).stdout
    assert json.loads(command("info", bare, "--json").stdout)["has_checksums"] is False
    assert json.loads(command("info", covered, "--json").stdout)["has_checksums"] is True


def test_a_run_says_it_only_where_something_was_lost(tmp_path):
    path, content = tmp_path / "a.mcap", bit_flips.log_bytes(UNCHUNKED)
    assert NO_CHECKSUMS not in said(path, content)
    assert NO_CHECKSUMS in said(path, with_changed(content, pose_number(content), 0, 0x07))


@pytest.mark.parametrize(
    ("numbers", "n_skipped"),
    [
        (range(5, 60), 0),
        ([*range(20), *range(23, 60)], 3),
        ([*range(20), 900_000, *range(21, 60)], 0),
        ([*range(20), 7, *range(20, 60)], -1),
        ([0] * 60, 0),
        (range(0, 180, 3), 0),
        ([k + (1 << 32) - 30 if k < 30 else k - 30 for k in range(60)], 0),
        ([1, 2, 9], 0),
    ],
)
@pytest.mark.parametrize("block", [1, 7, 100])
def test_sequence_numbers_count_where_a_writer_fills_them(numbers, n_skipped, block):
    found, column = SequenceNumbers(), np.array(numbers, np.int64)
    for start in range(0, len(column), block):
        found.push(column[start : start + block])
    assert found.n_skipped == n_skipped


def test_a_missing_message_shows_in_even_steps_alone():
    rng = np.random.default_rng(2)
    even = np.delete(np.arange(500) * 20_000_000, [100, 200, 201]) + rng.integers(-1_000_000, 1_000_000, 497)
    uneven = np.cumsum(rng.exponential(2e7, 500)).astype(np.int64)
    for t_ns, n in ((even, 3), (uneven, None)):
        steps = StampSteps()
        for part in np.array_split(t_ns, 7):
            steps.push(part)
        text = f"{n} messages are missing by the usual step" if n else "messages are missing"
        assert (text in steps.describe()) is (n is not None)


def test_records_that_writers_may_put_anywhere_are_not_accused(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start()
        writer.add_attachment(1, 1, "notes.txt", "text/plain", b"hello")
        writer.add_metadata("site", {"a": "b"})
        writer.finish()
    reader = open_log(path, need_pose=False)
    list(reader.batches(everything=True))
    assert not reader.losses.any()
    assert not reader.remarks

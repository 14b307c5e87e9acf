"""The record walk, the survey and the index on every file of MCAP's conformance suite.

The tests write the suite's files themselves, see ``conformance.py``. Where a copy of the suite lies beside
the project, the written files are compared with it byte for byte. The expectations are those of the
generator; ``mcap``, the format's own library, confirms them.
"""

import io
import json

import pytest
from mcap.records import Message
from mcap.stream_reader import StreamReader

from wmr_replay.ingest.mcap.chunks import load
from wmr_replay.ingest.mcap.index_survey import indexed_survey
from wmr_replay.ingest.mcap.survey import survey
from wmr_replay.ingest.mcap.walk import walk
from wmr_replay.ingest.mcap.workspace import Workspace

KINDS = ("NoData", "OneMessage", "OneSchemalessMessage", "TenMessages", "OneAttachment", "OneMetadata")
_MESSAGE_HEAD_BYTES = 22


@pytest.fixture(scope="module")
def suite(conformance):
    """The files by kind."""
    found = {kind: [] for kind in KINDS}
    for variant in conformance.variants():
        found[variant.kind].append(variant)
    return found


@pytest.fixture
def written(tmp_path):
    """``written(variant)``: the variant as a file."""

    def write(variant):
        path = tmp_path / f"{variant.name}.mcap"
        path.write_bytes(variant.content)
        return path

    return write


def messages_of(block):
    """Channel, log time, publish time, sequence and data of a block's messages."""
    found = walk(block.data).messages
    rows = zip(
        *(found.channel.tolist(), found.log_ns.tolist(), found.publish_ns.tolist()),
        *(found.offset.tolist(), found.length.tolist()),
        strict=True,
    )
    for *numbers, offset, length in rows:
        head = block.data[offset - _MESSAGE_HEAD_BYTES : offset].tobytes()
        yield (*numbers, int.from_bytes(head[2:6], "little"), block.data[offset : offset + length].tobytes())


def read_messages(path):
    with path.open("rb") as file:
        blocks = [load(file, span, Workspace()) for span in survey(path).spans]
        assert not [block.problem for block in blocks if block.problem]
        return [message for block in blocks for message in messages_of(block)]


@pytest.mark.parametrize("kind", KINDS)
def test_messages_equal_the_list_of_the_suite(suite, written, kind):
    assert suite[kind]
    differing = [v.name for v in suite[kind] if read_messages(written(v)) != v.messages]
    assert not differing


@pytest.mark.parametrize("kind", KINDS)
def test_the_formats_own_library_reads_the_same_messages(suite, kind):
    for variant in suite[kind]:
        records = StreamReader(io.BytesIO(variant.content), validate_crcs=True).records
        found = [
            (m.channel_id, m.log_time, m.publish_time, m.sequence, m.data)
            for m in records
            if isinstance(m, Message)
        ]
        assert found == variant.messages, variant.name


@pytest.mark.parametrize("kind", KINDS)
def test_a_survey_finds_every_description_and_nothing_damaged(suite, written, kind):
    for variant in suite[kind]:
        found = survey(written(variant))
        assert (found.truncated, found.notes, found.n_chunks_damaged) == (False, [], 0), variant.name
        assert found.metadata == ({"myMetadata": {"foo": "bar"}} if kind == "OneMetadata" else {})
        expected = {1: len(variant.messages)} if variant.messages else {}
        assert found.statistics == (expected if "st" in variant else None), variant.name
        counts = {}
        for span in found.spans:
            counts |= span.counts
        counted = "mx" in variant or "ch" not in variant
        assert counts == (expected if counted else {}), variant.name


@pytest.mark.parametrize("kind", KINDS)
def test_channels_are_known_after_the_summary_and_the_chunks(suite, written, kind):
    for variant in suite[kind]:
        path = written(variant)
        catalogue = survey(path).catalogue
        in_chunk = "ch" in variant and bool(variant.messages)
        has_channel = bool(variant.messages) and (not in_chunk or "rch" in variant)
        has_schema = variant.has_schema and (not in_chunk or "rsh" in variant)
        topics = {1: "example"} if has_channel else {}
        assert {k: c.topic for k, c in catalogue.channels.items()} == topics, variant.name
        names = {1: ("Example", "c", b"\x04\x05\x06")} if has_schema else {}
        assert {k: (s.name, s.encoding, s.data) for k, s in catalogue.schemas.items()} == names, variant.name


@pytest.mark.parametrize("kind", KINDS)
def test_the_index_alone_gives_the_same_messages_where_it_is_complete(suite, written, kind):
    believed = set()
    for variant in suite[kind]:
        with written(variant).open("rb") as file:
            found = indexed_survey(file, len(variant.content))
            if found is None:
                continue
            blocks = [load(file, span, Workspace()) for span in found.spans]
        believed.add(variant.name)
        assert [m for block in blocks for m in messages_of(block)] == variant.messages, variant.name
    needed = {"chx", "mx", "st"} if kind in {"OneMessage", "TenMessages", "OneSchemalessMessage"} else {"st"}
    assert believed == {variant.name for variant in suite[kind] if needed <= variant.features}


def test_the_suite_is_complete(suite):
    n = {kind: len(found) for kind, found in suite.items()}
    assert n == dict(zip(KINDS, (6, 154, 74, 154, 7, 14), strict=True))
    assert sum(len(v.messages) for found in suite.values() for v in found) == 154 + 74 + 10 * 154


def test_the_files_are_the_published_ones_byte_for_byte(suite, shared_data):
    published = shared_data("mcap_conformance")
    names = {path.stem for path in published.glob("*.mcap")}
    assert names == {v.name for found in suite.values() for v in found}
    for variant in (v for found in suite.values() for v in found):
        assert (published / f"{variant.name}.mcap").read_bytes() == variant.content, variant.name


def test_the_published_lists_of_messages_are_those_of_the_generator(suite, shared_data):
    published = shared_data("mcap_conformance")
    for variant in (v for found in suite.values() for v in found):
        records = json.loads((published / f"{variant.name}.json").read_text())["records"]
        listed = [dict(record["fields"]) for record in records if record["type"] == "Message"]
        keys = ("channel_id", "log_time", "publish_time", "sequence")
        found = [(*(int(m[key]) for key in keys), bytes(map(int, m["data"]))) for m in listed]
        assert found == variant.messages, variant.name

"""The record walk against the MCAP project's own conformance suite."""

import json
from pathlib import Path

import pytest

from wmr_replay.ingest.mcap.chunks import load
from wmr_replay.ingest.mcap.survey import survey
from wmr_replay.ingest.mcap.walk import walk
from wmr_replay.ingest.mcap.workspace import Workspace

SUITE = Path(__file__).parents[2].parent / "shared" / "data" / "mcap_conformance"
FILES = sorted(SUITE.glob("*.mcap"))

pytestmark = pytest.mark.skipif(not FILES, reason="the conformance suite is not beside the project")


def expected_messages(path: Path) -> list[tuple[int, int, int, int, bytes]]:
    found = []
    for record in json.loads(path.read_text())["records"]:
        if record["type"] == "Message":
            fields = dict(record["fields"])
            numbers = [int(fields[key]) for key in ("channel_id", "log_time", "publish_time", "sequence")]
            found.append((*numbers, bytes(int(byte) for byte in fields["data"])))
    return found


def read_messages(path: Path) -> list[tuple[int, int, int, int, bytes]]:
    found = []
    with path.open("rb") as file:
        for span in survey(path).spans:
            block = load(file, span, Workspace())
            assert not block.problem
            messages = walk(block.data).messages
            rows = zip(
                *(messages.channel.tolist(), messages.log_ns.tolist(), messages.publish_ns.tolist()),
                *(messages.offset.tolist(), messages.length.tolist()),
                strict=True,
            )
            for *numbers, offset, length in rows:
                found.append((*numbers, block.data[offset : offset + length].tobytes()))
    return found


@pytest.mark.parametrize("kind", sorted({path.name.split("-")[0].split(".")[0] for path in FILES}))
def test_messages_equal_the_suites_own_list(kind):
    files = [path for path in FILES if path.name.split("-")[0].split(".")[0] == kind]
    differing = [
        path.name for path in files if read_messages(path) != expected_messages(path.with_suffix(".json"))
    ]
    assert not differing


def test_the_suite_is_complete():
    assert len(FILES) == 409
    assert sum(len(expected_messages(path.with_suffix(".json"))) for path in FILES) > 1000


def test_no_file_of_the_suite_is_called_damaged():
    for path in FILES:
        found = survey(path)
        assert not found.truncated, path.name
        assert not found.notes, path.name

"""The hash of a log, found in a thread."""

import hashlib

import pytest

from wmr_replay.jobs.hashing import LogHash


def test_the_hash_is_that_of_the_file(tmp_path):
    path = tmp_path / "log.mcap"
    path.write_bytes(b"poses" * 1000)
    assert LogHash(path).result() == hashlib.sha256(b"poses" * 1000).hexdigest()


def test_an_error_is_raised_to_whoever_asks(tmp_path):
    with pytest.raises(FileNotFoundError):
        LogHash(tmp_path / "none.mcap").result()

"""Logs and results behind URLs, on local servers."""

import json
import sys

import polars as pl
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from wmr_replay.cli.run import command
from wmr_replay.fleet.batch import run_batch
from wmr_replay.fleet.job import Orders
from wmr_replay.ingest import Between, log_path, open_log, sha256_of
from wmr_replay.ingest.storage import source
from wmr_replay.jobs.run import run_log
from wmr_schemas.errors import LogUnusable, MissingExtra
from wmr_synth import Sensors, record, synthesise

pytestmark = pytest.mark.timeout(300)
pytest.importorskip("fsspec", reason="the extra `remote` is not installed")
SENSORS = Sensors(rate_hz=100.0, torque_rate_hz=100.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)


def rewrite(path, target, **options):
    """The same messages and metadata in small chunks, by the reference implementation."""
    with path.open("rb") as file, target.open("wb") as out:
        reader, writer = make_reader(file), Writer(out, chunk_size=20_000, **options)
        writer.start(reader.get_header().profile, "rewritten")
        schemas, channels = {}, {}
        for schema, channel, message in reader.iter_messages():
            if channel.id not in channels:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id]
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        for entry in reader.iter_metadata():
            writer.add_metadata(entry.name, entry.metadata)
        writer.finish()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served")
    record(synthesise("random", seed=3, duration_s=60, sensors=SENSORS), folder / "once.mcap", truth=False)
    rewrite(folder / "once.mcap", folder / "drive.mcap")
    whole = (folder / "drive.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    return folder


@pytest.fixture
def served(servers, folder):
    with servers.FileServer(folder) as server:
        yield server


def assert_same_tables(result, other):
    for name in ("samples", "segments"):
        assert result.files[name].read_bytes() == other.files[name].read_bytes(), name
    own = {"log", "log_sha256", "notes"}
    assert {k: v for k, v in result.summary.items() if k not in own} == {
        k: v for k, v in other.summary.items() if k not in own
    }


def test_a_url_gives_what_the_file_gives_and_is_fetched_about_once(served, folder, tmp_path):
    near = run_log(folder / "drive.mcap", tmp_path / "near", timeline=False)
    far = run_log(log_path(f"{served.url}/drive.mcap"), tmp_path / "far", timeline=False)
    assert_same_tables(far, near)
    assert far.summary["notes"] == near.summary["notes"]
    assert far.summary["log_sha256"] is None
    assert sum(served.sent) < 1.25 * (folder / "drive.mcap").stat().st_size


def test_only_the_ranges_that_a_part_needs_are_fetched(served, folder, tmp_path):
    between, size = Between("10", "20"), (folder / "drive.mcap").stat().st_size
    far = run_log(log_path(f"{served.url}/drive.mcap"), tmp_path / "far", between=between, timeline=False)
    fetched = sum(served.sent)
    near = run_log(folder / "drive.mcap", tmp_path / "near", between=between, timeline=False)
    assert_same_tables(far, near)
    assert far.summary["duration_s"] == pytest.approx(10, abs=0.1)
    with (folder / "drive.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    start_ns = summary.statistics.message_start_time
    needed = [
        chunk.chunk_length
        for chunk in summary.chunk_indexes
        if chunk.message_start_time <= start_ns + 20e9 and chunk.message_end_time >= start_ns + 10e9
    ]
    index_bytes = size - summary.chunk_indexes[-1].chunk_start_offset - summary.chunk_indexes[-1].chunk_length
    first = summary.chunk_indexes[0].chunk_length
    assert 2 < len(needed) < 0.3 * len(summary.chunk_indexes)
    assert sum(needed) < fetched < sum(needed) + 3 * index_bytes + 3 * first
    assert fetched < 0.5 * size


def test_a_server_without_ranges_is_read_as_a_whole_and_it_is_said(servers, folder, tmp_path):
    near = run_log(folder / "drive.mcap", tmp_path / "near", timeline=False)
    with servers.FileServer(folder, ranges=False) as server:
        far = run_log(log_path(f"{server.url}/drive.mcap"), tmp_path / "far", timeline=False)
        assert sum(server.sent) == (folder / "drive.mcap").stat().st_size
    assert_same_tables(far, near)
    assert "gives no ranges" in far.summary["notes"]


@pytest.mark.parametrize("ranges", [True, False])
def test_what_is_no_log_is_said_of_the_url(servers, tmp_path, ranges):
    (tmp_path / "page.mcap").write_bytes(b"<!doctype html>" * 100_000)
    with servers.FileServer(tmp_path, ranges=ranges) as server:
        with pytest.raises(LogUnusable, match=f"{server.url}/page.mcap: this is not an MCAP file"):
            open_log(log_path(f"{server.url}/page.mcap"))
        assert sum(server.sent) < 200 or not ranges


def test_a_file_without_index_is_read_as_a_whole(served, folder, tmp_path):
    near = run_log(folder / "cut.mcap", tmp_path / "near", timeline=False)
    far = run_log(log_path(f"{served.url}/cut.mcap"), tmp_path / "far", timeline=False)
    assert_same_tables(far, near)
    assert far.summary["truncated"]
    assert "no index" in far.summary["notes"]


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4])
def test_a_chunk_damaged_behind_a_url_is_found_by_its_own_checksum(servers, folder, tmp_path, compression):
    path = tmp_path / "damaged.mcap"
    rewrite(folder / "once.mcap", path, compression=compression, enable_crcs=True)
    with path.open("rb") as file:
        chunk = make_reader(file).get_summary().chunk_indexes[5]
    data = bytearray(path.read_bytes())
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 0x40
    path.write_bytes(data)
    near = run_log(path, tmp_path / "near", timeline=False)
    with servers.FileServer(tmp_path) as server:
        far = run_log(log_path(f"{server.url}/damaged.mcap"), tmp_path / "far", timeline=False)
    assert far.summary["n_chunks_damaged"] == near.summary["n_chunks_damaged"] == 1
    assert_same_tables(far, near)


def test_a_summary_that_was_tampered_with_changes_no_row(servers, folder, tmp_path):
    """Whatever bit of the index flips: it is not believed, or it was of no consequence."""
    whole = (folder / "drive.mcap").read_bytes()
    with (folder / "drive.mcap").open("rb") as file:
        last = make_reader(file).get_summary().chunk_indexes[-1]
    begin = last.chunk_start_offset + last.chunk_length
    near = run_log(folder / "drive.mcap", tmp_path / "near", timeline=False)
    with servers.FileServer(tmp_path) as server:
        for k, place in enumerate(range(begin + 200, len(whole) - 60, (len(whole) - begin) // 6)):
            data = bytearray(whole)
            data[place] ^= 1 << (k % 8)
            (tmp_path / f"{k}.mcap").write_bytes(data)
            far = run_log(log_path(f"{server.url}/{k}.mcap"), tmp_path / "far", timeline=False)
            assert far.files["samples"].read_bytes() == near.files["samples"].read_bytes()
    assert k >= 4


def test_errors_name_the_place_without_its_secrets(served):
    url = served.url.replace("//", "//user:secret@") + "/gone.mcap?token=secret"
    with pytest.raises(LogUnusable) as error:
        open_log(log_path(url))
    assert f"{served.url}/gone.mcap: there is no such file" in str(error.value)
    assert "secret" not in str(error.value)


def test_run_refuses_a_url_for_its_results():
    done = CliRunner().invoke(command, ["drive.mcap", "--out", "s3://bucket/results"])
    assert done.exit_code == 2
    assert "s3://bucket/results is a URL" in done.output


def test_without_the_extra_the_message_names_it(monkeypatch):
    source._located.cache_clear()
    monkeypatch.setitem(sys.modules, "fsspec.core", None)
    with pytest.raises(MissingExtra, match=r"pip install 'wmr-replay\[remote\]'"):
        open_log(log_path("https://example.invalid/log.mcap"))


def test_the_identity_of_a_url_follows_its_content(servers, folder, tmp_path):
    path = tmp_path / "log.mcap"
    with servers.FileServer(tmp_path) as server:
        hashes = []
        for content in ("drive", "once", "drive"):
            path.write_bytes((folder / f"{content}.mcap").read_bytes())
            hashes.append(sha256_of(log_path(f"{server.url}/log.mcap")))
        assert sum(server.sent) < path.stat().st_size
    assert hashes[0] == hashes[2] != hashes[1]


@pytest.fixture
def bucket(servers, monkeypatch):
    """A bucket on a server of this machine, and what clients need to find it."""
    with servers.S3Server("fleet") as server:
        settings = {
            "AWS_ENDPOINT_URL": server.url,
            "AWS_ACCESS_KEY_ID": "key",
            "AWS_SECRET_ACCESS_KEY": "secret",
            "AWS_REGION": "us-east-1",
            "AWS_EC2_METADATA_DISABLED": "true",
        }
        for name, value in settings.items():
            monkeypatch.setenv(name, value)
        for cache in (source._s3, source._located):
            cache.cache_clear()
        yield server
        for cache in (source._s3, source._located):
            cache.cache_clear()


def test_a_batch_from_bucket_to_bucket_gives_what_a_local_one_gives(bucket, short_logs, tmp_path):
    objects = bucket.buckets["fleet"]
    for path in short_logs.rglob("*"):
        if path.suffix in {".mcap", ".json"}:
            objects[f"logs/{path.relative_to(short_logs)}"] = path.read_bytes()
    objects["logs/bad.mcap"] = b"no log at all"
    out, places = log_path("s3://fleet/results"), [log_path("s3://fleet/logs")]
    far = run_batch(places, out, Orders(), n_jobs=2)
    assert len(far.outcomes) == 4
    assert [o.log for o in far.failed] == ["s3://fleet/logs/bad.mcap"], far.failed
    (failed,) = far.failed
    assert failed.problem.startswith("s3://fleet/logs/bad.mcap: this is not an MCAP file")
    done = {outcome.log: outcome for outcome in far.outcomes if not outcome.problem}
    for path in short_logs.rglob("*.mcap"):
        near = run_log(path, tmp_path, timeline=False)
        key = done.pop(f"s3://fleet/logs/{path.relative_to(short_logs)}").key
        for table in ("samples", "segments", "confusion", "hindsight", "hindsight_segments"):
            assert objects[f"results/{table}/log={key}/part.parquet"] == near.files[table].read_bytes()
        mine = [name for name in bucket.puts if key in name]
        assert mine[-1] == f"results/records/{key}.json"
        assert len(mine) == 7
        (row,) = far.fleet.filter(pl.col("log") == key).to_dicts()
        own = {"log", "path", "log_sha256", "state", "problem"}
        assert row | dict.fromkeys(own) == near.summary | dict.fromkeys(own)
    assert not done
    bucket.puts.clear()
    again = run_batch(places, out, Orders(), n_jobs=1)
    assert sum(outcome.skipped for outcome in again.outcomes) == 3
    assert bucket.puts == ["results/fleet.parquet", "results/fleet.json"]


def test_a_bag_in_a_bucket_is_one_log(bucket, folder, tmp_path):
    data = (folder / "drive.mcap").read_bytes()
    bucket.buckets["fleet"] |= {
        "bag/metadata.yaml": b"rosbag2_bagfile_information:\n  relative_file_paths:\n    - one.mcap\n",
        "bag/one.mcap": data,
    }
    near = run_log(folder / "drive.mcap", tmp_path / "near", timeline=False)
    far = run_log(log_path("s3://fleet/bag"), tmp_path / "far", timeline=False)
    assert_same_tables(far, near)


def test_a_record_of_objects_that_are_gone_does_not_count(bucket, short_logs):
    out = log_path("s3://fleet/results")
    run_batch([short_logs / "a.mcap"], out, Orders(), n_jobs=1)
    objects = bucket.buckets["fleet"]
    (record,) = (json.loads(data) for key, data in objects.items() if "/records/" in key)
    lost = f"results/{next(name for name in record['files'] if name.startswith('segments'))}"
    content = objects.pop(lost)
    (outcome,) = run_batch([short_logs / "a.mcap"], out, Orders(), n_jobs=1).outcomes
    assert not outcome.skipped
    assert objects[lost] == content

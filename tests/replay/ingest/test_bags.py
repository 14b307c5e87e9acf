"""ROS bags, ROS 2's ``.db3`` and ROS 1's ``.bag``: the columns of the same messages in MCAP, and damage."""

import json
import shutil
import sqlite3
import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode

import wmr_replay as wr
from wmr_replay.ingest import Between, open_log, sha256_of
from wmr_schemas import PAPER_ROBOT
from wmr_schemas.errors import LogUnusable
from wmr_schemas.mapping_file import LogMapping
from wmr_synth import Sensors, record, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
KINDS = ("db3", "db3 folder", "db3 by file", "db3 by message", "bag", "bag lz4", "bag bz2")


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "drive.mcap"
    record(synthesise("random", seed=5, duration_s=20, sensors=SENSORS), path)
    return path


@pytest.fixture(scope="module")
def places(log, bags) -> dict[str, Path]:
    """The log in every form of a bag."""
    home, zstd = log.parent, CompressionFormat.ZSTD
    folder = bags.as_ros2(log, home / "ros2")
    by_file = bags.as_ros2(log, home / "by_file", compression=(CompressionMode.FILE, zstd))
    by_message = bags.as_ros2(log, home / "by_message", compression=(CompressionMode.MESSAGE, zstd))
    formats = Ros1Writer.CompressionFormat
    return {
        "db3": folder / "ros2.db3",
        "db3 folder": folder,
        "db3 by file": by_file,
        "db3 by message": by_message,
        "bag": bags.as_ros1(log, home / "ros1.bag"),
        "bag lz4": bags.as_ros1(log, home / "lz4.bag", compression=formats.LZ4),
        "bag bz2": bags.as_ros1(log, home / "bz2.bag", compression=formats.BZ2),
    }


def columns(path: Path, **options) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Stamps and values of each signal, in file order."""
    batches = list(open_log(path, **options).batches())
    return {
        name: (
            np.concatenate([getattr(batch, name).t_ns for batch in batches]),
            np.concatenate([getattr(batch, name).values for batch in batches], axis=1),
        )
        for name in ("pose", "torque", "mode")
    }


def assert_same(found, expected):
    for name, (t_ns, values) in expected.items():
        assert found[name][0].tolist() == t_ns.tolist(), name
        np.testing.assert_array_equal(found[name][1], values, err_msg=name)


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_gives_the_columns_of_the_same_messages_in_mcap(log, places, kind):
    assert_same(columns(places[kind]), columns(log))


@pytest.mark.parametrize("kind", ["db3", "bag"])
@pytest.mark.parametrize(
    "options",
    [{"between": Between("3.2", "11.7")}, {"mapping": LogMapping(clock="log")}],
    ids=["part", "log clock"],
)
def test_limits_and_clocks_are_those_of_mcap(log, places, kind, options):
    found, expected = columns(places[kind], **options), columns(log, **options)
    assert len(expected["pose"][0]) > 300
    assert_same(found, expected)


@pytest.mark.parametrize("kind", KINDS)
def test_info_counts_every_channel_and_loses_nothing(log, places, kind):
    def facts(path):
        return {
            row["topic"]: (row["messages"], row["first_ns"], row["last_ns"], row["serves_as"], row["role"])
            for row in wr.open_log(path).info().channels
        }

    assert facts(places[kind]) == facts(log)
    info = wr.open_log(places[kind]).info()
    assert info.losses["notes"] == []
    assert info.profile == ("ros1" if kind.startswith("bag") else "ros2")


@pytest.mark.parametrize("kind", ["db3 folder", "bag"])
def test_run_gives_the_tables_of_the_same_log_in_mcap(log, places, kind, tmp_path):
    (tmp_path / "robot.toml").write_text(
        "[robot]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in PAPER_ROBOT.known().items())
    )
    options = {"mapping": tmp_path / "robot.toml"}
    found, expected = wr.run(places[kind], **options), wr.run(log, **options)
    assert found.samples.collect().equals(expected.samples.collect())
    hashes = [result.summary["log_sha256"].item() for result in (found, expected)]
    assert hashes == [sha256_of(places[kind]), sha256_of(log)]


@pytest.mark.parametrize("kind", ["db3", "bag"])
def test_progress_ends_with_the_size_of_the_bag(places, kind):
    told = []
    wr.open_log(places[kind]).signals(lambda done, size: told.append((done, size)))
    assert all(0 < done <= size for done, size in told)
    assert told[-1][1] == places[kind].stat().st_size
    assert [done for done, _ in told] == sorted(done for done, _ in told)


def test_a_bag_without_definitions_uses_the_standard_ones(log, places, tmp_path):
    path = tmp_path / "humble.db3"
    shutil.copy(places["db3"], path)
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TABLE message_definitions")
        connection.execute("INSERT INTO topics SELECT 9, '/own', 'mine/msg/Own', 'cdr', '', '' ")
        connection.execute("INSERT INTO messages SELECT NULL, 9, timestamp, x'00' FROM messages LIMIT 1")
    assert_same(columns(path), columns(log))
    own = next(row for row in wr.open_log(path).info().channels if row["topic"] == "/own")
    assert own["messages"] == 1


def test_a_cut_db3_gives_the_rows_before_the_cut_and_says_so(log, places, tmp_path):
    whole, expected = places["db3"].read_bytes(), columns(log)["pose"][0]
    path = tmp_path / "cut.db3"
    n_read = 0
    for share in (0.3, 0.6, 0.9):
        path.write_bytes(whole[: int(len(whole) * share)])
        try:
            reader = open_log(path)
        except LogUnusable:
            continue
        t_ns = np.concatenate([batch.pose.t_ns for batch in reader.batches()])
        assert set(t_ns.tolist()) <= set(expected.tolist())
        assert reader.losses.any()
        n_read += len(t_ns)
    assert n_read > 0


def test_a_damaged_page_of_a_db3_costs_its_rows_alone(log, places, tmp_path):
    data = bytearray(places["db3"].read_bytes())
    page = 4096 * (len(data) // 4096 // 2)
    data[page : page + 4096] = b"\xff" * 4096
    path = tmp_path / "damaged.db3"
    path.write_bytes(data)
    reader = open_log(path)
    t_ns = np.concatenate([batch.pose.t_ns for batch in reader.batches()])
    expected = columns(log)["pose"][0]
    assert 0.2 * len(expected) < len(t_ns) < len(expected)
    assert any("malformed" in note for note in reader.losses.notes), reader.losses.notes


@pytest.mark.parametrize("kind", ["bag", "bag lz4", "bag bz2"])
def test_a_bag_that_was_not_closed_gives_what_its_chunks_hold(log, places, kind, tmp_path):
    data, expected = bytearray(places[kind].read_bytes()), columns(log)["pose"][0]
    at = data.index(b"index_pos=") + len(b"index_pos=")
    index_start = struct.unpack_from("<Q", data, at)[0]
    data[at : at + 8] = bytes(8)
    path = tmp_path / "open.bag"
    for stop, n_least in ((index_start, len(expected)), (int(0.7 * index_start), len(expected) // 2)):
        path.write_bytes(data[:stop])
        reader = open_log(path)
        t_ns = np.concatenate([batch.pose.t_ns for batch in reader.batches()])
        assert len(t_ns) >= n_least
        assert t_ns.tolist() == expected[: len(t_ns)].tolist()
        assert "it has no index" in " ".join(reader.losses.notes)
        assert reader.losses.truncated


def test_a_damaged_chunk_of_a_bag_is_left_out_and_said(log, places, tmp_path):
    data = bytearray(places["bag lz4"].read_bytes())
    starts = [k for k in range(len(data)) if data[k : k + 15] == b"compression=lz4"]
    assert len(starts) > 3
    data[starts[2] + 100 : starts[2] + 140] = b"\xff" * 40
    path = tmp_path / "damaged.bag"
    path.write_bytes(data)
    reader = open_log(path)
    t_ns = np.concatenate([batch.pose.t_ns for batch in reader.batches()])
    assert 0.5 < len(t_ns) / len(columns(log)["pose"][0]) < 1
    assert reader.losses.n_chunks_damaged == 1


@pytest.mark.parametrize("seed", range(40))
def test_no_damage_ends_in_another_error(places, seed, tmp_path):
    draw = np.random.default_rng(seed)
    data = np.frombuffer(places["db3" if seed % 2 else "bag"].read_bytes(), np.uint8).copy()
    for _ in range(draw.integers(1, 20)):
        place = int(draw.integers(0, min(len(data), 1 << draw.integers(6, 24)) - 8))
        data[place : place + int(draw.integers(1, 9))] = draw.integers(0, 256)
    path = tmp_path / "damaged.db3"
    path.write_bytes(data[: int(len(data) * draw.uniform(0.5, 1.2))].tobytes())
    try:
        for _ in open_log(path, need_pose=False).batches(everything=True):
            pass
    except LogUnusable:
        pass


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"#ROSBAG V1.2\n", "a ROS 1 bag of another version"),
        (b"#ROSBAG V2.0\n", "its header is damaged"),
        (b"SQLite format 3\0" + bytes(90), "its database cannot be read"),
    ],
)
def test_what_cannot_be_a_bag_is_refused(tmp_path, content, problem):
    path = tmp_path / "a.bag"
    path.write_bytes(content)
    with pytest.raises(LogUnusable, match=problem):
        open_log(path)


def test_an_encrypted_bag_and_another_database_are_refused(places, tmp_path):
    data = places["bag"].read_bytes()
    encrypted = tmp_path / "a.bag"
    field = struct.pack("<I", 19) + b"encryptor=rosbag/Aes"[:19]
    size = struct.unpack_from("<I", data, 13)[0]
    encrypted.write_bytes(data[:13] + struct.pack("<I", size + 23) + field + data[17:])
    with pytest.raises(LogUnusable, match="it is encrypted"):
        open_log(encrypted)
    other = tmp_path / "other.db3"
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE songs(id INTEGER)")
    with pytest.raises(LogUnusable, match="no ROS 2 bag: it lacks topics or messages"):
        open_log(other)


@pytest.mark.parametrize("kind", ["db3 folder", "db3 by message", "bag lz4"])
def test_a_bag_is_converted_to_mcap_with_the_same_messages(log, places, kind, command, tmp_path):
    out = tmp_path / "copy.mcap"
    done = command("convert", places[kind], "--out", out)
    n_messages = wr.open_log(log).info().n_messages
    assert f"wrote {out}: {n_messages} messages" in done.stdout
    assert done.stderr.count("lost") == 0
    assert_same(columns(out), columns(log))
    if kind == "db3 folder":
        with log.open("rb") as ours, out.open("rb") as theirs:
            pairs = zip(make_reader(ours).iter_messages(), make_reader(theirs).iter_messages(), strict=True)
            assert all(a[2].data == b[2].data and a[2].log_time == b[2].log_time for a, b in pairs)


def test_a_bag_is_never_converted_onto_itself_and_a_csv_needs_a_map(places, command, tmp_path):
    assert "is the log itself" in command("convert", places["bag"], "--out", places["bag"], code=2).stderr
    (tmp_path / "a.csv").write_text("t,x\n")
    assert (
        "needs --map" in command("convert", tmp_path / "a.csv", "--out", tmp_path / "b.mcap", code=2).stderr
    )


def test_batch_and_gap_take_bags(places, command, tmp_path):
    folder = tmp_path / "logs"
    folder.mkdir()
    shutil.copy(places["bag"], folder / "one.bag")
    shutil.copytree(places["db3 folder"], folder / "two")
    fleet = wr.batch(folder, tmp_path / "fleet", jobs=1)
    assert len(fleet.outcomes) == 2
    assert not fleet.failed
    shown = command("info", folder / "one.bag", "--json").stdout
    assert json.loads(shown)["used"]["torque"]["topic"] == "/wheel_torques"

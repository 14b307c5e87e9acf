"""A whole log in memory: order, duplicates, modes, and logs that cannot be used."""

import numpy as np
import pytest

from wmr_replay.ingest import Between
from wmr_replay.ingest import tracks as whole
from wmr_replay.ingest.tracks import read_whole
from wmr_schemas.errors import ChannelNotFound, LogUnusable
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack
from wmr_synth import write_mcap

MODE_TOPIC = "/ground_truth/mode"
STEP_NS = 10_000_000


def pose_of(t_ns):
    t = t_ns / 1e9
    return PoseTrack(t_ns, np.cos(t), np.sin(t), t)


def torque_of(t_ns, effort=1.0):
    n = len(t_ns)
    return TorqueTrack(t_ns, np.full(n, effort), np.full(n, effort), np.zeros(n), np.zeros(n))


def log_of(n=300, *, torque=True, mode=True):
    t_ns = STEP_NS * np.arange(1, n + 1)
    switches = ModeTrack(np.array([STEP_NS, 2 * STEP_NS]), np.array([0, 1], np.int8))
    return Log(pose_of(t_ns), torque_of(t_ns) if torque else None, switches if mode else None)


def read(path, **options):
    return read_whole(path, LogMapping(), Between(), **options)


def written(tmp_path, log):
    path = tmp_path / "drive.mcap"
    write_mcap(log, path)
    return path


def test_what_was_written_is_read(tmp_path):
    log = log_of()
    found = read(written(tmp_path, log), mode_topic=MODE_TOPIC)
    for track in ("pose", "torque", "mode"):
        for name, column in vars(getattr(log, track)).items():
            np.testing.assert_allclose(
                getattr(getattr(found.log, track), name), column, atol=1e-12, err_msg=f"{track}.{name}"
            )
    assert found.notes == ()


def test_no_mode_is_read_unless_its_topic_is_named(tmp_path, monkeypatch):
    path = written(tmp_path, log_of())
    decoded = []
    begin = whole.LogReader.batches

    def watched(reader):
        decoded.extend(reader.plan.uses)
        return begin(reader)

    monkeypatch.setattr(whole.LogReader, "batches", watched)
    assert read(path).log.mode is None
    assert decoded == ["pose", "torque"]
    assert read(path, mode_topic=MODE_TOPIC).log.mode is not None


def test_rows_are_sorted_and_repeated_stamps_counted():
    t_ns = np.array([30, 10, 20, 10, 20, 40])
    rows = whole.Rows(t_ns, np.arange(6), np.arange(6.0)[None])
    kept, note = whole.once_each(rows, np.array([True, True, True, True, True, False]), "pose")
    assert kept.t_ns.tolist() == [10, 20, 30]
    assert kept.values[0].tolist() == [1.0, 2.0, 0.0]
    assert note == "1 pose rows hold no usable value and 2 pose rows repeat a stamp; they are left out"


def test_a_log_without_torques_says_what_to_try(tmp_path):
    path = written(tmp_path, log_of(torque=False))
    with pytest.raises(ChannelNotFound, match="no wheel torques") as error:
        read(path)
    assert "--torque TOPIC" in str(error.value)


def test_torques_that_say_nothing_do_not_serve(tmp_path):
    log = log_of()
    path = written(tmp_path, Log(log.pose, torque_of(log.pose.t_ns, np.nan)))
    with pytest.raises(LogUnusable, match="no row has an effort for both wheels"):
        read(path)


def test_a_mode_topic_that_is_not_there_is_said_with_the_option_that_names_it(tmp_path):
    path = written(tmp_path, log_of(mode=False))
    with pytest.raises(ChannelNotFound, match="--modes topic:TOPIC"):
        read(path, mode_topic=MODE_TOPIC)


def test_more_rows_than_memory_is_meant_for_are_refused(tmp_path, monkeypatch):
    path = written(tmp_path, log_of())
    monkeypatch.setattr(whole, "MOST_ROWS", 500)
    with pytest.raises(LogUnusable, match=r"more than the 500 rows(.|\n)*--start and --end"):
        read(path)


def test_progress_grows_up_to_the_whole(tmp_path):
    shares = []
    read(written(tmp_path, log_of()), progress=lambda doing, share: shares.append((doing, share)))
    assert {doing for doing, _ in shares} == {"reading"}
    assert 0 < shares[0][1] <= shares[-1][1] <= 1

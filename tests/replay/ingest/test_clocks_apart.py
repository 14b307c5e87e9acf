"""Pose and wheel signals whose clocks do not belong together, seen from their first messages."""

import sys

import numpy as np
import pytest

from wmr_replay.cli import main
from wmr_replay.ingest import Between, open_log
from wmr_replay.ingest.tracks import read_whole
from wmr_schemas.errors import LogUnusable
from wmr_schemas.mapping_file import LogMapping
from wmr_synth import Sensors, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=100.0, noise_xy_sd_m=0.001, noise_yaw_sd_rad=0.002)


@pytest.fixture(scope="module")
def drive():
    """12 s of random driving."""
    return synthesise("random", seed=5, duration_s=12, sensors=SENSORS).log


def constant(seconds):
    return lambda t_s: np.full(t_s.shape, float(seconds))


def about(seconds, jitter_s, seed=0):
    """A transport delay that is never shorter than ``seconds``."""
    rng = np.random.default_rng(seed)
    return lambda t_s: seconds + np.abs(rng.normal(0.0, jitter_s, t_s.shape))


def bursts(every_s):
    """Messages that are written down together, every so often."""
    return lambda t_s: np.ceil((t_s + 0.001) / every_s) * every_s - t_s


def read(path, **mapping):
    """The reader, read to its end, and its pose and torque stamps in s since 2023."""
    reader = open_log(path, LogMapping(**mapping))
    batches = list(reader.batches())
    stamps = [np.concatenate([getattr(b, name).t_ns for b in batches]) for name in ("pose", "torque")]
    return reader, *(t_ns * 1e-9 - 1.7e9 for t_ns in stamps)


APART = {
    "motion capture 8328 s ahead": {"stamps": {"pose": constant(8328)}},
    "motion capture 3 s behind": {"stamps": {"pose": constant(-3)}},
    "torques 3 s behind": {"stamps": {"torque": constant(-3)}},
    "2.5 s, on a link that jitters by 50 ms": {
        "stamps": {"pose": constant(2.5)},
        "delays": {"pose": about(0.05, 0.05)},
    },
    "simulated time at a tenth of the speed against wall time": {
        "stamps": {"torque": lambda t_s: -1.7e9 + 0.1 * t_s - t_s},
    },
    "simulated time, written in bursts": {
        "stamps": {"pose": constant(-1.7e9)},
        "delays": {"pose": bursts(5.0), "torque": bursts(3.0)},
    },
}
TOGETHER = {
    "one clock": {},
    "transport takes .3 s": {"delays": {"pose": about(0.3, 0.02)}},
    "a slow SLAM, 1 s late": {"delays": {"pose": about(1.0, 0.1)}},
    "AMCL stamps 1 s ahead": {"stamps": {"pose": constant(1.0)}},
    "a bag that was replayed a day later": {"recorder": constant(86400)},
    "a bag that was replayed at half the speed": {"recorder": lambda t_s: 500 + t_s},
    "log times jitter by seconds": {"recorder": lambda t_s: np.random.default_rng(3).uniform(0, 9, len(t_s))},
    "a recorder that writes each channel in bursts": {
        "delays": {"pose": bursts(5.0), "torque": bursts(3.0)},
    },
    "log times of zero": {"recorder": lambda t_s: -t_s},
    "a pose that begins 10 s late, replayed at 1.5 times the speed": {
        "recorder": lambda t_s: -t_s / 3,
    },
    "both clocks 3 s behind": {"stamps": {"pose": constant(-3), "torque": constant(-3)}},
}


@pytest.mark.parametrize("case", APART)
def test_clocks_apart_are_seen_and_log_time_is_used_for_both(tmp_path, drive, made_up_clocks, case):
    path = made_up_clocks.write_clocks(drive, tmp_path / "a.mcap", **APART[case])
    reader, pose_s, torque_s = read(path)
    assert [f.code for f in reader.findings] == ["clocks_apart"]
    assert "log time is used for both" in reader.findings[0].text
    by_log = read(path, clock="log")
    np.testing.assert_array_equal(pose_s, by_log[1])
    np.testing.assert_array_equal(torque_s, by_log[2])


@pytest.mark.parametrize("case", TOGETHER)
def test_what_is_no_offset_of_the_clocks_changes_nothing(tmp_path, drive, made_up_clocks, case):
    path = made_up_clocks.write_clocks(drive, tmp_path / "a.mcap", **TOGETHER[case])
    reader, pose_s, torque_s = read(path)
    assert not reader.findings
    by_header = read(path, clock="header")
    np.testing.assert_array_equal(pose_s, by_header[1])
    np.testing.assert_array_equal(torque_s, by_header[2])


def test_a_clock_that_the_user_gives_is_kept_and_the_finding_says_so(tmp_path, drive, made_up_clocks):
    path = made_up_clocks.write_clocks(drive, tmp_path / "a.mcap", stamps={"pose": constant(8328)})
    reader, pose_s, _ = read(path, clock="header")
    assert pose_s[0] == pytest.approx(8328, abs=1e-3)
    assert "kept, since a clock was given" in reader.findings[0].text
    assert not read(path, clock="log")[0].findings


def test_gap_and_fit_refuse_poses_and_torques_without_common_time(tmp_path, drive, made_up_clocks):
    path = made_up_clocks.write_clocks(drive, tmp_path / "a.mcap", stamps={"pose": constant(8328)})
    with pytest.raises(LogUnusable, match=r"12 s.*no time in common.*8328 s before") as raised:
        read_whole(path, LogMapping(clock="header"), Between())
    assert "--clock log" in raised.value.advice
    assert "--clock-offset 8328" in raised.value.advice
    whole = read_whole(path, LogMapping(clock="header"), Between(), clock_offset_s=8328.0)
    assert whole.log.torque.t_ns[0] == pytest.approx(whole.log.pose.t_ns[0], abs=2e7)
    assert "+8328 s were added to the stamps of the torques" in whole.notes
    assert "clocks_apart" in {f.code for f in read_whole(path, LogMapping(), Between()).findings}


def command(monkeypatch, capsys, *arguments):
    """Exit code and output of the program."""
    monkeypatch.setattr("sys.argv", ["wmr-replay", *map(str, arguments)])
    with pytest.raises(SystemExit) as left:
        sys.exit(main())
    said = capsys.readouterr()
    return left.value.code or 0, said.out + said.err


def test_a_run_says_what_was_found(tmp_path, drive, made_up_clocks, monkeypatch, capsys):
    path = made_up_clocks.write_clocks(drive, tmp_path / "a.mcap", stamps={"pose": constant(-3)})
    code, said = command(monkeypatch, capsys, "run", path, "--no-rrd", "--out", tmp_path / "out")
    assert code == 0
    assert "warning   clocks_apart: the stamps of /pose are -3 s off log time" in said
    assert "--clock header keeps the stamps" in said
    assert "Nothing can be said" not in said


@pytest.mark.parametrize("name", ["gap", "fit"])
def test_an_analysis_by_the_headers_exits_with_3(tmp_path, drive, made_up_clocks, monkeypatch, capsys, name):
    path = made_up_clocks.write_clocks(drive, tmp_path / "a.mcap", stamps={"pose": constant(8328)})
    out = tmp_path / "out"
    code, said = command(monkeypatch, capsys, name, path, "--clock", "header", "--out", out)
    assert code == 3
    assert "no time in common" in said
    assert "excitation" not in said
    assert not out.exists()

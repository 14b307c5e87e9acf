"""gap and fit refuse a log that a finding bars, and state all other findings; run says them."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import wmr_replay.jobs.gap as gap_jobs
from wmr_replay.api.fit import fit
from wmr_replay.api.gap import gap
from wmr_replay.cli.printing.gap import facts
from wmr_replay.jobs.data_quality import checked_findings
from wmr_schemas.errors import LogUnusable
from wmr_schemas.findings import Severity, finding
from wmr_schemas.status import Status
from wmr_synth import Sensors, record, synthesise

BINARY = Path(sys.executable).with_name("wmr-replay")
SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.005, noise_yaw_sd_rad=0.003)


def written(path: Path, *, torque: float = 1.0, wheels: float = 1.0) -> Path:
    made = synthesise("patrol", seed=3, duration_s=40.0, sensors=SENSORS)
    track = made.log.torque
    assert track is not None
    track = replace(
        track,
        left_nm=torque * track.left_nm,
        right_nm=torque * track.right_nm,
        left_radps=wheels * track.left_radps,
        right_radps=wheels * track.right_radps,
    )
    record(replace(made, log=replace(made.log, torque=track)), path, mode_topic=False)
    return path


@pytest.fixture(scope="module")
def reversed_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("reversed") / "drive.mcap", torque=-1.0)


def command(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    line = [BINARY, *map(str, arguments)]
    return subprocess.run(line, cwd=cwd, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("analysis", [gap, fit])
@pytest.mark.parametrize("modes", ["identified", "ideal"])
def test_reversed_torques_are_refused_in_the_findings_own_words(reversed_log, analysis, modes) -> None:
    words = r"torque_sign: alpha is -0\.\d+ .*both torques are reversed"
    with pytest.raises(LogUnusable, match=words) as caught:
        analysis(reversed_log, modes=modes)
    assert "left_torque_sign = -1" in caught.value.advice


def test_the_command_line_says_what_was_found_and_what_to_do(reversed_log: Path, tmp_path: Path) -> None:
    replayed = command("run", reversed_log, "--out", tmp_path / "out", "--no-rrd", cwd=tmp_path)
    assert replayed.returncode == 0, replayed.stderr
    assert "bars      torque_sign: alpha is -0." in replayed.stdout
    assert "give left_torque_sign = -1 and right_torque_sign = -1 in the torque section" in replayed.stdout
    refused = command("gap", reversed_log, cwd=tmp_path)
    assert refused.returncode == 3
    assert "both torques are reversed" in refused.stderr
    assert not (tmp_path / "drive.wmr").exists()


def test_a_warning_travels_with_the_analysis(tmp_path: Path, monkeypatch, made_up_gap) -> None:
    log = written(tmp_path / "drive.mcap", wheels=60 / (2 * np.pi))
    monkeypatch.setattr(gap_jobs, "analyse", lambda *_: made_up_gap.gap_result())
    answer = gap(log)
    assert [f["code"] for f in answer.findings] == ["wheel_speed_unit"]
    assert json.loads(answer.as_json())["findings"][0]["severity"] == "warning"
    assert any(
        "rpm in place of rad/s" in line for label, line in facts(answer.document) if label == "warning"
    )


def test_less_than_half_of_a_log_does_not_stop_an_analysis(tmp_path: Path, monkeypatch) -> None:
    whole = gap_jobs.read_whole(written(tmp_path / "drive.mcap"), gap_jobs.LogMapping(), gap_jobs.Between())
    found = [finding("no_heading", Severity.BARS, "the orientation is constant", n=40)]
    status = np.full(100, Status.OK, np.int8)
    status[:40] = Status.NO_HEADING
    monkeypatch.setattr("wmr_replay.jobs.data_quality.replayed_status", lambda _: (status, found))
    assert checked_findings(Path("a.mcap"), whole, whole.log.robot) == tuple(found)
    status[:60] = Status.NO_HEADING
    with pytest.raises(LogUnusable, match=r"^a\.mcap: no_heading: the orientation is constant"):
        checked_findings(Path("a.mcap"), whole, whole.log.robot)


def test_torques_too_large_for_the_model_are_refused_although_the_finding_is_withdrawn(
    tmp_path: Path, monkeypatch
) -> None:
    log = written(tmp_path / "drive.mcap")
    whole = gap_jobs.read_whole(log, gap_jobs.LogMapping(), gap_jobs.Between())
    found = [finding("torque_unit", Severity.BARS, "torques are about 36 times too large", n=20)]
    status = np.full(100, Status.OK, np.int8)
    status[40:60] = Status.IMPLAUSIBLE
    monkeypatch.setattr("wmr_replay.jobs.data_quality.replayed_status", lambda _: (status, found))
    assert checked_findings(log, whole, whole.log.robot) == tuple(found)
    with pytest.raises(LogUnusable, match="torque_unit: torques are about 36 times too large"):
        gap(log)

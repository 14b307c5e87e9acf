"""A model of another robot is refused, and numbers that run away are an error with the log's name."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import wmr_replay.jobs.gap as gap_jobs
from wmr_replay.api.gap import gap
from wmr_replay.jobs.base_model import check_same_robot
from wmr_schemas.errors import LogUnusable
from wmr_schemas.model_file import Model
from wmr_schemas.robot import RobotParameters
from wmr_synth import Sensors, record, synthesise


def model(**parameters: float) -> Model:
    return Model(robot=RobotParameters(**parameters))


@pytest.mark.parametrize(
    ("stated", "own", "at_fault"),
    [
        ({"half_track_m": 0.25}, {"half_track_m": 0.12}, "half_track_m"),
        (
            {"half_track_m": 0.25, "wheel_radius_m": 0.1},
            {"half_track_m": 0.27, "wheel_radius_m": 0.2},
            "wheel",
        ),
        ({"half_track_m": 0.25}, {"half_track_m": 0.27, "wheel_radius_m": 0.2}, ""),
        ({}, {"half_track_m": 0.27}, ""),
        ({"half_track_m": 0.25, "mass_kg": 9.0}, {"half_track_m": 0.25, "mass_kg": 90.0}, ""),
    ],
)
def test_lengths_that_differ_by_a_quarter_are_of_two_robots(stated, own, at_fault):
    log = Path("a.mcap"), RobotParameters(**stated)
    if not at_fault:
        check_same_robot(*log, model(**own))
        return
    with pytest.raises(LogUnusable, match=f"a.mcap: {at_fault}.*the model of another robot"):
        check_same_robot(*log, model(**own))


def test_without_a_model_nothing_is_compared():
    check_same_robot(Path("a.mcap"), RobotParameters(half_track_m=0.25), None)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    sensors = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.005, noise_yaw_sd_rad=0.003)
    made = synthesise("patrol", seed=3, duration_s=20.0, sensors=sensors)
    record(made, tmp_path / "drive.mcap", mode_topic=False)
    return tmp_path / "drive.mcap"


@pytest.mark.parametrize("base", ["torque", "wheel-speed"])
def test_a_model_of_another_robot_is_refused_before_the_analysis(log: Path, base: str) -> None:
    with pytest.raises(LogUnusable, match=r"half_track_m is \S+ here, and 0.05 in the model"):
        gap(log, model=model(half_track_m=0.05, wheel_radius_m=0.1, alpha=0.3), base=base)


def test_a_model_is_not_proven_on_a_log_of_another_robot(log: Path, monkeypatch, made_up_gap) -> None:
    result = replace(made_up_gap.gap_result(), model=model(half_track_m=0.05))
    monkeypatch.setattr(gap_jobs, "analyse", lambda *_: result)
    with pytest.raises(LogUnusable, match=r"half_track_m is \S+ here, and 0.05 in the model"):
        gap(log, prove_on=log)


def test_numbers_that_run_away_are_no_internal_error(log: Path, monkeypatch) -> None:
    def run_away(*_: object) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(gap_jobs, "analyse", run_away)
    with pytest.raises(LogUnusable, match=r"drive\.mcap: the simulated motion runs away"):
        gap(log)

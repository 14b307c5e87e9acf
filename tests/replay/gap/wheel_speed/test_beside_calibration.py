"""An effect is weighed beside a calibration that is as uncertain as it is."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.made_up_wheels import drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.beside_calibration import beside_calibration, is_of_calibration
from wmr_replay.gap.wheel_speed.estimate import whitened
from wmr_replay.gap.wheel_speed.predict import Parameter
from wmr_replay.gap.wheel_speed.select import base_fit, fitted_with

RTK = (0.01, 0.005)
BETWEEN = GapOptions().gates.wheel_speed.gates.between_logs


@pytest.fixture(scope="module")
def hidden():
    """The problem of a drive whose centre of rotation lies 5 cm off, and the fit that says so."""
    log = drive({"icr_offset": {"offset_m": 0.05}}, noise=RTK, seed=3)
    problem = problem_of([log], base_of(log.robot, None), GapOptions(), "wheel_speed")
    return problem, fitted_with(problem, base_fit(problem), "icr_offset", {})


def with_lever_arm(problem, sd_m):
    """A calibration that leaves a lever arm along the robot open, which is the same motion."""
    return replace(problem, base_sd={"pose_lever_arm": {"x_m": sd_m, "y_m": 0.0}})


@pytest.mark.parametrize(("sd_m", "open_to"), [(0.05, True), (0.002, False)])
def test_what_the_calibration_leaves_open_in_another_name_is_no_finding(hidden, sd_m, open_to):
    problem, found = hidden
    assert is_of_calibration(with_lever_arm(problem, sd_m), found, "icr_offset") is open_to


def test_without_a_calibration_nothing_is_left_open(hidden):
    problem, found = hidden
    assert not is_of_calibration(problem, found, "icr_offset")


def test_a_calibration_is_as_many_measurements(hidden):
    """Rows of the log and a row of the prior, by least squares."""
    problem, found = hidden
    problem = with_lever_arm(problem, 0.02)
    beside = beside_calibration(problem, found)
    held = Parameter("pose_lever_arm", "x_m")
    start = {**found.values, "pose_lever_arm": {"x_m": 0.0, "y_m": 0.0}}
    rows = whitened(problem, (*found.parameters, held), start, found.noises)
    prior = np.array([[0.0, 1 / (BETWEEN * 0.02)]])
    step = np.linalg.lstsq(np.vstack([rows.columns, prior]), np.append(rows.errors, 0.0), rcond=None)[0]

    assert beside.parameters == (*found.parameters, held)
    assert beside.sizes == pytest.approx(found.sizes[0] * np.array([1, 0]) + step, rel=1e-6, abs=1e-9)
    assert beside.sd[0] == pytest.approx(BETWEEN * 0.02, rel=0.1)
    assert beside.n_clusters - len(beside.parameters) == found.n_clusters - len(found.parameters)

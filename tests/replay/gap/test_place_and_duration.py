"""What a place, a duration or a way round rules out: tyres where only one place skids, a slip that lasts
like a load, an arm to one side where every turn is to the left.
"""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, made_fit, made_log, problem_of

from wmr_replay.gap.evidence.one_place import skids_at_one_place, tyres_are_assumed
from wmr_replay.gap.evidence.sideways_arm import is_sideways_one_way
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.fit_candidates import is_ruled_out


@pytest.fixture(scope="module")
def drive():
    """40 s of the base model."""
    return problem_of(made_log(1))


@pytest.mark.parametrize(
    ("name", "at_m", "said"),
    [
        ("cornering_stiffness", (2.0,), True),
        ("cornering_stiffness", (2.0, 2.8), True),
        ("cornering_stiffness", (2.0, 6.0), False),
        ("viscous_drag", (2.0,), False),
    ],
)
def test_skids_at_one_place_alone_may_be_the_ground(drive, name, at_m, said):
    """Sensitivities within 30 cm of some places of a straight path of 8 m, there and back."""
    n = len(drive.binned)
    x_m = 8.0 * np.abs(np.linspace(-1, 1, n))
    binned = replace(drive.binned, pose=np.stack([x_m, np.ones(n), np.zeros(n)], axis=1))
    near = np.any([np.abs(x_m - one) < 0.3 for one in at_m], axis=0)
    psi = np.random.default_rng(5).normal(size=(n, 3, 1)) * near[:, None, None]
    there = replace(drive, binned=binned)
    fit = made_fit(there, Extension(BASE, {name: {candidate_of(name).free[0]: -0.5}}), np.zeros((n, 3)), psi)
    reason = skids_at_one_place(name, there, fit)
    assert bool(reason) is said
    assert not said or f"about x {np.mean(at_m):.1f} m, y 1.0 m alone" in reason
    small = replace(there, binned=replace(binned, pose=binned.pose * (0.1, 1, 1)))
    assert skids_at_one_place(name, small, fit) == ""


@pytest.mark.parametrize(("lasts_s", "another"), [(35.0, False), (37.0, True)])
def test_a_loss_that_lasts_is_no_slip(drive, lasts_s, another):
    interval = {"start_s": 1.0, "end_s": 1.0 + lasts_s, "loss": 0.3}
    fit = made_fit(drive, Extension(BASE, {"slip_interval": interval}), np.zeros((len(drive.binned), 3)))
    assert is_ruled_out(drive, fit, "slip_interval") is another


@pytest.mark.parametrize(
    ("name", "stiffness", "said"),
    [
        ("cornering_stiffness", None, True),
        ("cornering_stiffness", 300.0, False),
        ("viscous_drag", None, False),
    ],
)
def test_tyres_that_nobody_stated_are_no_finding(drive, name, stiffness, said):
    robot = replace(drive.binned.log.robot, mass_kg=20.0, cornering_stiffness_over_epsilon=stiffness)
    known = replace(drive, binned=replace(drive.binned, log=replace(drive.binned.log, robot=robot)))
    assert ("assumed" in tyres_are_assumed(name, known)) is said


@pytest.mark.parametrize(
    ("one_way", "x_m", "misfit", "said"),
    [
        (True, 0.0, 0.003, True),
        (False, 0.0, 0.003, False),
        (True, 0.05, 0.003, False),
        (True, 0.0, None, False),
    ],
)
def test_an_arm_to_one_side_is_no_finding_where_every_turn_is_to_one_side(drive, one_way, x_m, misfit, said):
    """On turns to both sides, or all to the left; a base model that is given knows how the robot brakes."""
    binned = drive.binned
    yaw = np.cumsum(binned.step_s * np.sin(binned.t_s) * (np.sign(np.sin(binned.t_s)) if one_way else 1.0))
    turning = replace(drive, binned=replace(binned, pose=np.stack([binned.t_s, 0 * yaw, yaw], axis=1)))
    psi = np.random.default_rng(5).normal(size=(len(binned), 3, 2)) * 100.0
    arm = Extension(
        BASE,
        {"pose_lever_arm": {"x_m": x_m, "y_m": 0.03}},
        misfit={} if misfit is None else {"pose_lever_arm": misfit},
    )
    fit = made_fit(turning, arm, np.random.default_rng(6).normal(size=(len(binned), 3)), psi)
    assert ("turn the other way" in is_sideways_one_way("pose_lever_arm", turning, fit)) is said
    assert is_sideways_one_way("viscous_drag", turning, fit) == ""

"""Intervals of times and places: of a load that comes while no torque acts, of a patch that is crossed.

The oracles are the motion's equation, and circles through points that are off by chance.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares
from tests.replay.gap.plain_loop import BASE, ROBOT, problem_of

from wmr_replay.gap.estimation.refit import fit_model, keys_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.effects import within_the_log
from wmr_replay.gap.result.place_reach import (
    circle_covariance,
    crossed_once,
    crossings,
    over_slips,
    place_covariance,
    reach,
)
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

STEP_S, N = 0.01, 6000
PUSHES_S, PUSH_S = (0.0, 6.0, 12.0, 18.0, 30.0, 36.0, 42.0, 48.0), 1.0


def loaded(t0_s: float):
    """60 s straight ahead, pushed for 1 s at a time to and fro; half of the mass comes at ``t0_s``."""
    t_s = STEP_S * np.arange(N)
    asked = sum((-1.0) ** k * ((t_s >= at) & (t_s < at + PUSH_S)) for k, at in enumerate(PUSHES_S))
    each_nm = 0.4 * asked / (2 * BASE.alpha)
    moved_mps2 = 0.4 * asked / np.where(t_s >= t0_s, 1.5, 1.0)
    x_m = np.cumsum(np.cumsum(moved_mps2)) * STEP_S**2
    pose = np.stack([x_m, np.zeros(N), np.zeros(N)]) + 1e-3 * np.random.default_rng(4).normal(size=(3, N))
    none, t_ns = np.full(N, np.nan), np.arange(N, dtype=np.int64) * 10_000_000
    return problem_of(
        Log(PoseTrack(t_ns, *pose), TorqueTrack(t_ns, each_nm, each_nm, none, none), None, ROBOT)
    )


@pytest.mark.parametrize("t0_s", [20.0, 28.0])
def test_the_time_of_a_load_reaches_over_all_of_a_pause_and_not_into_the_pushes(t0_s):
    """Between 19 and 30 s no torque acts."""
    problem = loaded(t0_s).all_fitted()
    fit = fit_model(problem, Extension(BASE, {"load_step": {"mass_ratio": 0.4, "t0_s": 24.0}}))
    low, high = reach(problem, fit, "load_step", "t0_s")
    assert 18.0 < low < 19.7
    assert 29.3 < high < 31.0


SLIPS_S = [(10.0, 12.0), (12.3, 13.0), (14.0, 15.0), (20.0, 21.0)]


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ((13.2, 13.4), (10.0, 13.4)),  # the hole of .3 s is of the slips before, that of 1 s is not
        ((13.2, 13.6), (10.0, 15.0)),
        ((11.0, 14.5), (10.0, 15.0)),
        ((16.0, 18.0), (16.0, 18.0)),
        ((15.4, 19.7), (14.0, 21.0)),
        ((1.0, 55.0), (1.0, 55.0)),
    ],
)
def test_when_traction_was_lost_reaches_over_the_slips_beside_it(ends, expected):
    binned = loaded(20.0).binned
    slipping = np.any([(binned.t_s >= a) & (binned.t_s <= b) for a, b in SLIPS_S], axis=0)
    slippery = replace(binned, mode=np.where(slipping, ContactMode.SLIPPING, ContactMode.IDEAL))
    assert over_slips(slippery, ends, 0.5) == pytest.approx(expected, abs=0.1)
    assert over_slips(binned, ends, 0.5) == ends


def test_an_interval_ends_with_the_log():
    """After the last push nothing shows when a load came, or whether one did after the end."""
    problem = loaded(40.0)
    t_s = problem.binned.t_s
    assert within_the_log(problem.binned, "t0_s", 55.0, (50.0, 85.0)) == (50.0, float(t_s[-1]))
    assert within_the_log(problem.binned, "t0_s", 5.0, (-9.0, 6.0)) == (float(t_s[0]), 6.0)


def test_the_time_of_a_load_that_comes_in_a_push_hardly_reaches_anywhere():
    problem = loaded(12.5).all_fitted()
    fit = fit_model(problem, Extension(BASE, {"load_step": {"mass_ratio": 0.4, "t0_s": 12.4}}))
    low, high = reach(problem, fit, "load_step", "t0_s")
    assert high - low < 1.0


def test_a_time_behind_a_bump_is_as_likely_and_one_behind_a_hill_is_none():
    """−2 log likelihood is 0 at 24 s and from 30 to 31 s, and higher by 8 between; from 32 s on by 20."""
    at = Extension(BASE, {"load_step": {"mass_ratio": 0.4, "t0_s": 24.0}})

    def deviance(extension, noise):
        t0_s = extension.effects["load_step"]["t0_s"]
        return float(
            np.interp(t0_s, [22, 23, 25, 27, 29, 30, 31, 32, 40, 41], [20, 0, 0, 8, 8, 0, 0, 20, 20, 0])
        )

    problem = SimpleNamespace(settings=loaded(20.0).settings, deviance=deviance)
    low, high = reach(problem, SimpleNamespace(extension=at, noise=None), "load_step", "t0_s")
    assert low == pytest.approx(22.8, abs=0.31)
    assert high == pytest.approx(31.1, abs=0.31)


def crossing(angles_rad, circle, extent_m=40.0):
    """A path that goes in and out of the circle at the angles, and far beyond."""
    x_m, y_m, radius_m = circle
    shares = np.array([1.1, 0.9, 0.9, 1.1] * len(angles_rad))[: 2 * len(angles_rad)]
    angles = np.repeat(angles_rad, 2)
    pose = np.zeros((len(angles) + 2, 3))
    pose[1:-1, :2] = [x_m, y_m] + radius_m * shares[:, None] * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    pose[[0, -1], :2] = [[x_m - extent_m / 2, y_m], [x_m + extent_m / 2, y_m]]
    return SimpleNamespace(pose=pose)


def test_a_patch_is_known_as_well_as_circles_through_its_crossings():
    circle, sd_m, angles = np.array([3.0, -2.0, 1.5]), 0.15, np.array([0.2, 1.6, 2.9, 4.4])
    rng, normals = np.random.default_rng(2), np.column_stack([np.cos(angles), np.sin(angles)])

    def through(points):
        return least_squares(lambda c: np.hypot(*(points - c[:2]).T) - c[2], circle).x

    found = [
        through(circle[:2] + (circle[2] + sd_m * rng.normal(size=(4, 1))) * normals) for _ in range(2000)
    ]
    at = {"x_m": circle[0], "y_m": circle[1], "radius_m": circle[2]}
    V = circle_covariance(crossing(angles, circle), at, sd_m)
    np.testing.assert_allclose(np.sqrt(np.diag(V)), np.std(found, axis=0), rtol=0.08)


def test_a_patch_that_is_crossed_once_may_be_small_or_large():
    """Of all circles through two points, small and large, none is likelier."""
    circle, points = (0.0, 0.0, 5.0), np.array([-0.2, 0.2])
    V = circle_covariance(crossing(points, circle), {"x_m": 0.0, "y_m": 0.0, "radius_m": 5.0}, 0.15)
    chord_m, sd = 2 * 5.0 * np.sin(0.2), np.sqrt(np.diag(V))
    smallest = np.array([5.0 * np.cos(0.2), 0.0, chord_m / 2])  # the circle whose diameter is the chord
    assert np.all(np.abs(np.array(circle) - smallest) < sd + 1e-9)
    assert sd[1] < 1.0  # along the chord it is known


def test_one_place_of_an_edge_has_one_form_however_often_it_is_crossed():
    circle, keys = (0.0, 0.0, 2.0), {"x_m": 0.0, "y_m": 0.0, "radius_m": 2.0}
    once = circle_covariance(crossing(np.array([0.0, 2.0]), circle), keys, 0.15)
    often = circle_covariance(crossing(np.array([0.0, 2.0] * 20), circle), keys, 0.15)
    np.testing.assert_allclose(often, once, rtol=0.05)


def test_a_lever_arm_has_no_edge_and_a_time_the_one_of_its_form():
    problem = loaded(20.0)
    effects = {"pose_lever_arm": {"x_m": 0.1, "y_m": 0.0}, "load_step": {"mass_ratio": 0.4, "t0_s": 24.0}}
    fit = SimpleNamespace(extension=Extension(BASE, effects), keys=keys_of(Extension(BASE, effects)))
    V = place_covariance(fit, problem.binned)
    at = fit.keys.index(("load_step", "t0_s"))
    assert V[at, at] == problem.settings.report.edge_sd_s**2
    assert V.sum() == V[at, at]


@pytest.mark.parametrize(("angles", "told"), [([-0.2, 0.2], True), ([0.2, 1.6, 2.9, 4.4], False)])
def test_a_patch_that_is_crossed_once_is_said_with_the_places(angles, told):
    binned = crossing(np.array(angles), (0.0, 0.0, 5.0))
    binned.settings = loaded(20.0).settings
    circle = {"x_m": 0.0, "y_m": 0.0, "radius_m": 5.0, "loss": 0.5}
    fit = SimpleNamespace(extension=Extension(BASE, {"low_friction_patch": circle}))
    notes = crossed_once(binned, fit)
    assert len(notes) == told
    if told:
        assert "at (4.9, -1.0) m and (4.9, 1.0) m alone" in notes[0]


def test_noise_about_one_place_of_an_edge_makes_no_other_places():
    """Wherever the place lies: also where directions begin again, at half a turn."""
    circle, jitter = (0.0, 0.0, 2.0), np.array([-0.02, 0.03, -0.01, 0.02])
    for at in np.linspace(-np.pi, np.pi, 41):
        path = crossing(np.concatenate([at + jitter, at + 2.0 + jitter]), circle)
        assert len(crossings(path, {"x_m": 0.0, "y_m": 0.0, "radius_m": 2.0}, 0.15)) == 2

"""What an interval takes for granted, contact modes and sideslip. The oracle is the motion of the log:
its drag, and where its pose lies.
"""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_fit, made_log, problem_of
from tests.replay.gap.test_sideslip import cornering

from wmr_replay.gap.estimation.covariance import robust_covariance
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.estimation.without_labels import independent, step_without_labels
from wmr_replay.gap.evidence import spread
from wmr_replay.gap.evidence.spread import interval_covariance, may_be_nothing
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack

DRAG_PER_S = 0.1
EXACT = replace(SETTINGS, filter=SETTINGS.filter._replace(slip_disturbance_mps2_rthz=0.02))
"""Slipping follows the model closely, so that a wrong label is no loss of information alone."""
DRAG = Extension(BASE, {"viscous_drag": {"c1_per_s": 0.0}})


def labelled(seed: int, *slipping_s: tuple[float, float]) -> Fit:
    """A drag fitted to a log that rolls all the time, of which the modes say that it slips at times."""
    log = made_log(seed, drag_per_s=DRAG_PER_S)
    starts = [0.0, *np.ravel(slipping_s).tolist()]
    modes = [ContactMode.IDEAL, ContactMode.SLIPPING] * len(slipping_s) + [ContactMode.IDEAL]
    t_ns = log.pose.t_ns[0] + np.array([round(1e9 * s) for s in starts], dtype=np.int64)
    track = ModeTrack(t_ns, np.array(modes, np.int8))
    problem = Problem.of(bin_identified(log, track, EXACT)).all_fitted()
    return fit_model(problem, DRAG)


def test_slipping_that_is_not_there_moves_a_drag_and_the_step_moves_it_back():
    """To what the same log says with the labels that it was made with."""
    slips = (6.0, 6.3), (21.0, 21.3)
    fits, right = ([labelled(seed, *when) for seed in range(4)] for when in (slips, ()))
    off = np.array([one.values[0] - other.values[0] for one, other in zip(fits, right, strict=True)])
    left = off + [step_without_labels(fit.problem, fit)[0] for fit in fits]
    assert np.sqrt(np.mean(left**2)) < 0.75 * np.sqrt(np.mean(off**2))


def test_right_labels_leave_little_to_move():
    for seed in range(4):
        fit = labelled(seed)
        sd = float(np.sqrt(robust_covariance(fit.problem, fit)[0][0, 0]))
        assert abs(step_without_labels(fit.problem, fit)[0]) < 0.5 * sd


def test_labels_that_are_given_are_taken_for_granted():
    problem = problem_of(made_log(1, drag_per_s=DRAG_PER_S))
    assert np.all(step_without_labels(problem, fit_model(problem, DRAG)) == 0.0)


@pytest.mark.parametrize(("drag_per_s", "nothing"), [(DRAG_PER_S, False), (0.0, True)])
def test_an_effect_whose_interval_holds_no_effect_may_be_none(drag_per_s, nothing):
    """Of a log without a drag, nearly all intervals hold 0; of one with it, none does."""
    fits = [
        fit_model(problem_of(made_log(seed, drag_per_s=drag_per_s)).all_fitted(), DRAG) for seed in range(6)
    ]
    found = [may_be_nothing(fit.problem, fit, "viscous_drag") for fit in fits]
    assert sum(found) >= 5 if nothing else not any(found)


def test_the_size_of_a_lever_arm_is_that_of_both_its_components():
    """Each may be 0 where both together are not: what they have in common is known, not which it is."""
    problem = problem_of(made_log(1, seconds=20.0))
    extension = Extension(BASE, {"pose_lever_arm": {"x_m": 0.05, "y_m": 0.05}})
    fit = made_fit(problem, extension, np.zeros((len(problem.binned), 3)))
    for along, across, none in ((0.1, 0.001, False), (0.1, 0.1, True)):
        turn = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
        V = turn @ np.diag([across**2, along**2]) @ turn.T

        def known(*_, V=V):
            return V, 12

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(spread, "interval_covariance", known)
            assert may_be_nothing(problem, fit, "pose_lever_arm") is none
            assert np.all(np.abs(fit.values) < 2 * np.sqrt(np.diag(V)))


def test_times_and_places_do_not_move():
    rng = np.random.default_rng(0)
    fit = labelled(1)
    extension = Extension(BASE, {"load_step": {"mass_ratio": 0.1, "t0_s": 20.0}})
    e, psi = rng.normal(size=(len(fit.innovations), 3)), rng.normal(size=(len(fit.innovations), 3, 2))
    step = step_without_labels(fit.problem, made_fit(fit.problem, extension, e, psi))
    assert step[[key == "t0_s" for _, key in made_fit(fit.problem, extension, e).keys]] == [0.0]


def test_directions_are_a_standard_deviation_long_and_independent():
    psi = np.random.default_rng(3).normal(size=(50, 3, 3)) @ np.diag([1.0, 1e3, 1e-3])
    flat = psi.reshape(-1, 3)
    directions = independent(psi)
    assert directions @ flat.T @ flat @ directions.T == pytest.approx(np.eye(3), abs=1e-9)


def test_a_direction_that_is_not_seen_is_left_out():
    psi = np.random.default_rng(3).normal(size=(50, 3, 2))
    assert len(independent(np.concatenate([psi, psi[:, :, :1]], axis=2))) == 2


def test_the_interval_of_an_arm_is_as_wide_as_tyres_that_creep_move_it():
    """At one speed tyres that creep by 4 mm/s at 1 m/s² move the pose as an arm of 4 mm does."""
    arm_m, arm = 0.05, Extension(BASE, {"pose_lever_arm": {"x_m": 0.0, "y_m": 0.0}})
    fit = fit_model(cornering(0.004, arm_m, 4e-3), arm)
    plain, wide = (of(fit.problem, fit)[0][0, 0] for of in (robust_covariance, interval_covariance))
    off_m = abs(fit.extension.effects["pose_lever_arm"]["x_m"] - arm_m)
    assert 5 * np.sqrt(plain) < off_m < 2.5 * np.sqrt(wide)

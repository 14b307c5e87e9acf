"""The interval of the time of a load that comes while no torque acts; the oracle is the motion's equation."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, ROBOT, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.effects import within_the_log
from wmr_replay.gap.result.place_reach import over_slips, reach
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

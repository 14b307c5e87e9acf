"""Slippery ground in the filter bank: a wheel slips while its demand exceeds the friction limit."""

import numpy as np
import polars as pl
import pytest

from wmr_replay.identify.filter_bank.states import CAPPED, LN_ALPHA, LN_BETA, N_STATES, RHO, make_prior
from wmr_replay.identify.filter_bank.traction import slipping_share, traction
from wmr_schemas import PAPER_ROBOT
from wmr_synth import Sensors, synthesise
from wmr_synth.plants.limited_traction import (
    N_LIMITED,
    Tyre,
    advance,
    cap_of,
    derivative,
    settle,
    traction_of,
)
from wmr_synth.plants.two_wheeled import V_THETA, V_Y, coefficients

PRIOR = make_prior(PAPER_ROBOT)
SENSORS = Sensors(rate_hz=200.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.01)


def test_on_slippery_ground_each_wheel_carries_no_more_than_its_cap():
    """The plant's capped tyres, settled: (1 − ρ) dv/dt = f_R + f_L; 40 N·m right and 5 N·m left, μ = .06."""
    tyres, c = traction_of(PAPER_ROBOT, Tyre()), coefficients(PAPER_ROBOT, {0})
    tyre, rate, cap = np.zeros(N_LIMITED), np.empty(N_LIMITED), cap_of(0.06, tyres)
    tyre[V_Y] = 3.0
    settle(tyre, (5.0, 40.0), cap, c, tyres)
    work = np.empty((5, N_LIMITED))
    for _ in range(100):
        advance(tyre, (5.0, 40.0), cap, 0.01, c, tyres, work)
    derivative(tyre, (5.0, 40.0), cap, c, tyres, rate)
    mean = np.zeros(N_STATES)
    mean[[LN_ALPHA, LN_BETA, RHO]] = PRIOR.ln_alpha, PRIOR.ln_beta, np.log(0.06 * 9.81 / 2)
    by = traction(mean, CAPPED, 45.0, 35.0, PRIOR)
    assert by.ahead == pytest.approx(rate[V_Y], rel=0.02)
    assert by.turning == pytest.approx(rate[V_THETA], rel=0.02)
    assert slipping_share(mean, np.eye(N_STATES) * 1e-4, 45.0, 35.0) > 0.99
    assert slipping_share(mean, np.eye(N_STATES) * 1e-4, 9.0, 7.0) < 0.01


def test_slips_that_come_of_themselves_are_found(log_rows):
    """In ``random-traction-limited`` friction is .01 to .06 where it is slippery, and the slips are brief."""
    samples = log_rows(synthesise("random-traction-limited", seed=31, sensors=SENSORS).log).samples()
    judged = samples.filter(pl.col("status") != "warming_up")
    named = judged.group_by("mode_true").agg((pl.col("mode") == pl.col("mode_true")).mean().alias("recall"))
    assert (judged["mode"] == judged["mode_true"]).mean() > 0.88
    assert named["recall"].min() > 0.6
    assert judged["alpha"][-1] == pytest.approx(PAPER_ROBOT.alpha, rel=0.03)

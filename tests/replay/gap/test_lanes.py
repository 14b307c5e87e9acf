"""Passes of the filter that run together are those that run alone, number by number."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap.estimation.filter import FilterInput, filter_pass
from wmr_replay.gap.estimation.lanes import Lane, filter_lanes
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS, SensitivityTargets
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import N_ROW, Base, Row
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.compiled.lanes import WIDTH
from wmr_synth import Sensors, synthesise

SETTINGS = GateSettings()
BASE = Base(0.03, 0.05, 0.25, 8.0, 0.0, 0.4, 0.5, 2.0, 5.0)
NOISE = Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2)
MOVED = [NOISE._replace(yaw_sd_mps2=0.05 * (1 + 0.1 * k)) for k in range(6)]
POSITIVE = {Theta.UNDECLARED, Theta.HELD_SIDEWAYS, Theta.FRICTION_SPEED}
FIELDS = ("deviance", "innovations", "log_variances")


@st.composite
def drives(draw, n=40):
    """Input rows (n, 16) with all modes and two lengths of a step."""
    rng, rows = np.random.default_rng(draw(st.integers(0, 2**32 - 1))), np.zeros((n, N_ROW))
    rows[:, Row.DT] = rng.choice([0.02, 0.03], n)
    rows[:, [Row.LEFT, Row.RIGHT]] = rng.normal(0, 2, (n, 2))
    rows[:, Row.MODE] = np.repeat(rng.integers(0, 4, n), 8)[:n]
    rows[:, [Row.LOAD, Row.PATCH, Row.SLIP]] = rng.random((n, 3))
    rows[:, Row.LOOSE] = np.where(rng.random(n) < 0.1, 0.1, 0.0)
    rows[:, Row.AGE] = np.cumsum(rows[:, Row.DT])
    rows[:, Row.SWING] = np.where(rng.random(n) < 0.1, 1.0, 0.0)
    rows[:, [Row.LONG_BY_V, Row.LONG_BY_W, Row.YAW_BY_V, Row.YAW_BY_W]] = rng.normal(0, 1, (n, 4))
    return rows


@st.composite
def lanes(draw):
    """One to all lanes of one or two drives, each with up to three effects and a noise of its own."""
    both = draw(drives()), draw(drives())
    both[1][:, Row.DT] = both[0][:, Row.DT]
    found = []
    for _ in range(draw(st.integers(1, WIDTH))):
        theta = np.zeros(N_THETA)
        for place in draw(st.lists(st.sampled_from(Theta), max_size=3, unique=True)):
            theta[place] = draw(st.floats(0.0 if place in POSITIVE else -0.3, 0.3))
        noise = Diffusion(*draw(st.lists(st.floats(1e-3, 2.0), min_size=8, max_size=8)))
        found.append(Lane(both[draw(st.integers(0, 1))], theta, noise))
    return found


@given(lanes(), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_each_lane_is_the_pass_that_runs_alone(lanes, seed):
    rng, n = np.random.default_rng(seed), len(lanes[0].rows)
    poses, variances = np.cumsum(rng.normal(0, 0.01, (n, 3)), axis=0), rng.uniform(1e-6, 1e-4, (n, 3))
    first = np.concatenate([poses[0], rng.normal(0, 0.3, 2), np.zeros(4)])
    together = filter_lanes(lanes, poses, variances, first, BASE, SETTINGS.filter)
    for lane, found in zip(lanes, together, strict=True):
        data = FilterInput(lane.rows, poses, variances, first)
        alone = filter_pass(data, lane.theta, BASE, lane.noise, NO_TARGETS, SETTINGS.filter, keep=False)
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name), err_msg=name)


@pytest.fixture(scope="module")
def drive():
    log = synthesise("random", seed=3, duration_s=20.0, sensors=Sensors(rate_hz=50.0)).log
    return log, Extension(base_of(log.robot))


@pytest.mark.parametrize("n", [0, 1, 4, 6])
def test_passes_asked_for_together_are_those_asked_for_one_by_one(drive, n):
    log, extension = drive
    models = [(extension.with_effect("viscous_drag", {"c1_per_s": 0.1 * k}), MOVED[k]) for k in range(n)]
    together, alone = (Problem.of(bin_log(log, SETTINGS, log.mode)) for _ in range(2))
    found = together.filtered_each(models)
    for model, output in zip(models, found, strict=True):
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(output, name), getattr(alone.filtered(*model), name))
        assert together.filtered(*model) is output


def test_of_passes_asked_for_together_those_that_are_kept_are_not_computed(drive):
    log, extension = drive
    problem = Problem.of(bin_log(log, SETTINGS, log.mode))
    kept = problem.filtered(extension, MOVED[2])
    found = problem.filtered_each([(extension, noise) for noise in [*MOVED[:4], MOVED[0]]])
    assert found[2] is kept
    assert found[4] is found[0]


@given(drives(), st.integers(0, 7), st.integers(0, 6), st.integers(0, 6), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_a_column_of_sensitivities_is_the_same_alone_as_beside_others(
    rows, n_places, n_efforts, n_cells, seed
):
    """Blocks of columns that are not full, of each kind."""
    rng, n = np.random.default_rng(seed), len(rows)
    places = rng.permutation(np.array([int(p) for p in Theta if p not in POSITIVE]))[:n_places]
    cells = np.arange(n) * n_cells // n
    targets = SensitivityTargets(places.astype(np.int64), rng.normal(size=(n_efforts, n, 2)), cells, n_cells)
    poses, variances = np.cumsum(rng.normal(0, 0.01, (n, 3)), axis=0), np.full((n, 3), 1e-4)
    data = FilterInput(rows, poses, variances, np.zeros(9))

    def columns(of):
        return filter_pass(data, np.zeros(N_THETA), BASE, NOISE, of, SETTINGS.filter, True).sensitivities

    whole, none = columns(targets), NO_TARGETS
    assert whole.shape == (n, 3, n_places + n_efforts + 2 * n_cells)
    for j in range(n_places):
        alone = columns(none._replace(places=targets.places[j : j + 1]))
        np.testing.assert_array_equal(whole[:, :, j], alone[:, :, 0])
    for j in range(n_efforts):
        alone = columns(none._replace(efforts=targets.efforts[j : j + 1]))
        np.testing.assert_array_equal(whole[:, :, n_places + j], alone[:, :, 0])
    if n_cells:
        alone = columns(none._replace(cells=cells, n_cells=n_cells))
        np.testing.assert_array_equal(whole[:, :, n_places + n_efforts :], alone)
        assert np.any(alone != 0)

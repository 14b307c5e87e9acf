"""Long logs: a diffusion that is searched on a part, modes in longer bins, passes of the filter that are
kept, and products without copies.
"""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.modes import identified_modes
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.recent import Recent
from wmr_replay.gap.scan.score import product, projected, squared
from wmr_replay.gap.settings import GateSettings
from wmr_synth import Sensors, synthesise

SETTINGS = GateSettings()
NOISE = Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2)


@pytest.fixture(scope="module")
def minutes():
    """Five minutes at 25 Hz, and the model that drove them."""
    log = synthesise("random", seed=3, duration_s=300.0, sensors=Sensors(rate_hz=25.0)).log
    return log, Extension(base_of(log.robot))


def test_the_diffusion_of_a_long_log_is_as_likely_as_one_that_is_searched_on_the_whole(minutes):
    log, extension = minutes
    whole = replace(SETTINGS, diffusion=replace(SETTINGS.diffusion, part_rows=10**9))
    short, full = (Problem.of(bin_log(log, chosen, log.mode)) for chosen in (SETTINGS, whole))
    assert len(short.binned) >= 2 * SETTINGS.diffusion.part_rows
    found, best = fit_diffusion(short, extension), fit_diffusion(full, extension)
    assert found != best
    assert full.deviance(extension, found) - full.deviance(extension, best) < 1.0


def test_a_pass_is_kept_until_the_model_or_the_noise_is_another(minutes):
    log, extension = minutes
    problem = Problem.of(bin_log(log, SETTINGS, log.mode))
    pass_ = problem.filtered(extension, NOISE)
    assert problem.filtered(replace(extension), Diffusion(*NOISE)) is pass_
    others = [
        problem.filtered(extension, NOISE._replace(yaw_sd_mps2=0.06)),
        problem.filtered(extension.with_effect("viscous_drag", {"c1_per_s": 0.1}), NOISE),
        problem.filtered(replace(extension, base=extension.base._replace(alpha=0.1)), NOISE),
    ]
    assert all(np.any(other.innovations != pass_.innovations) for other in others)


def test_what_was_used_last_is_kept():
    computed, recent = [], Recent[bytes](30, len)
    for key in "abcadb":
        recent.get(key, lambda key=key: computed.append(key) or bytes(10))
    assert "".join(computed) == "abcdb"


def test_products_over_marked_rows_are_those_of_their_copy():
    rng = np.random.default_rng(0)
    left, right, rows = rng.normal(size=(50, 3, 4)), rng.normal(size=(50, 3, 2)), rng.random(50) < 0.6
    copied = left[rows].reshape(-1, 4).T @ right[rows].reshape(-1, 2)
    np.testing.assert_allclose(product(left, right, rows), copied, rtol=1e-12)


def test_the_products_of_columns_that_are_0_in_most_rows_are_those_of_all():
    rng, rows = np.random.default_rng(2), np.arange(700) % 90 < 70
    psi = rng.normal(size=(700, 3, 8)) * (np.abs(np.arange(700)[:, None, None] - 100 * np.arange(8)) < 60)
    copied = psi[rows].reshape(-1, 8)
    np.testing.assert_allclose(squared(psi, rows), copied.T @ copied, atol=1e-12)
    whole = np.ones(700, bool)
    np.testing.assert_allclose(squared(psi, whole), psi.reshape(-1, 8).T @ psi.reshape(-1, 8), atol=1e-12)


def test_what_the_nuisance_explains_is_left_out_of_the_sensitivities():
    rng = np.random.default_rng(1)
    psi, nuisance = rng.normal(size=(80, 3, 6)), rng.normal(size=(80, 3, 4))
    nuisance[:, :, 1], nuisance[:, :, 3] = 0.0, -2.0 * nuisance[:, :, 0]
    flat, other = psi.reshape(-1, 6), nuisance.reshape(-1, 4)
    left = flat - other @ np.linalg.lstsq(other, flat, rcond=1e-8)[0]
    np.testing.assert_allclose(projected(psi, nuisance), left, atol=1e-12)
    np.testing.assert_array_equal(projected(psi, np.zeros((80, 3, 2))), flat)
    np.testing.assert_array_equal(projected(psi, nuisance[:, :, :0]), flat)


def test_the_modes_of_a_long_log_are_as_right_in_longer_bins():
    log = synthesise("random", seed=4, duration_s=120.0, sensors=Sensors(rate_hz=50.0)).log
    extension, usual = Extension(base_of(log.robot)), SETTINGS
    long = replace(SETTINGS, begun=replace(SETTINGS.begun, long_s=60.0))
    seen = [identified_modes(log, extension, settings) for settings in (usual, long)]
    binned = [bin_log(log, SETTINGS, track) for track in (log.mode, *seen)]
    right = [np.mean(one.mode == binned[0].mode) for one in binned[1:]]
    assert np.median(np.diff(seen[1].t_ns)) > np.median(np.diff(seen[0].t_ns)) + 10**7
    assert right[1] > right[0] - 0.01
    assert right[0] > 0.8

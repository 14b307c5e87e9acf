"""Long logs: a diffusion that is searched on a part, and passes of the filter that are kept."""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.recent import Recent
from wmr_replay.gap.scan.score import product
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

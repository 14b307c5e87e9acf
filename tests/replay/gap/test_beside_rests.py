"""An effect beside everything that a calibrated base model may leave."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, made_fit, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.evidence import beside_rests as module
from wmr_replay.gap.evidence.beside_rests import beside_rests, rests_of, step_beside_rests
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.eliminate import may_be_rests
from wmr_replay.gap.settings.scan import MisfitSettings

OWN = MisfitSettings()
LITTLE = {"payload": 0.001, "drive_gain": 0.001, "yaw_inertia": 0.001, "viscous_drag": 0.001}


@pytest.fixture(scope="module")
def dragged():
    """60 s with a drag of .1 1/s."""
    return problem_of(made_log(4, drag_per_s=0.1, seconds=60.0))


def fitted(problem, misfit, name, start):
    return fit_model(problem, Extension(BASE, {name: start}, misfit=misfit))


def test_one_step_beside_the_rests_is_that_of_least_squares(dragged, monkeypatch):
    """Independent: the same least squares by an orthogonal decomposition, prior rows and all."""
    rng, n = np.random.default_rng(3), len(dragged.binned)
    extension = Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}, misfit=LITTLE)
    rests = rests_of(extension, OWN)
    psi, e = rng.normal(size=(n, 3, 1)), rng.normal(size=(n, 3))
    slopes = rng.normal(size=(n, 3, len(rests)))
    monkeypatch.setattr(module, "sensitivities", lambda *_: slopes)
    moved, _ = step_beside_rests(dragged, made_fit(dragged, extension, e, psi))
    seen = np.concatenate([psi, slopes], axis=2)[dragged.train].reshape(-1, 1 + len(rests))
    known = np.eye(1 + len(rests))[1:] * np.array([2 / rest.floor for rest in rests])[:, None]
    asked = np.concatenate([e[dragged.train].ravel(), np.zeros(len(rests))])
    step, *_ = np.linalg.lstsq(np.concatenate([seen, known]), asked, rcond=None)
    assert moved == pytest.approx(step[:1], abs=1e-6)


def test_rests_are_what_acts_always_but_for_the_models_own_effects():
    extension = Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}, misfit=LITTLE)
    names = {rest.name for rest in rests_of(extension, OWN)}
    assert {"payload", "drive_gain", "yaw_inertia", "scrub_torque", "torque_bias_common"} <= names
    assert not names & {"viscous_drag", "low_friction_patch", "slip_interval", "torque_deadzone"}
    assert rests_of(replace(extension, misfit={}), OWN) == ()


def test_what_a_drag_that_the_base_may_leave_explains_is_no_rolling_resistance(dragged):
    """A resistance that is fitted in place of a drag of .1 1/s: the base leaves one of up to .3 1/s."""
    name, key = "rolling_resistance", "c0_mps2"
    wrong = fitted(dragged, LITTLE | {"viscous_drag": 0.3}, name, {key: 0.05})
    assert wrong.extension.effects[name][key] > 0.03
    assert beside_rests(dragged, wrong, name).share < 0.1
    assert may_be_rests(dragged, wrong, name, alone=True)


def test_the_drag_itself_is_left_beside_the_rests(dragged):
    right = fitted(dragged, LITTLE, "viscous_drag", {"c1_per_s": 0.05})
    left = beside_rests(dragged, right, "viscous_drag")
    assert left.share == pytest.approx(1.0, abs=0.2)
    assert 0.0 < left.least < 0.1
    for alone in (True, False):
        assert not may_be_rests(dragged, right, "viscous_drag", alone=alone)


def test_beside_what_explains_more_an_effect_must_exceed_its_rest(dragged):
    """The drag is found as .1 1/s; a rest of it up to .3 1/s is no finding beside another effect."""
    known = fitted(dragged, LITTLE | {"viscous_drag": 0.3}, "viscous_drag", {"c1_per_s": 0.05})
    assert not may_be_rests(dragged, known, "viscous_drag", alone=True)
    assert may_be_rests(dragged, known, "viscous_drag", alone=False)


def test_a_base_that_was_not_calibrated_has_no_rests(dragged):
    plain = fitted(dragged, {}, "viscous_drag", {"c1_per_s": 0.05})
    assert not may_be_rests(dragged, plain, "viscous_drag", alone=False)

"""What a log shows clearly is said where the base model's doubts, or the path, keep it from being named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import ROBOT, SETTINGS, made_log

from wmr_replay.gap import GapOptions, analyse
from wmr_replay.gap.evidence.holdout import Proof
from wmr_replay.gap.result.in_doubt import disturbed, in_words, predicts_clearly
from wmr_replay.gap.search.eliminate import REST, UNPROVEN
from wmr_schemas.model_file import Model, NoiseModel

ROLLING = GapOptions(modes="ideal")
CLOSE = {"viscous_drag": 0.002, "wheel_viscous": 0.004, "rolling_resistance": 0.002}
FORM_OPEN = CLOSE | {"rolling_resistance": 0.12}
"""A resistance whose form the calibration log left open: on another drive it may be viscous."""
LEFT = CLOSE | {"viscous_drag": 0.2, "wheel_viscous": 0.4}
VISCOUS = "wheel_viscous (nm_per_radps 0.14 N·m/(rad/s)"


@pytest.mark.parametrize(
    ("misfit", "drag_per_s", "verdict"),
    [
        (CLOSE, 0.08, "ambiguous"),
        (FORM_OPEN, 0.08, "not_enough_excitation"),
        (FORM_OPEN, 0.0, "nothing_missing"),
        (LEFT, 0.08, "nothing_missing"),
    ],
)
def test_what_the_base_may_leave_on_this_drive_alone_is_said(misfit, drag_per_s, verdict):
    """Not as nothing missing, unless the calibration log left as much itself."""
    found = analyse(made_log(1, drag_per_s=drag_per_s), Model(ROBOT, misfit=misfit), ROLLING)
    assert found.verdict == verdict
    assert (VISCOUS.split(maxsplit=1)[0] in found.sentence) is (drag_per_s > 0 and misfit is not LEFT)
    if verdict == "not_enough_excitation":
        assert f"{VISCOUS}) would explain part of it" in found.sentence
        assert "the base model may leave as much" in found.sentence
        first = found.candidates[0]
        assert (first.stage, first.name, first.failed) == (0, "wheel_viscous", REST)
        assert first.score > 50


@pytest.mark.parametrize(("misfit", "least_per_s"), [(CLOSE, 0.032), (LEFT, 0.2)])
def test_no_size_that_the_base_may_leave_would_have_been_seen(misfit, least_per_s):
    """Four fifths of what is negligible, or what the calibration log left; the log alone shows less."""
    log = made_log(1)
    found, bare = (analyse(log, Model(ROBOT, misfit=one), ROLLING) for one in (misfit, {}))
    assert found.minimum_detectable["viscous_drag"].value == pytest.approx(least_per_s)
    assert bare.minimum_detectable["viscous_drag"].value < 0.03


def test_a_drag_that_moves_the_path_by_less_than_asked_is_not_said():
    log, base = made_log(1, drag_per_s=0.08), Model(ROBOT, misfit=FORM_OPEN)
    found = analyse(log, base, replace(ROLLING, tolerance_m=1.0))
    assert found.verdict == "nothing_missing"


@pytest.mark.parametrize(
    ("failed", "p_value", "gain", "clear"),
    [
        (UNPROVEN, 1e-12, 500.0, True),
        (UNPROVEN, 1e-2, 500.0, False),
        (UNPROVEN, 1e-12, 5.0, False),
        (REST, 1e-12, 500.0, False),
    ],
)
def test_what_predicts_far_better_is_said_though_the_path_comes_no_nearer(failed, p_value, gain, clear):
    none = np.zeros(0)
    proof = Proof(none, none, 0.0, p_value, holds=False)
    one = SimpleNamespace(name="input_delay", failed=failed, proof=proof, gain=gain)
    assert predicts_clearly(one, SETTINGS) is clear
    assert not predicts_clearly(SimpleNamespace(**{**vars(one), "name": "unnamed:yaw:v"}), SETTINGS)
    assert not predicts_clearly(SimpleNamespace(**{**vars(one), "proof": None}), SETTINGS)


def test_sizes_are_said_with_their_units():
    effects = {
        "input_delay": {"delay_s": 0.0512},
        "payload": {"mass_ratio": 0.1},
        "pose_lever_arm": {"y_m": 0.02, "x_m": -0.1},
        "aerodynamic_drag": {"c2_per_m": 0.2, "e2_per_m": 0.0},
    }
    fit = SimpleNamespace(extension=SimpleNamespace(effects=effects))
    said = [in_words(SimpleNamespace(name=name, fit=fit)) for name in effects]
    assert said == [
        "input_delay (delay_s 0.051 s)",
        "payload (mass_ratio 0.1)",
        "pose_lever_arm (x_m -0.1 m, y_m 0.02 m)",
        "aerodynamic_drag (c2_per_m 0.2 1/m)",
    ]


@pytest.mark.parametrize(
    ("ahead", "yaw", "said"),
    [(0.08, 0.01, "ahead 8 times"), (0.01, 0.3, "in turning 15 times"), (0.04, 0.09, ""), (None, 0.3, "")],
)
def test_what_disturbs_the_robot_many_times_over_is_said(ahead, yaw, said):
    """The calibration left .01 and, with casters that swing, .02; below .005 it counts as that."""
    noise = NoiseModel(
        disturbance_longitudinal_mps2_rthz=None if ahead is None else 0.01,
        disturbance_yaw_mps2_rthz=0.012,
        swing_yaw_mps2_rthz=0.016,
    )
    now = SimpleNamespace(densities_mps2_rthz=(ahead or 0.0, yaw), swings_mps2_rthz=(0.0, 0.0))
    selection = SimpleNamespace(base=SimpleNamespace(noise=now))
    base = SimpleNamespace(noise=noise, misfit=CLOSE)
    text = disturbed(selection, base, SETTINGS)
    assert said in text
    assert bool(text) is bool(said)
    assert disturbed(selection, SimpleNamespace(noise=noise, misfit={}), SETTINGS) == ""
    quiet = SimpleNamespace(noise=replace(noise, disturbance_longitudinal_mps2_rthz=0.0001), misfit=CLOSE)
    loud = max((ahead or 0.0) / SETTINGS.misfit.least_disturbance_mps2_rthz, yaw / 0.02) >= 5
    assert bool(disturbed(selection, quiet, SETTINGS)) is loud

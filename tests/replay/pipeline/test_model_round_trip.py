"""A model file with each effect of the catalogue: written, read, replayed, simulated and compared with a log.

The simulator's plant and the gap analysis's dynamics are separate code. The gap analysis's simulation must
agree with a noise-free log of the extended model, and differ from it without the effect.
"""

import numpy as np
import pytest

from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.path_error import window_errors, windows_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.settings import GateSettings
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import FOLLOWED, replay_model
from wmr_schemas.effects import effects_of
from wmr_schemas.model_file import Effect, Model, model_to_toml, read_model
from wmr_synth import Sensors, synthesise
from wmr_synth.driving.patrol import SMALL_ROBOT
from wmr_synth.hidden.world import model_world

SIZES = {
    "payload": {"mass_ratio": 0.4},
    "yaw_inertia": {"ratio": 0.4},
    "drive_gain": {"ratio": 0.3},
    "rolling_resistance": {"c0_mps2": 0.2},
    "viscous_drag": {"c1_per_s": 0.2},
    "aerodynamic_drag": {"c2_per_m": 0.2, "e2_per_m": 0.3},
    "scrub_torque": {"d0_mps2": 0.15},
    "yaw_damping": {"d1_per_s": 0.6},
    "wheel_coulomb": {"torque_nm": 0.3},
    "wheel_viscous": {"nm_per_radps": 0.03},
    "slope": {"grade_x_mps2": 0.3, "grade_y_mps2": -0.2},
    "torque_imbalance": {"ratio": 0.15},
    "torque_bias_common": {"bias_nm": 0.3},
    "torque_bias_differential": {"bias_nm": 0.2},
    "actuator_lag": {"time_constant_s": 0.2},
    "input_delay": {"delay_s": 0.15},
    "torque_deadzone": {"threshold_nm": 0.4},
    "torque_saturation": {"limit_nm": 1.0},
    "com_offset": {"offset_m": 0.02},
    "heading_misalignment": {"angle_rad": 0.08},
    "pose_lever_arm": {"x_m": 0.2, "y_m": -0.1},
    "cornering_stiffness": {"ratio": -0.4},
    "load_step": {"mass_ratio": 0.4, "t0_s": 8.0},
    "low_friction_patch": {"x_m": -0.25, "y_m": -3.27, "radius_m": 2.0, "loss": 0.5},
    "slip_interval": {"start_s": 8.0, "end_s": 14.0, "loss": 0.5},
    "undeclared_skid": {"stiffness_ratio": 0.7},
    "yaw_drift": {"rate_radps": 0.01},
    "swivel_friction": {"s0_mps2": 0.1},
    "support_friction": {"p0_mps2": 0.15, "d0_mps2": 0.2},
}
LEFT = {"undeclared_skid": 0.5, "cornering_stiffness": 0.4}
"""Share of the gap that may be left where it is more than a tenth: the onset of skids is smoothed."""
QUIET = Sensors(rate_hz=100.0, torque_rate_hz=100.0, noise_xy_sd_m=1e-6, noise_yaw_sd_rad=1e-6)
BASE = Model(robot=SMALL_ROBOT)


def test_every_effect_of_the_catalogue_is_tried():
    assert set(SIZES) == set(effects_of("torque"))


@pytest.fixture(params=SIZES)
def model(request, tmp_path):
    """The base robot with one effect, as read from a file."""
    made = Model(robot=SMALL_ROBOT, effects=(Effect(request.param, SIZES[request.param]),))
    path = tmp_path / "robot.model.toml"
    path.write_text(model_to_toml(made), encoding="utf-8")
    read = read_model(path)
    assert read == made
    return read


@pytest.fixture
def log(model):
    """What the simulator makes of the model."""
    seed, duration_s = (3, 60.0) if model.effects[0].name == "cornering_stiffness" else (4, 24.0)
    simulated = synthesise(
        "patrol",
        seed=seed,
        duration_s=duration_s,
        sensors=QUIET,
        robot=model.robot,
        world=model_world(model),
    )
    return simulated.log


def gap_m(log, model):
    """Root mean square gap of position over windows of 4 s."""
    binned = bin_log(log, GateSettings(), log.mode)
    extension = base_model(log, model, GapOptions()).extension
    windows = windows_of(binned, np.ones(len(binned), bool))
    errors = window_errors(binned, extension, windows)
    return float(np.sqrt(np.mean(errors.position_m**2)))


def test_simulator_and_gap_analysis_mean_the_same_effect(model, log):
    without, with_it = gap_m(log, BASE), gap_m(log, model)
    assert without > 1e-3
    assert with_it < LEFT.get(model.effects[0].name, 0.1) * without


def test_a_replay_applies_the_effect_or_says_that_it_leaves_it(model, log):
    name = model.effects[0].name
    made, plain = replay_model(model, SMALL_ROBOT), replay_model(BASE, SMALL_ROBOT)
    batch = as_batch(log)
    corrected = made.corrected(batch, int(log.pose.t_ns[0]))
    changed = [
        made.robot != plain.robot,
        not np.array_equal(made.terms.theta, plain.terms.theta),
        made.lag_s != plain.lag_s,
        not np.array_equal(corrected.pose.values, batch.pose.values),
        not np.array_equal(corrected.torque.values, batch.torque.values, equal_nan=True),
        not np.array_equal(corrected.torque.t_ns, batch.torque.t_ns),
    ]
    assert any(changed) != (name in FOLLOWED)
    assert [note for note in made.notes if name in note] == list(made.notes)
    assert bool(made.notes) == (name in FOLLOWED)

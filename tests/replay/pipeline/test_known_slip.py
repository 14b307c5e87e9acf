"""What a model knows beside the bank's states: lasting slip, resistances with both evidences, a delay."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from wmr_replay.align import SampleBatch
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.evidence import suits_both
from wmr_replay.pipeline.known_slip import KnownSlip
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import replay_model
from wmr_replay.pipeline.settings import Settings
from wmr_replay.tables import samples_frame
from wmr_schemas import RobotParameters
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.model_file import Effect, Model, Provenance
from wmr_synth import synthesise

ROBOT = RobotParameters(alpha=0.2, alpha_yaw=0.25, half_track_m=0.3, wheel_radius_m=0.1)
STEP_NS = 10_000_000


def rows_of(v_mps, w_mps, yaw_rad):
    """Rows at 100 Hz whose wheels turn at v ∓ w."""
    n = len(v_mps)
    wheels = np.stack([v_mps - w_mps, v_mps + w_mps]) / ROBOT.wheel_radius_m
    pose = np.stack([np.zeros(n), np.zeros(n), yaw_rad])
    inputs = np.concatenate([np.zeros((2, n)), wheels])
    return SampleBatch.measured(10**18 + np.arange(n) * STEP_NS, pose, inputs, np.zeros(n, np.int8))


@pytest.fixture
def drive():
    rng = np.random.default_rng(1)
    n = 300
    return rows_of(rng.uniform(0.2, 1.0, n), rng.uniform(-0.2, 0.2, n), np.linspace(0, 3, n))


def speeds(rows):
    left, right = rows.inputs[2:] * ROBOT.wheel_radius_m
    return (right + left) / 2, (right - left) / 2


def test_slip_in_turns_takes_its_share_of_the_speed(drive):
    v, w = speeds(drive)
    known = KnownSlip(ROBOT, [Effect("turning_slip", {"s_per_m": 0.4})])
    after, shift = known.push(drive)
    assert speeds(after)[0] == pytest.approx(v * (1 - 0.4 * np.abs(w)), abs=1e-12)
    assert speeds(after)[1] == pytest.approx(w, abs=1e-12)
    assert not shift.any()


def test_slip_downhill_moves_wheels_and_path(drive):
    known = KnownSlip(ROBOT, [Effect("slope_slip", {"x_mps": 0.05, "y_mps": -0.02})])
    after, shift = known.push(drive)
    yaw = drive.pose[2]
    ahead = speeds(after)[0] - speeds(drive)[0]
    assert ahead == pytest.approx(0.05 * np.cos(yaw) - 0.02 * np.sin(yaw), abs=1e-12)
    moved = np.cumsum(0.01 * ahead * np.stack([np.cos(yaw), np.sin(yaw)]), axis=1)
    both = (moved + shift)[:, -1] - (moved + shift)[:, 0]
    assert both == pytest.approx(np.array([0.05, -0.02]) * 0.01 * (len(yaw) - 1), abs=1e-12)


def test_wheels_that_stand_slide_nowhere():
    still = rows_of(np.zeros(50), np.zeros(50), np.zeros(50))
    after, shift = KnownSlip(ROBOT, [Effect("slope_slip", {"x_mps": 0.1, "y_mps": 0.1})]).push(still)
    assert not shift.any()
    assert np.array_equal(after.inputs, still.inputs)


def test_slip_by_acceleration_is_a_lag_of_the_speed():
    t = np.arange(400) * 0.01
    rows = rows_of(0.3 * t, np.zeros(400), np.zeros(400))
    after, _ = KnownSlip(ROBOT, [Effect("slip_ratio", {"seconds": 0.06})]).push(rows)
    settled = t > 1.0
    assert speeds(after)[0][settled] == pytest.approx(0.3 * t[settled] - 0.06 * 0.3, abs=2e-3)


def test_a_term_of_the_dictionary_is_added_to_its_velocity(drive):
    v, w = speeds(drive)
    effects = [
        Effect("unnamed:v_long:v*abs(v)", {"coefficient": -0.03}),
        Effect("unnamed:yaw_rate:v", {"coefficient": 0.02}),
    ]
    after, _ = KnownSlip(ROBOT, effects).push(drive)
    assert speeds(after)[0] == pytest.approx(v - 0.03 * v * np.abs(v), abs=1e-12)
    assert speeds(after)[1] == pytest.approx(w + 0.3 * 0.02 * v, abs=1e-12)


def test_a_term_of_the_acceleration_is_left_and_said():
    name = "unnamed:v_long:a*abs(v)"
    made = replay_model(Model(effects=(Effect(name, {"coefficient": 0.1}),)), ROBOT)
    assert made.notes == (f"{name} of the model is not applied by a replay",)
    assert not KnownSlip(ROBOT, made.effects).any


def test_any_batches_give_the_same_bits(drive):
    effects = [
        Effect("slope_slip", {"x_mps": 0.05, "y_mps": -0.02}),
        Effect("slip_ratio", {"seconds": 0.05}),
        Effect("unnamed:v_lat:v*yaw_rate", {"coefficient": 0.02}),
    ]
    whole, shift = KnownSlip(ROBOT, effects).push(drive)
    known = KnownSlip(ROBOT, effects)
    parts = [known.push(drive.part(slice(a, b))) for a, b in ((0, 1), (1, 77), (77, 78), (78, 300))]
    assert np.array_equal(np.concatenate([p.inputs for p, _ in parts], axis=1), whole.inputs)
    assert np.array_equal(np.concatenate([s for _, s in parts], axis=1), shift)


def test_a_delay_of_the_torques_leaves_the_wheel_speeds():
    t_ns = 10**18 + np.arange(5) * STEP_NS
    values = np.arange(20, dtype=float).reshape(4, 5)
    torque = Rows(t_ns, np.arange(5), values)
    made = replay_model(Model(effects=(Effect("input_delay", {"delay_s": 0.1}),)), ROBOT)
    after = made.corrected(RawBatch(Rows.empty(3), torque, Rows.empty(1)), int(t_ns[0]))
    assert np.array_equal(after.torque.t_ns, t_ns + 100_000_000)
    assert np.array_equal(after.torque.values[:2], values[:2])
    assert np.isnan(after.torque.values[2:]).all()
    assert np.array_equal(after.wheels.t_ns, t_ns)
    assert np.array_equal(after.wheels.values, values[2:])


def test_effects_on_commands_do_not_touch_the_torques():
    effects = (Effect("drive_gain", {"ratio": 0.2}), Effect("actuator_lag", {"time_constant_s": 0.1}))
    made = replay_model(Model(effects=effects, provenance=Provenance(base_model="wheel_speed")), ROBOT)
    assert (made.robot, made.lag_s) == (ROBOT, 0.0)
    assert len(made.notes) == 2
    assert all("acts on commands" in note for note in made.notes)
    assert replay_model(Model(effects=effects), ROBOT).lag_s == 0.1


def test_resistances_are_taken_off_the_efforts_and_both_evidences_stay():
    effects = (Effect("viscous_drag", {"c1_per_s": 0.3}), Effect("yaw_damping", {"d1_per_s": 0.5}))
    made = replay_model(Model(effects=effects), ROBOT)
    left, right = 0.8 - 0.06, 0.8 + 0.06
    wheels = np.array([[left], [right]]) / ROBOT.wheel_radius_m
    after = made.less_resistance(np.array([[2.0], [2.5]]), wheels, np.zeros(1))
    lost = ROBOT.alpha * (4.5 - after.sum()), ROBOT.alpha_yaw * (0.5 - (after[1, 0] - after[0, 0]))
    assert lost == pytest.approx((0.3 * 0.8, 0.5 * 0.06), abs=1e-12)
    assert suits_both(made)
    assert not suits_both(replay_model(Model(effects=effects), replace(ROBOT, alpha=None)))


def test_a_prefix_of_the_log_gives_a_prefix_of_the_rows():
    log = synthesise("encoders", seed=3, duration_s=8.0, torques_as="together").log
    effects = (
        Effect("input_delay", {"delay_s": 0.12}),
        Effect("actuator_lag", {"time_constant_s": 0.08}),
        Effect("viscous_drag", {"c1_per_s": 0.2}),
        Effect("slope_slip", {"x_mps": 0.03, "y_mps": 0.02}),
        Effect("slip_ratio", {"seconds": 0.05}),
    )
    batch, model = as_batch(log), replay_model(Model(effects=effects), log.robot)
    whole = rows(batch, model)
    end_ns = int(log.pose.t_ns[0]) + 5_000_000_000
    parts = (cut(part, end_ns) for part in (batch.pose, batch.torque, batch.mode))
    prefix = rows(RawBatch(*parts, wheels=cut(batch.wheels, end_ns)), model)
    assert len(prefix) > 400
    assert whole.head(len(prefix)).equals(prefix)


def rows(batch, model):
    """The samples of a batch."""
    engine = Engine(Settings(hindsight=False), model)
    found = pl.concat([samples_frame(c) for c in (*engine.push(batch), *engine.finish())])
    assert engine.told_by == "both"
    return found


def cut(part, end_ns):
    """The rows before a stamp."""
    kept = part.t_ns < end_ns
    return Rows(part.t_ns[kept], part.order[kept], part.values[:, kept])

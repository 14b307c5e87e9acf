"""A model file's effects in a replay: logs with each effect in closed form, analysed with and without it."""

import numpy as np
import polars as pl
import pytest

from wmr_replay.align import Lag
from wmr_replay.identify.terms import Moving, extra_accelerations
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import change_pose, change_torque, replay_model
from wmr_replay.pipeline.settings import Settings
from wmr_replay.tables import samples_frame
from wmr_schemas import RobotParameters
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.errors import InvalidSetting, InvalidTerm
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.terms import CHANNELS, COLUMNS, FACTORS, parse_term

ALPHA, RATE_HZ, SECONDS = 0.02, 100, 20.0
ROBOT = RobotParameters(alpha=ALPHA, half_track_m=0.5, wheel_radius_m=0.1)


def model(name, **parameters):
    return Model(effects=(Effect(name, parameters),))


def straight(acceleration, effort, seed=0, sd=1e-3, heading=0.4):
    """Rows of a straight drive x'' = acceleration(t, v), integrated finely, and of its efforts."""
    n, fine = int(SECONDS * RATE_HZ), 50
    t = np.arange(n) / RATE_HZ
    x, v = np.empty(n), 1.0
    place = 0.0
    for k in range(n):
        x[k] = place
        for j in range(fine):
            h = 1 / RATE_HZ / fine
            a = acceleration(t[k] + j * h, v)
            place += v * h + a * h * h / 2
            v += a * h
    rng = np.random.default_rng(seed)
    pose = (
        np.stack([x * np.cos(heading), x * np.sin(heading), np.full(n, heading)])
        + rng.normal(size=(3, n)) * sd
    )
    t_ns = 10**18 + np.round(t * 1e9).astype(np.int64)
    efforts = np.stack([effort(t) / 2, effort(t) / 2, np.full(n, np.nan), np.full(n, np.nan)])
    order = np.arange(n)
    none = Rows.empty(1)
    return RawBatch(Rows(t_ns, 2 * order, pose), Rows(t_ns, 2 * order + 1, efforts), none)


def steps(t):
    """Efforts that change every 2 s."""
    return np.where(np.floor(np.asarray(t) / 2) % 2 == 0, 30.0, -5.0)


def replayed(batch, with_model):
    engine = Engine(Settings(window_s=0.5, identifier="paper"), replay_model(with_model, ROBOT))
    columns = [*engine.push(batch), *engine.finish()]
    return pl.concat([samples_frame(c) for c in columns]).drop_nulls("c_d_mps2")


SLOPE = 0.3 * np.cos(0.4) + 0.2 * np.sin(0.4)
CASES = {
    "viscous_drag": ({"c1_per_s": 0.15}, lambda t, v: ALPHA * steps(t) - 0.15 * v),
    "aerodynamic_drag": ({"c2_per_m": 0.05}, lambda t, v: ALPHA * steps(t) - 0.05 * v * abs(v)),
    "rolling_resistance": ({"c0_mps2": 0.2}, lambda t, v: ALPHA * steps(t) - 0.2 * np.sign(v)),
    "slope": ({"grade_x_mps2": 0.3, "grade_y_mps2": 0.2}, lambda t, v: ALPHA * steps(t) + SLOPE),
    "wheel_coulomb": ({"torque_nm": 4.0}, lambda t, v: ALPHA * (steps(t) - 8.0 * np.sign(v))),
    "wheel_viscous": ({"nm_per_radps": 0.2}, lambda t, v: ALPHA * (steps(t) - 2 * 0.2 * v / 0.1)),
    "unnamed:longitudinal:v*abs(v)*v": (
        {"coefficient": -0.02},
        lambda t, v: ALPHA * steps(t) - 0.02 * v**2 * abs(v),
    ),
    "unnamed:longitudinal:effort_sum*cos(yaw)": (
        {"coefficient": -0.01},
        lambda t, v: (ALPHA - 0.01 * np.cos(0.4)) * steps(t),
    ),
    "unnamed:longitudinal:effort_sum*t": (
        {"coefficient": -0.0005},
        lambda t, v: (ALPHA - 0.0005 * t) * steps(t),
    ),
    "unnamed:longitudinal:t*cos(yaw)": (
        {"coefficient": 0.02},
        lambda t, v: ALPHA * steps(t) + 0.02 * t * np.cos(0.4),
    ),
    "payload": ({"mass_ratio": 0.5}, lambda t, v: ALPHA / 1.5 * steps(t)),
    "drive_gain": ({"ratio": -0.3}, lambda t, v: 0.7 * ALPHA * steps(t)),
    "torque_bias_common": ({"bias_nm": -4.0}, lambda t, v: ALPHA * (steps(t) - 8.0)),
    "torque_deadzone": ({"threshold_nm": 2.0}, lambda t, v: ALPHA * (steps(t) - 4.0 * np.sign(steps(t)))),
    "torque_saturation": ({"limit_nm": 9.0}, lambda t, v: ALPHA * min(steps(t), 18.0)),
    "input_delay": ({"delay_s": 0.4}, lambda t, v: ALPHA * (steps(t - 0.4) if t >= 0.4 else 30.0)),
}


@pytest.mark.parametrize("name", CASES)
def test_a_known_effect_is_taken_out_of_c_d(name):
    parameters, acceleration = CASES[name]
    batch = straight(acceleration, steps)
    without, with_effect = replayed(batch, Model()), replayed(batch, model(name, **parameters))
    residual, before = (frame["c_d_mps2"].abs().mean() for frame in (with_effect, without))
    assert residual < 0.02
    assert residual < 0.4 * before


@pytest.mark.parametrize(("over_mps", "share"), [(0.005, np.tanh(1.0)), (None, np.tanh(0.25))])
def test_a_friction_changes_its_sign_over_the_speed_of_the_file(over_mps, share):
    friction = Effect("rolling_resistance", {"c0_mps2": 0.2}, sign_change_mps=over_mps)
    terms = replay_model(Model(effects=(friction,)), ROBOT).terms
    creeping = Moving(*(0.005 if name == "v" else 0.0 for name in COLUMNS))
    ahead, _, _ = extra_accelerations(creeping, 1.0, 1.0, terms)
    assert ahead == pytest.approx(-0.2 * share)


@pytest.mark.parametrize(("load", "ratio"), [(0.0, 0.0), (0.0, 0.25), (0.4, 0.0), (0.4, 0.25)])
def test_an_arm_of_the_centre_of_mass_turns_more_by_a_load_and_less_by_a_larger_inertia(load, ratio):
    """As the gap analysis has it: −(α_yaw/(α l)) d v·yaw_rate (1 + load)/(1 + ratio)."""
    robot = RobotParameters(alpha=ALPHA, alpha_yaw=0.03, half_track_m=0.5, wheel_radius_m=0.1)
    arm, inertia = Effect("com_offset", {"offset_m": 0.04}), Effect("yaw_inertia", {"ratio": ratio})
    terms = replay_model(Model(effects=(arm, inertia, Effect("payload", {"mass_ratio": load}))), robot).terms
    bend = Moving(*({"v": 0.8, "yaw_rate": 0.5}.get(name, 0.0) for name in COLUMNS))
    ahead, _, turning = extra_accelerations(bend, 1.0, 1.0, terms)
    assert ahead == pytest.approx(0.04 * 0.5**2)
    assert 0.5 * turning == pytest.approx(-0.03 / (ALPHA * 0.5) * 0.04 * 0.8 * 0.5 * (1 + load) / (1 + ratio))


def test_products_are_what_the_dictionary_says():
    rng = np.random.default_rng(0)
    names = [
        f"unnamed:{channel}:{product}"
        for channel in CHANNELS
        for product in (*FACTORS, "v*yaw_rate*abs(effort_sum)", "sin(yaw)*cos(yaw)")
    ]
    for name in names:
        term, row = parse_term(name), rng.normal(size=6)
        terms = replay_model(model(name, coefficient=0.3), ROBOT).terms
        ahead, aside, turning = extra_accelerations(Moving(*row), 1.0, 1.0, terms)
        value = 0.3 * term.evaluate({c: row[k : k + 1] for k, c in enumerate(COLUMNS)})[0]
        wanted = dict.fromkeys(CHANNELS, 0.0) | {term.channel: value}
        found = dict(zip(CHANNELS, (ahead, aside, ROBOT.half_track_m * turning), strict=True))
        assert found == pytest.approx(wanted, abs=1e-12), name


def test_a_term_over_the_way_is_left_out_and_said():
    made = replay_model(model("unnamed:longitudinal:sin(2s)", coefficient=0.1), ROBOT)
    assert made.notes == ("unnamed:longitudinal:sin(2s) of the model is not applied by a replay",)
    assert not made.accelerates


def test_terms_that_read_time_or_place_are_added_by_channel():
    made = replay_model(
        Model(
            effects=(
                Effect("unnamed:longitudinal:sin(2x)*effort_sum", {"coefficient": 0.5}),
                Effect("unnamed:yaw:t*v", {"coefficient": 0.1}),
            )
        ),
        ROBOT,
    )
    names = ("t_s", "x_m", "y_m", "yaw_rad", "v_mps", "v_lat_mps", "yaw_rate_radps", "left_nm", "right_nm")
    at = dict(zip(names, np.array([3.0, 0.25, 1.0, 0.3, 2.0, 0.0, 0.1, 4.0, 6.0])[:, None], strict=True))
    wanted = [0.5 * np.sin(0.5) * 10.0, 0.1 * 3.0 * 2.0]
    assert made.accelerates
    assert made.own_accelerations(at)[:, 0] == pytest.approx(wanted)
    at["v_mps"] = np.array([np.nan])
    assert made.own_accelerations(at)[1, 0] == 0.0


def test_a_lag_acts_on_the_torques_as_its_closed_form():
    time_constant_s = 0.3
    t_ns = np.arange(0, 200) * 10_000_000
    u = np.where(np.arange(200) >= 100, 1.0, 0.0)
    lag = Lag(time_constant_s, 1)
    parts = [lag.push(t_ns[a:b], u[None, a:b]) for a, b in ((0, 7), (7, 120), (120, 200))]
    y = np.concatenate(parts, axis=1)[0]
    since = (np.arange(200) - 99) * 0.01
    edges = np.where(since > 0, 1 - np.exp(-np.maximum(since, 0) / time_constant_s), 0.0)
    mean = 1 - time_constant_s / 0.01 * (
        np.exp(-np.maximum(since - 0.01, 0) / 0.3) - np.exp(-np.maximum(since, 0) / 0.3)
    )
    assert np.abs(y[100:] - mean[100:]).max() < 1e-12
    assert (np.diff(y[100:]) > 0).all()
    assert np.abs(y - edges).max() < 0.04


def test_wheels_are_told_apart():
    rows = Rows(np.array([0]), np.array([0]), np.array([[10.0], [20.0], [1.0], [2.0]]))
    imbalanced = change_torque(rows, model("torque_imbalance", ratio=0.1).effects).values
    assert imbalanced[:, 0] == pytest.approx([9.0, 22.0, 1.0, 2.0])
    biased = change_torque(rows, model("torque_bias_differential", bias_nm=3.0).effects).values
    assert biased[:, 0] == pytest.approx([7.0, 23.0, 1.0, 2.0])


def test_the_measured_pose_is_brought_back_to_the_axle():
    rows = Rows(np.array([5 * 10**9]), np.array([0]), np.array([[1.0], [2.0], [np.pi / 2 + 0.13]]))
    effects = (
        Effect("heading_misalignment", {"angle_rad": 0.1}),
        Effect("yaw_drift", {"rate_radps": 0.01}),
        Effect("pose_lever_arm", {"x_m": 0.5, "y_m": 0.2}),
    )
    assert change_pose(rows, effects, 2 * 10**9).values[:, 0] == pytest.approx([1.2, 1.5, np.pi / 2])


def test_what_happens_in_time_or_space_is_left_to_the_identifier_and_said():
    made = replay_model(model("slip_interval", start_s=1.0, end_s=2.0, loss=0.5), ROBOT)
    assert made.notes == ("slip_interval of the model is left to the identifier",)


def test_an_effect_that_cannot_be_applied_is_refused_by_name():
    with pytest.raises(InvalidTerm, match="unnamed:longitudinal:v3: no factor 'v3'"):
        replay_model(model("unnamed:longitudinal:v3", coefficient=1.0), ROBOT)
    with pytest.raises(InvalidSetting, match="unnamed:yaw:v needs the robot's half_track_m"):
        replay_model(model("unnamed:yaw:v", coefficient=1.0), RobotParameters(alpha=1.0))
    with pytest.raises(InvalidSetting, match="wheel_viscous needs the robot's wheel_radius_m"):
        replay_model(model("wheel_viscous", nm_per_radps=1.0), RobotParameters(alpha=1.0))


def test_parameters_of_the_model_stand_over_the_logs():
    made = replay_model(Model(robot=RobotParameters(alpha=0.05)), ROBOT)
    assert made.robot == RobotParameters(alpha=0.05, half_track_m=0.5, wheel_radius_m=0.1)


@pytest.mark.parametrize(
    ("product", "by_hand"),
    [
        ("v*fall(v,0.3)", 0.6 / 3.0),
        ("effort_sum*over(effort_sum,4)", 10.0 - 4.0),
        ("gust(5,2)*cos(2yaw)", np.exp(-0.5) * np.cos(0.8)),
    ],
)
def test_a_term_with_numbers_accelerates_a_replay(product, by_hand):
    found = replay_model(model(f"unnamed:longitudinal:{product}", coefficient=0.5), ROBOT)
    at = {"t_s": 7.0, "x_m": 0.0, "y_m": 0.0, "yaw_rad": 0.4, "v_mps": 0.6, "v_lat_mps": 0.0}
    at |= {"yaw_rate_radps": 0.1, "left_nm": 4.0, "right_nm": 6.0}
    columns = {name: np.array([value]) for name, value in at.items()}
    assert found.accelerates
    assert not found.terms.any
    np.testing.assert_allclose(found.own_accelerations(columns), [[0.5 * by_hand], [0.0]])

"""Hidden effects from the command line to the side files, and the scenarios that show them."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from mcap.reader import make_reader

from wmr_schemas.effects import BEYOND, catalogue, declared, effects_of
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.messages import MODE_TOPIC
from wmr_schemas.model_file import Effect, Model, NoiseModel, model_to_toml
from wmr_schemas.robot import RobotParameters
from wmr_synth import hidden_log, synthesise
from wmr_synth.driving.patrol import SMALL_ROBOT, drawn_robot
from wmr_synth.hidden import World, draw_effect, parse_hide, words_of
from wmr_synth.hidden.measurement import MEASURED
from wmr_synth.hidden.parameters import CHANGES
from wmr_synth.hidden.registry import WORDS
from wmr_synth.sensors import Sensors

EFFECTS = effects_of("torque")
EVERY = list(EFFECTS | BEYOND)


def metadata(path) -> dict[str, str]:
    with path.open("rb") as file:
        return {record.name: record.metadata for record in make_reader(file).iter_metadata()}["wmr_replay"]


def test_every_effect_of_the_catalogue_can_be_hidden_and_has_ranges():
    assert set(EVERY) == set(CHANGES) | set(MEASURED)
    assert set(WORDS) < set(EVERY)
    assert all(effect.ranges for effect in (EFFECTS | BEYOND).values())
    assert not set(EFFECTS) & set(BEYOND)


@pytest.mark.parametrize("name", EVERY)
def test_every_effect_moves_the_measured_pose_and_keeps_the_nominal_robot(name):
    log, facts = hidden_log("patrol", 3, hide=[name], duration_s=40.0)
    base, _ = hidden_log("patrol", 3, duration_s=40.0)
    moved = np.hypot(log.pose.x_m - base.pose.x_m, log.pose.y_m - base.pose.y_m)
    turned = np.abs(log.pose.yaw_rad - base.pose.yaw_rad)
    assert moved.max() > 0.005 or turned.max() > 0.01
    assert log.robot == SMALL_ROBOT
    (found,) = facts["effects"]
    assert found["name"] == name
    known = (EFFECTS | BEYOND)[name]
    assert set(found["parameters"]) == known.parameters.keys() - known.absent.keys()
    assert np.all(np.isfinite(list(found["parameters"].values())))
    assert found["form"] == words_of(name)


@pytest.mark.parametrize("name", EVERY)
def test_drawn_sizes_lie_in_their_ranges(name):
    for seed in range(20):
        effect = draw_effect(name, {}, np.random.default_rng(seed), SMALL_ROBOT, 90.0)
        for key, within in declared(name).ranges.items():
            if within.scale or declared(name).vector:
                continue
            low = -within.high if within.signed else within.low
            assert low <= effect.parameters[key] <= within.high


def test_a_vector_effect_has_its_size_in_any_direction():
    grades = [
        draw_effect("slope", {}, np.random.default_rng(seed), SMALL_ROBOT, 90.0).parameters
        for seed in range(50)
    ]
    size = np.array([np.hypot(g["grade_x_mps2"], g["grade_y_mps2"]) for g in grades])
    assert 0.1 <= size.min() <= size.max() <= 0.5
    assert {np.sign(g["grade_x_mps2"]) for g in grades} == {-1, 1}
    only_x = draw_effect("slope", {"grade_x_mps2": 0.2}, np.random.default_rng(0), SMALL_ROBOT, 90.0)
    assert only_x.parameters == {"grade_x_mps2": 0.2, "grade_y_mps2": 0.0}


def test_a_drawn_patch_lies_on_the_path():
    log, facts = hidden_log("patrol", 5, hide=["low_friction_patch"])
    p = facts["effects"][0]["parameters"]
    assert np.hypot(log.pose.x_m - p["x_m"], log.pose.y_m - p["y_m"]).min() < p["radius_m"]


def test_an_effects_size_does_not_depend_on_the_others():
    alone = hidden_log("cruise", 4, hide=["payload"], duration_s=2.0)[1]["effects"]
    among = hidden_log("cruise", 4, hide=["slope", "payload"], duration_s=2.0)[1]["effects"]
    assert among[1] == alone[0]


def test_patrol_excites_and_cruise_hardly_does():
    patrol, cruise = (synthesise(name, seed=2).truth for name in ("patrol", "cruise"))
    assert patrol.v_long_mps.min() < -0.3
    assert 1.0 < patrol.v_long_mps.max() < 2.3
    assert 0.5 < np.abs(patrol.yaw_rate_radps).max() < 1.5
    assert set(patrol.mode.tolist()) == {0, 1, 2}
    assert 0.5 < np.mean(patrol.mode == 0) < 0.95
    assert np.ptp(cruise.v_long_mps) < 0.25
    assert np.abs(cruise.yaw_rate_radps).max() < 0.1
    assert set(cruise.mode.tolist()) == {0}


def test_drawn_robots_weigh_20_to_50_kg_and_are_rigid_bodies():
    for seed in range(30):
        r = drawn_robot(np.random.default_rng(seed))
        assert 20 <= r.mass_kg <= 50
        wheels = 2 * r.wheel_inertia_kgm2 / r.wheel_radius_m**2
        assert r.alpha * r.wheel_radius_m * (r.mass_kg + wheels) == pytest.approx(1)
        yaw = r.yaw_inertia_kgm2 + r.half_track_m**2 * wheels
        assert r.alpha_yaw * r.wheel_radius_m * yaw == pytest.approx(r.half_track_m**2)


def test_the_truth_stands_in_the_side_file_alone(synth, tmp_path):
    path = tmp_path / "drag.mcap"
    options = ("--hide", "viscous_drag:c1_per_s=0.1234567", "--no-truth-topic", "--noise", "rtk")
    code, _, err = synth("patrol", "--duration", "5", "--out", path, *options)
    assert (code, err) == (0, "")
    facts = json.loads((tmp_path / "drag.truth.json").read_text())
    assert facts["effects"] == [
        {"name": "viscous_drag", "parameters": {"c1_per_s": 0.1234567}, "form": "as its candidate"}
    ]
    assert facts["sensors"]["noise_xy_sd_m"] == 0.01
    assert (tmp_path / "drag.truth.parquet").exists()
    assert metadata(path) == SMALL_ROBOT.to_metadata()
    assert b"1234567" not in path.read_bytes()
    assert b"viscous" not in path.read_bytes()
    with path.open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert topics == {"/pose", "/wheel_torques"}
    assert MODE_TOPIC not in topics


def test_the_same_seed_gives_the_same_bytes_in_two_processes(tmp_path):
    options = "patrol --hide slope --hide actuator_lag --seed 8 --duration 4 --wrong-modes 0.02".split()
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        command = [sys.executable, "-c", "from wmr_replay.cli import main; main()", "synth", *options]
        out = str(tmp_path / name / "x.mcap")
        subprocess.run([*command, "--out", out], check=True, env=dict(os.environ), capture_output=True)
    for file in ("x.mcap", "x.truth.json", "x.truth.parquet"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_a_model_file_is_simulated_in_the_candidates_form(synth, tmp_path):
    model = Model(
        robot=SMALL_ROBOT,
        noise=NoiseModel(position_sd_m=0.003, yaw_sd_rad=0.004, disturbance_yaw_mps2_rthz=0.002),
        effects=(Effect("aerodynamic_drag", {"c2_per_m": 0.2}),),
    )
    (tmp_path / "m.toml").write_text(model_to_toml(model))
    path = tmp_path / "x.mcap"
    code, _, err = synth("cruise", "--model", tmp_path / "m.toml", "--duration", "3", "--out", path)
    assert (code, err) == (0, "")
    facts = json.loads((tmp_path / "x.truth.json").read_text())
    assert facts["effects"][0]["form"] == EFFECTS["aerodynamic_drag"].formula
    assert (facts["sensors"]["noise_xy_sd_m"], facts["sensors"]["noise_yaw_sd_rad"]) == (0.003, 0.004)
    assert facts["disturbance"]["white_mps2_rthz"] == [0.0, 0.0, 0.002]
    assert metadata(path) == SMALL_ROBOT.to_metadata()


def test_robot_fills_in_what_a_model_lacks(synth, tmp_path):
    (tmp_path / "m.toml").write_text(model_to_toml(Model(robot=RobotParameters(alpha=0.3))))
    (tmp_path / "r.toml").write_text(model_to_toml(Model(robot=SMALL_ROBOT)))
    arguments = ("cruise", "--model", tmp_path / "m.toml", "--duration", "1", "--out", tmp_path / "x.mcap")
    code, _, err = synth(*arguments)
    assert code == 2
    assert "half_track_m" in err
    assert synth(*arguments, "--robot", tmp_path / "r.toml")[0] == 0
    assert metadata(tmp_path / "x.mcap") == SMALL_ROBOT.to_metadata() | {"alpha": "0.3"}


def test_wrong_labels_have_their_share_and_leave_the_truth_alone():
    log, facts = hidden_log("patrol", 1, wrong_modes=0.02)
    right = synthesise("patrol", seed=1)
    labels = log.mode.mode[np.searchsorted(log.mode.t_ns, log.pose.t_ns, side="right") - 1]
    assert np.mean(labels != right.truth.mode) == pytest.approx(0.02, abs=0.006)
    assert facts["modes"] == right.facts["modes"]
    assert facts["wrong_modes"] == 0.02
    assert np.array_equal(log.pose.x_m, right.log.pose.x_m)


def test_a_scenario_without_disturbance_keeps_its_bytes_when_none_is_asked_for():
    plain = synthesise("figure-eight", duration_s=5)
    asked = synthesise("figure-eight", duration_s=5, world=World())
    assert np.array_equal(plain.log.pose.x_m, asked.log.pose.x_m)
    assert plain.facts == asked.facts
    assert "disturbance" not in plain.facts


def test_existing_open_loop_scenarios_take_hidden_effects(synth, tmp_path):
    path = tmp_path / "x.mcap"
    options = ("--hide", "viscous_drag:c1_per_s=0.1", "--rate", "50", "--noise-variance", "0")
    assert synth("paper-alpha-ideal", "--out", path, *options)[0] == 0
    log = synthesise("paper-alpha-ideal", sensors=Sensors(50.0, 100.0, 0.0, 0.0), world=World()).truth
    slowed = synthesise(
        "paper-alpha-ideal",
        sensors=Sensors(50.0, 100.0, 0.0, 0.0),
        world=World((Effect("viscous_drag", {"c1_per_s": 0.1}),)),
    ).truth
    drive = log.a_long_mps2[0]
    expected = drive / 0.1 + (2.0 - drive / 0.1) * np.exp(-0.1 * slowed.t_ns / 1e9)
    assert slowed.v_long_mps == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--hide", "viscous"), "viscous_drag"),
        (("--hide", "viscous_drag:c2=1"), "c1_per_s"),
        (("--hide", "viscous_drag:c1_per_s=x"), "must be a number"),
        (("--hide", "payload:mass_ratio=-1"), "above −1"),
        (("--hide", "torque_saturation:limit_nm=0"), "above 0"),
        (("--hide", "slip_interval:loss=1"), "[0, 1)"),
        (("--hide", "slip_interval:start_s=3,end_s=2"), "come after"),
        (("--hide", "input_delay:delay_s=-0.1"), "not be negative"),
        (("--hide", "payload", "--hide", "payload"), "twice"),
        (("--hide", "payload", "--model", "m.toml"), "give one"),
        (("--disturbance", "much"), "SD:TAU"),
        (("--disturbance", "0.1:0"), "above 0"),
        (("--noise", "rtk", "--noise-variance", "1"), "--noise-variance"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error_and_writes_nothing(synth, tmp_path, arguments, says):
    code, _, err = synth("patrol", "--duration", "1", "--out", tmp_path / "x.mcap", *arguments)
    assert code == 2
    assert says in err
    assert list(tmp_path.iterdir()) == []


def test_limited_traction_takes_no_hidden_effect():
    with pytest.raises(InvalidSetting, match="traction-limited"):
        hidden_log("random-traction-limited", 0, hide=["payload"], duration_s=1.0)


def test_parameters_are_read_as_given():
    assert parse_hide("load_step:mass_ratio=.3,t0_s=20") == ("load_step", {"mass_ratio": 0.3, "t0_s": 20.0})
    assert parse_hide("payload") == ("payload", {})


def test_the_list_of_effects_names_every_one(synth):
    code, out, _ = synth("--list-effects", "--json")
    assert code == 0
    assert [row["name"] for row in json.loads(out)] == [*catalogue(), *BEYOND]
    code, out, _ = synth("--list-effects")
    assert code == 0
    assert all(name in out for name in EVERY)


def test_a_parameter_of_wheel_speeds_alone_is_refused_where_torques_drive():
    hide = "slip_interval:start_s=5,end_s=8,loss=.3,loss_apart=.2"
    with pytest.raises(InvalidSetting, match="slip_interval has loss_apart only where wheel speeds"):
        hidden_log("patrol", 3, hide=[hide], duration_s=20.0)
    log, _ = hidden_log("skid-steer", 3, hide=[hide], duration_s=20.0)
    assert log.wheels is not None
    with pytest.raises(InvalidSetting, match=r"loss_apart must lie in \(−1, 1\)"):
        hidden_log("skid-steer", 3, hide=[hide.replace("apart=.2", "apart=2")], duration_s=20.0)

"""``export --to mjcf``: an engine that loads the exported parameters comes closer to the log; what has no
counterpart is listed.
"""

import importlib
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from wmr_replay.api.export import export
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.model_file import Effect, Model, Provenance
from wmr_schemas.robot import RobotParameters

BENCH = Path(__file__).parents[3] / "bench"
COURIER = BENCH / "engine" / "robots" / "courier.xml"
ROBOT = RobotParameters(alpha=1.35, wheel_radius_m=0.07, half_track_m=0.15)
EFFECTS = {
    "payload": "payload",
    "friction_loss": "wheel_coulomb",
    "joint_damping": "wheel_viscous",
    "tilted_gravity": "slope",
    "gear": "drive_gain",
    "gear_imbalance": "torque_imbalance",
    "bias_common": "torque_bias_common",
    "bias_differential": "torque_bias_differential",
    "activation": "actuator_lag",
    "delay": "input_delay",
    "force_range": "torque_saturation",
}
"""The engine's mechanism, and the effect that gap names for it."""


def model_of(*effects, **provenance):
    found = tuple(Effect(*effect) for effect in effects)
    return Model(ROBOT, effects=found, provenance=Provenance(**provenance))


def into(model, path=COURIER, **options):
    return ET.fromstring(export(model, to="mjcf", into=path, **options))


def hidden_model(engine, mechanism, sizes):
    """The model that gap would write, had it found the engine's own numbers."""
    robot = engine("robot").robot_of("courier")
    known = RobotParameters(alpha=robot.alpha, wheel_radius_m=robot.wheel_radius_m)
    parameters = {key: value for key, value in sizes.items() if key != "c1_per_s"}
    return Model(known, effects=(Effect(EFFECTS[mechanism], parameters),))


@pytest.mark.parametrize("mechanism", EFFECTS)
def test_the_engines_own_gap_shrinks_with_the_exported_values(engine, mechanism):
    case = engine("case").Case("courier", "stop-go", "mocap", mechanism, 3, 14.0)
    logged, own_gap_m = engine("logs").logged(case), engine("own_gap").own_gap_m
    text = export(hidden_model(engine, mechanism, logged.hidden.sizes), to="mjcf", into=COURIER)
    before = own_gap_m(engine("robot").spec_of("courier"), logged.motion)
    after = own_gap_m(importlib.import_module("mujoco").MjSpec.from_string(text), logged.motion)
    assert before > 0.05
    assert after < 0.2 * before


def test_wheel_radius_and_separation_are_those_of_the_calibration():
    found = into(
        model_of(
            ("wheel_scale", {"ratio": 0.02}),
            ("wheel_scale_difference", {"ratio": 0.01}),
            ("effective_track", {"ratio": 0.1}),
        )
    )
    bodies = {body.get("name"): body for body in found.iter("body")}
    left, right = (bodies[f"{side} wheel"].find("geom").get("size").split() for side in ("left", "right"))
    assert [float(x) for x in left] == pytest.approx([0.07 * 1.02 * 0.99] * 2 + [0.018])
    assert [float(x) for x in right] == pytest.approx([0.07 * 1.02 * 1.01] * 2 + [0.018])
    assert float(bodies["left wheel"].get("pos").split()[1]) == pytest.approx(0.165)


def test_resistance_ahead_becomes_friction_of_both_wheels():
    # F = m a with m = 1/(r α) is shared by two wheels: torque r F/2 = a/(2α)
    found = into(
        model_of(
            ("rolling_resistance", {"c0_mps2": 0.2}),
            ("viscous_drag", {"c1_per_s": 0.3}),
            ("aerodynamic_drag", {"c2_per_m": 0.1}),
        )
    )
    for joint in (j for j in found.iter("joint") if j.get("name") in ("left", "right")):
        assert float(joint.get("frictionloss")) == pytest.approx(0.1 / 1.35)
        first, second = map(float, joint.get("damping").split())
        assert first == pytest.approx(0.15 * 0.07 / 1.35)
        assert second == pytest.approx(0.05 * 0.07**2 / 1.35)


def test_values_of_a_default_class_are_added_to(tmp_path):
    robot = tmp_path / "robot.xml"
    robot.write_text(
        """<mujoco><default><joint damping="1"/><default class="drive"><joint frictionloss=".5"/>
        <motor gear="3"/></default></default><worldbody><body><freejoint/><inertial mass="5" pos="0 0 0"/>
        <body childclass="drive"><joint name="left_j"/></body>
        <body><joint name="right_j" class="drive"/></body></body></worldbody>
        <actuator><motor class="drive" joint="left_j"/><motor joint="right_j" gear="-2"/></actuator>
        </mujoco>"""
    )
    found = into(
        model_of(
            ("wheel_coulomb", {"torque_nm": 0.25}),
            ("wheel_viscous", {"nm_per_radps": 0.5}),
            ("drive_gain", {"ratio": 0.1}),
            ("torque_bias_common", {"bias_nm": 0.6}),
            ("payload", {"mass_ratio": -0.1}),
        ),
        robot,
    )
    joints = [j for j in found.iter("joint") if j.get("name")]
    assert [float(j.get("frictionloss")) for j in joints] == [0.75, 0.75]
    assert [float(j.get("damping")) for j in joints] == [1.5, 1.5]
    left, right = found.find("actuator")
    assert (left.tag, float(left.get("gear")), float(right.get("gear"))) == ("general", 3.3, -2.2)
    assert [float(m.get("biasprm").split()[0]) for m in (left, right)] == pytest.approx([0.2, -0.3])
    mass_kg = 1 / (0.07 * 1.35)
    assert float(found.find(".//inertial").get("mass")) == pytest.approx(5 - 0.1 * mass_kg)


def test_what_the_simulator_shows_by_itself_is_not_exported():
    own = '[{"name": "wheel_viscous", "nm_per_radps": 0.002}]'
    effects = ("wheel_viscous", {"nm_per_radps": 0.002}), ("wheel_coulomb", {"torque_nm": 0.1})
    text = export(model_of(*effects, base_effects=own), to="mjcf")
    assert "damping" not in text
    assert 'frictionloss="0.1"' in text


def test_a_side_that_the_simulator_s_own_model_left_out_is_a_difference():
    own = '[{"name": "aerodynamic_drag", "c2_per_m": 0.1}]'
    drag = "aerodynamic_drag", {"c2_per_m": 0.1, "e2_per_m": 0.2}
    text = export(model_of(drag, base_effects=own), to="mjcf")
    assert "brakes turns by e2_per_m is left to the wheels" in text


def test_what_has_no_counterpart_is_listed():
    term = "unnamed:longitudinal:v*abs(yaw_rate)"
    effects = ("torque_deadzone", {"threshold_nm": 0.2}), (term, {"coefficient": 0.1})
    text = export(model_of(*effects), to="mjcf")
    assert re.search(r"no counterpart: torque_deadzone: .*ctrl", text)
    assert f"no counterpart: {term}" in text


def test_the_measured_pose_is_a_site():
    text = export(model_of(("pose_lever_arm", {"x_m": 0.1, "y_m": -0.2})), to="mjcf", into=COURIER)
    sites = {site.get("name"): site for site in ET.fromstring(text).iter("site")}
    assert [float(x) for x in sites["measured pose"].get("pos").split()] == [0.1, -0.2, 0.0]


def test_faults_are_named(tmp_path):
    model, plain = model_of(("payload", {"mass_ratio": 0.1})), tmp_path / "plain.xml"
    plain.write_text('<mujoco><worldbody><body><joint name="a"/></body></worldbody></mujoco>')
    with pytest.raises(InvalidSetting, match=r"joint of a left wheel; its joints are a: .*--joints"):
        export(model, to="mjcf", into=plain)
    plain.write_text("<robot/>")
    with pytest.raises(InvalidFile, match=r"expected .mujoco."):
        export(model, to="mjcf", into=plain)
    with pytest.raises(InvalidSetting, match="belong to mjcf"):
        export(model, to="ros2-diff-drive", into=plain)
    with pytest.raises(InvalidSetting, match="needs wheel_radius_m"):
        export(Model(RobotParameters(alpha=1.0), effects=model.effects), to="mjcf")


def test_joints_may_be_named(tmp_path):
    robot = tmp_path / "robot.xml"
    robot.write_text(
        '<mujoco><worldbody><body><body><joint name="a"/></body><body><joint name="b"/></body></body>'
        "</worldbody></mujoco>"
    )
    found = into(model_of(("wheel_coulomb", {"torque_nm": 0.25})), robot, joints=(("a",), ("b",)))
    losses = [float(joint.get("frictionloss", math.nan)) for joint in found.iter("joint")]
    assert losses == [0.25, 0.25]

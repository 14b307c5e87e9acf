"""``model.toml``: each rejection names the key at fault, and a round trip gives back the model."""

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wmr_schemas import PAPER_ROBOT, RobotParameters
from wmr_schemas.effects import EFFECTS
from wmr_schemas.errors import InvalidFile
from wmr_schemas.model_file import (
    Effect,
    Model,
    NoiseModel,
    Provenance,
    corner_share,
    friction_speed_mps,
    model_to_toml,
    read_model,
)
from wmr_schemas.robot import AUTO, SENSIBLE

finite = st.floats(allow_nan=False, allow_infinity=False)
non_negative = st.floats(min_value=0, allow_nan=False, allow_infinity=False)
words = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20)


@st.composite
def effects(draw: st.DrawFn) -> Effect:
    form = draw(st.sampled_from(list(EFFECTS.values())))
    sd = draw(st.dictionaries(st.sampled_from(list(form.parameters)), non_negative))
    return Effect(form.name, {key: draw(finite) for key in form.parameters}, sd, draw(words))


@st.composite
def models(draw: st.DrawFn) -> Model:
    keys = ("alpha", "alpha_yaw", "half_track_m", "mass_kg")
    sensible = {key: st.floats(*between) for key, between in SENSIBLE.items()}
    robot = draw(st.fixed_dictionaries({}, optional={key: sensible[key] for key in keys}))
    sd = draw(st.dictionaries(st.sampled_from(sorted(robot)), non_negative)) if robot else {}
    speed = draw(sensible["average_speed_mps"] | st.sampled_from([None, AUTO]))
    return Model(
        robot=RobotParameters(**robot, average_speed_mps=speed),
        robot_sd=sd,
        noise=NoiseModel(*(draw(st.none() | non_negative) for _ in range(5))),
        effects=tuple(draw(st.lists(effects(), max_size=4))),
        provenance=draw(st.builds(Provenance, words, words, words)),
    )


def read_text(tmp_path: Path, text: str) -> Model:
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    return read_model(path)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(models())
def test_a_written_model_reads_back_the_same(tmp_path: Path, model: Model) -> None:
    assert read_text(tmp_path, model_to_toml(model)) == model


def test_an_empty_file_is_a_model_of_nothing_known(tmp_path: Path) -> None:
    assert read_text(tmp_path, "") == Model()
    assert model_to_toml(Model()) == ""


def test_a_standard_deviation_stands_beside_its_value() -> None:
    text = model_to_toml(Model(robot=PAPER_ROBOT, robot_sd={"alpha": 1e-4}))
    assert list(tomllib.loads(text)["robot"])[:2] == ["alpha", "alpha_sd"]


def test_an_unnamed_effect_carries_its_formula_and_its_coefficient(tmp_path: Path) -> None:
    name = "unnamed:yaw:v*v*v"
    text = f'[[effects]]\nname = "{name}"\nformula = "c·v³"\ncoefficient = 0.1\ncoefficient_sd = 0.01\n'
    effect = Effect(name, {"coefficient": 0.1}, {"coefficient": 0.01}, "c·v³")
    assert read_text(tmp_path, text).effects == (effect,)


def test_a_side_of_an_effect_that_need_not_be_may_be_left_out(tmp_path: Path) -> None:
    text = '[[effects]]\nname = "aerodynamic_drag"\nc2_per_m = 0.1\n'
    assert read_text(tmp_path, text).effects == (Effect("aerodynamic_drag", {"c2_per_m": 0.1}),)
    with pytest.raises(InvalidFile, match=r"\(aerodynamic_drag\): lacks c2_per_m"):
        read_text(tmp_path, text.replace("c2_per_m", "e2_per_m"))


DRAG = '[[effects]]\nname = "viscous_drag"\n'
REFUSALS = {
    '[[effects]]\nname = "unnamed:yaw:v3"': "[[effects]] #1 name: unnamed:yaw:v3: no factor 'v3'",
    '[[effects]]\nname = "unnamed:yaw:v"\nc = 1': "[[effects]] #1 (unnamed:yaw:v) c: unknown key",
    "gear = 1": "gear: unknown key; known are robot, noise, effects, provenance",
    "robot = 1": "[robot]: expected a table, found 1",
    "[robot]\nweight = 1": "[robot] weight: unknown key; known are alpha, ",
    "[robot]\nalpha = 0": "[robot] alpha: expected a number above 0, found 0",
    "[robot]\nalpha_sd = 1": "[robot] alpha_sd: stands without alpha",
    "[robot]\nalpha = 1\nalpha_sd = -1": "[robot] alpha_sd: expected a number not below 0, found -1",
    "noise = []": "[noise]: expected a table, found []",
    "[noise]\nsd = 1": "[noise] sd: unknown key; known are position_sd_m, ",
    "[noise]\nyaw_sd_rad = nan": "[noise] yaw_sd_rad: expected a number, found nan",
    "[noise]\nyaw_sd_rad = -1.0": "[noise] yaw_sd_rad: expected a number not below 0, found -1.0",
    "provenance = 0": "[provenance]: expected a table, found 0",
    "[provenance]\ndate = 1": "[provenance] date: unknown key; known are log_sha256, version, command",
    "[provenance]\nversion = 1": "[provenance] version: expected a string, found 1",
    "[effects]\nname = 'slope'": "effects: expected [[effects]], an array of tables",
    "effects = [1]": "[[effects]] #1: expected a table, found 1",
    "[[effects]]\nc = 1": "[[effects]] #1 name: None is no effect; known are payload, ",
    f"{DRAG}c1_per_s = 1\n[[effects]]\nname = 'ice'": "[[effects]] #2 name: 'ice' is no effect; known are ",
    f"{DRAG}c1 = 1": "[[effects]] #1 (viscous_drag) c1: unknown key; known are c1_per_s",
    DRAG: "[[effects]] #1 (viscous_drag): lacks c1_per_s",
    f"{DRAG}c1_per_s = 'big'": "[[effects]] #1 c1_per_s: expected a number, found 'big'",
    f"{DRAG}c1_per_s = true": "[[effects]] #1 c1_per_s: expected a number, found True",
    f"{DRAG}c1_per_s = 1\nformula = 2": "[[effects]] #1 formula: expected a string, found 2",
    f"{DRAG}c2_per_m_sd = 1": "[[effects]] #1 c2_per_m_sd: stands without c2_per_m",
    "alpha =": "is not TOML: ",
}


@pytest.mark.parametrize(("text", "message"), REFUSALS.items(), ids=REFUSALS.values())
def test_a_bad_model_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidFile, match=rf"model\.toml: {re.escape(message)}") as caught:
        read_text(tmp_path, text)
    assert caught.value.path == str(tmp_path / "model.toml")


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match=r"none\.toml: cannot be read \(No such file or directory\)$"):
        read_model(tmp_path / "none.toml")


def test_a_file_that_is_not_utf8_is_no_toml(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidFile, match=r"is not TOML: "):
        read_model(tmp_path / "model.toml")


def friction(name: str, size: str, more: str) -> str:
    return f'[[effects]]\nname = "{name}"\n{size} = 0.1\n{more}\n'


def test_a_friction_keeps_the_speed_over_which_it_changes_its_sign(tmp_path: Path) -> None:
    model = read_text(tmp_path, friction("wheel_coulomb", "torque_nm", "sign_change_mps = 0.005"))
    assert model.effects == (Effect("wheel_coulomb", {"torque_nm": 0.1}, sign_change_mps=0.005),)
    assert read_text(tmp_path, model_to_toml(model)) == model
    assert friction_speed_mps(model.effects) == 0.005
    assert friction_speed_mps([Effect("wheel_coulomb", {"torque_nm": 0.1})]) == 0.0


def test_a_dead_zone_keeps_the_share_over_which_it_sets_in(tmp_path: Path) -> None:
    model = read_text(tmp_path, friction("torque_deadzone", "threshold_nm", "corner_share = 0.25"))
    assert model.effects == (Effect("torque_deadzone", {"threshold_nm": 0.1}, corner_share=0.25),)
    assert read_text(tmp_path, model_to_toml(model)) == model
    assert corner_share(model.effects) == 0.25
    assert corner_share([Effect("torque_deadzone", {"threshold_nm": 0.1})]) == 0.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (friction("viscous_drag", "c1_per_s", "sign_change_mps = 0.005"), "sign_change_mps"),
        (friction("wheel_coulomb", "torque_nm", "sign_change_mps = 0"), "above 0 in m/s"),
        (
            friction("wheel_coulomb", "torque_nm", "sign_change_mps = 0.005")
            + friction("scrub_torque", "d0_mps2", ""),
            "one speed serves all frictions",
        ),
        (friction("viscous_drag", "c1_per_s", "corner_share = 0.2"), "corner_share"),
        (friction("torque_deadzone", "threshold_nm", "corner_share = -1"), "above 0 of the threshold"),
        (
            friction("torque_deadzone", "threshold_nm", "corner_share = 0.2")
            + friction("torque_saturation", "limit_nm", ""),
            "one share serves all dead zones and limits",
        ),
    ],
)
def test_a_form_that_no_model_can_have_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidFile, match=message):
        read_text(tmp_path, text)


def test_a_misfit_is_a_size_by_effect(tmp_path):
    path = tmp_path / "model.toml"
    model = Model(misfit={"viscous_drag": 0.01, "slope": 0.002})
    path.write_text(model_to_toml(model))
    assert read_model(path) == model
    for wrong, said in (("viscous_drag = -0.1", "viscous_drag"), ("nonsense = 0.1", "nonsense")):
        path.write_text(f"[misfit]\n{wrong}\n")
        with pytest.raises(InvalidFile, match=said):
            read_model(path)

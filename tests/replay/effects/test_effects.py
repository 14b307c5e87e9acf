"""The analysis's form of every effect: complete, invertible, and joined by users' effects."""

import numpy as np
import pytest

from wmr_replay.effects.efforts import FIELDS, InputEffects, limited, static_part
from wmr_replay.effects.measurement import ON_POSE, to_axle
from wmr_replay.effects.own import acting
from wmr_replay.effects.theta import CONVERTED, PLACES, Theta, from_place, theta_of, to_place
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import LIBRARY, declaration_of, is_place
from wmr_replay.gap.model.confounds import confound_class, separate_with
from wmr_replay.gap.model.extension import WEIGHTS, Extension
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.settings import GateSettings
from wmr_replay.pipeline.model_effects import FOLLOWED, change_pose, change_torque
from wmr_schemas.batches import Rows
from wmr_schemas.effects import EffectDeclaration, OwnEffect, Parameter, Search, Separable, built_in, own
from wmr_schemas.effects.own import own_effects
from wmr_schemas.model_file import Effect
from wmr_synth import hidden_log


def test_every_parameter_of_every_effect_has_a_form():
    for effect in built_in("torque"):
        for key, parameter in effect.parameters.items():
            if "torque" not in parameter.models:
                continue
            formed = (effect.name, key) in PLACES or (effect.name, key) in FIELDS
            assert formed == (parameter.role == "size"), (effect.name, key)
            assert is_place(effect.name, key) != formed
    declared = {(effect.name, key) for effect in built_in("torque") for key in effect.parameters}
    assert set(PLACES) | set(FIELDS) <= declared
    assert len(set(PLACES.values())) == len(PLACES) == len(Theta) - 4


def test_a_scan_looks_for_every_effect_in_one_way():
    for candidate in LIBRARY:
        effect = candidate.declaration
        ways = bool(candidate.places), effect.acts_on == "efforts", candidate.name in WEIGHTS
        assert sum(ways) == 1, candidate.name


def test_what_is_followed_or_on_the_pose_is_what_the_declaration_says():
    assert set(WEIGHTS) | {"undeclared_skid"} == set(FOLLOWED)
    on_pose = {place for (name, _), place in PLACES.items() if declaration_of(name).acts_on == "pose"}
    assert on_pose == set(ON_POSE)


@pytest.mark.parametrize("place", list(CONVERTED))
def test_a_parameter_comes_back_from_its_place(place):
    assert from_place(place, to_place(place, 0.37, 0.12), 0.12) == pytest.approx(0.37, rel=1e-12)


def test_two_effects_of_a_name_add_up_but_for_a_stiffness():
    drag = theta_of([("viscous_drag", {"c1_per_s": 0.1}), ("viscous_drag", {"c1_per_s": 0.2})], 1.0)
    assert drag[Theta.VISCOUS] == pytest.approx(0.3)
    wheels = theta_of([("wheel_viscous", {"nm_per_radps": 0.1})] * 2, 0.5)
    assert wheels[Theta.WHEEL_VISCOUS] == pytest.approx(0.4)
    skid = theta_of([("undeclared_skid", {"stiffness_ratio": r}) for r in (0.5, 2.0)], 1.0)
    assert skid[Theta.UNDECLARED] == pytest.approx(0.5)


def test_measured_poses_come_back_to_the_axle():
    rng = np.random.default_rng(0)
    true, age = rng.normal(size=(3, 50)), np.linspace(0, 100, 50)
    x, y, angle, rate = 0.3, -0.2, 0.1, 0.01
    cos, sin = np.cos(true[2]), np.sin(true[2])
    seen = np.stack([true[0] + cos * x - sin * y, true[1] + sin * x + cos * y, true[2] + angle + rate * age])
    effects = [("pose_lever_arm", {"x_m": x, "y_m": y}), ("yaw_drift", {"rate_radps": rate})]
    theta = theta_of([*effects, ("heading_misalignment", {"angle_rad": angle})], 1.0)
    assert to_axle(seen, age, 1.0, theta) == pytest.approx(true, abs=1e-12)
    assert to_axle(seen, 1e9 * age, 1e9, theta) == pytest.approx(true, abs=1e-12)


def test_a_dead_zone_acts_behind_a_bias_and_before_a_limit():
    u = np.array([[3.0, 0.2], [3.0, 0.2]])
    acts = static_part(u, InputEffects(bias_common_nm=0.5, deadzone_nm=1.0, limit_nm=2.0))
    assert acts == pytest.approx(np.array([[2.0, 0.0], [2.0, 0.0]]))


def test_confounds_and_manoeuvres_come_from_the_declarations():
    assert confound_class(("input_delay",), "input_delay") == ("input_delay", "pose_clock_offset")
    both = confound_class(("payload", "drive_gain"), "payload")
    assert both == ("payload", "drive_gain", "yaw_inertia")
    assert confound_class(("payload",), "payload") == ("payload",)
    assert "undeclared_skid" not in confound_class(("cornering_stiffness",), "cornering_stiffness")
    told = separate_with("rolling_resistance", ("slope", "viscous_drag"))
    assert told == (
        "drive the same profile in several headings; hold several speeds, slow to fast, each for some seconds"
    )


class Gearbox(OwnEffect):
    """Torque lost in proportion to its square."""

    declaration = EffectDeclaration(
        "gearbox",
        "input",
        "u − c·u·|u|",
        {"c_per_nm": Parameter("1/(N·m)", 1e-4, 0.0)},
        acts_on="efforts",
        search=Search(grid=(0.02, 0.05)),
    )

    def efforts(self, efforts_nm, values):
        return efforts_nm - values["c_per_nm"] * efforts_nm * np.abs(efforts_nm)


class Swaying(OwnEffect):
    """A yaw that sways with the sensor's mount."""

    declaration = EffectDeclaration(
        "swaying",
        "measurement",
        "yaw + size·sin(t)",
        {"size_rad": Parameter("rad", 1e-4)},
        acts_on="pose",
        separable=(Separable(("yaw_drift",), "stand still for a while"),),
    )

    def pose_error(self, at, values):
        none = np.zeros_like(at["t_s"])
        return np.stack([none, none, values["size_rad"] * np.sin(at["t_s"])])


class Entry:
    def __init__(self, made):
        self.made, self.name, self.value, self.module = made, made.__name__, made.__name__, "none"

    def load(self):
        return self.made


@pytest.fixture
def installed(monkeypatch):
    monkeypatch.setattr(own, "entry_points", lambda group: [Entry(Gearbox), Entry(Swaying)])
    monkeypatch.setattr(own, "register_sources", lambda package: None)
    own_effects.cache_clear()
    yield
    own_effects.cache_clear()


@pytest.mark.usefixtures("installed")
def test_a_users_effects_on_torque_and_pose_are_taken_out_of_a_replay():
    rows = Rows(np.array([3 * 10**9]), np.array([0]), np.array([[4.0], [-2.0], [1.0], [1.0]]))
    torque = change_torque(rows, (Effect("gearbox", {"c_per_nm": 0.05}),)).values
    assert torque[:, 0] == pytest.approx([3.2, -1.8, 1.0, 1.0])
    pose = Rows(np.array([3 * 10**9]), np.array([0]), np.array([[1.0], [2.0], [0.5]]))
    straight = change_pose(pose, (Effect("swaying", {"size_rad": 0.1}),), 10**9).values
    assert straight[:, 0] == pytest.approx([1.0, 2.0, 0.5 - 0.1 * np.sin(2.0)])
    assert "stand still" in separate_with("swaying", ("yaw_drift",))


@pytest.mark.usefixtures("installed")
def test_a_scan_finds_a_users_effects_on_torque_and_pose():
    """The log's errors are made here: a swaying yaw in one log, weaker torques in the other."""
    log, _ = hidden_log("patrol", 5, duration_s=40.0)
    base = Extension(base_of(log.robot), wheel_radius_m=0.1)
    noise = Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2)
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    pose = type(log.pose)(log.pose.t_ns, log.pose.x_m, log.pose.y_m, log.pose.yaw_rad + 0.03 * np.sin(t_s))
    swaying = type(log)(pose, log.torque, log.mode, log.robot)
    binned = bin_log(swaying, GateSettings(), log.mode)
    scored = {one.name: one for one in scan(Problem.of(binned), base, noise).scored}
    best = max(scored.values(), key=lambda one: one.gain)
    assert best.name == "swaying"
    assert best.parameters["size_rad"] == pytest.approx(0.03, rel=0.1)
    assert scored["gearbox"].parameters["c_per_nm"] in (0.02, 0.05)
    held = base.with_effect("swaying", {"size_rad": 0.03})
    assert held.poses(binned) == pytest.approx(bin_log(log, GateSettings(), log.mode).pose, abs=1e-4)
    weaker = base.with_effect("gearbox", {"c_per_nm": 0.05}).mean_torques(binned)
    assert np.abs(weaker).sum() < np.abs(base.mean_torques(binned)).sum()


@pytest.mark.parametrize("share", [0.1, 0.25, 0.5])
def test_a_round_limit_is_the_mean_of_a_sharp_one_over_a_logistic_scatter(share):
    limit, u = 1.3, np.linspace(-4.0, 4.0, 33)
    p = (np.arange(200_000) + 0.5) / 200_000
    scatter = share * limit * np.log(p / (1 - p))
    w = u / np.tanh(0.5 / share)
    mean = [np.clip(one + scatter, -limit, limit).mean() for one in w]
    np.testing.assert_allclose(limited(u, limit, share), mean, atol=2e-4)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25, 0.5])
def test_a_round_corner_leaves_small_torques_and_the_limit_alone(share):
    small = np.array([-1e-5, 1e-5])
    np.testing.assert_allclose(limited(small, 2.0, share), small, rtol=1e-6)
    np.testing.assert_allclose(limited(np.array([-90.0, 90.0]), 2.0, share), [-2.0, 2.0], rtol=1e-9)
    zone = static_part(np.array([[90.0], [-90.0]]), InputEffects(deadzone_nm=2.0, corner_share=share))
    np.testing.assert_allclose(zone, [[88.0], [-88.0]], rtol=1e-9)


def test_without_effects_nobody_looks_for_those_of_users(monkeypatch):
    """Every installed package would be asked for its entry points."""
    monkeypatch.setattr("wmr_replay.effects.own.own_effects", lambda: pytest.fail("looked for"))
    assert acting([], "acceleration") == []

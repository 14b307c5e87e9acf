"""Forms that are registered for users' effects, in the compiled plant."""

import numpy as np
import pytest

from wmr_schemas.effects import EffectDeclaration, OwnEffect, Parameter, Range, own
from wmr_schemas.effects.own import own_effects
from wmr_schemas.errors import InvalidSetting
from wmr_synth import hidden_log
from wmr_synth.hidden import OwnForm, register_form
from wmr_synth.hidden.registry import OWN_FORMS


class Cable(OwnEffect):
    declaration = EffectDeclaration(
        "cable",
        "longitudinal",
        "−c",
        {"c_mps2": Parameter("m/s²", 1e-4)},
        acts_on="acceleration",
        ranges={"c_mps2": Range(0.1, 0.2)},
    )

    def acceleration(self, at, values):
        raise AssertionError("the simulator must not call the analysis's form")


class Entry:
    name, value, module = "cable", "cable:Cable", "cable"

    def load(self):
        return Cable


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    monkeypatch.setattr(own, "entry_points", lambda group: [Entry()])
    monkeypatch.setattr(own, "register_sources", lambda package: None)
    own_effects.cache_clear()
    yield
    own_effects.cache_clear()
    OWN_FORMS.clear()


def constant(motion, values):
    ahead = np.full(len(motion.t_ns), -values["c_mps2"])
    return np.stack([ahead, 0 * ahead, 0 * ahead], axis=1)


def test_without_a_form_of_its_own_the_effect_cannot_be_hidden():
    with pytest.raises(InvalidSetting, match="the simulator has no effect 'cable'"):
        hidden_log("patrol", 3, hide=["cable"], duration_s=2.0)


def test_a_form_of_no_size_leaves_the_log_as_it_is_to_the_bit():
    register_form("cable", OwnForm("none", acceleration=lambda motion, _: np.zeros((len(motion.t_ns), 3))))
    with_form, facts = hidden_log("patrol", 3, hide=["cable"], duration_s=8.0)
    without, _ = hidden_log("patrol", 3, duration_s=8.0)
    assert facts["effects"][0]["form"] == "none"
    assert np.array_equal(with_form.pose.x_m, without.pose.x_m)
    assert np.array_equal(with_form.torque.left_nm, without.torque.left_nm)


def test_the_driver_asks_for_the_torque_that_the_acceleration_costs():
    """At a constant speed, 2 α Δτ = c."""
    register_form("cable", OwnForm("−c", acceleration=constant))
    own_log, _ = hidden_log("cruise", 5, hide=["cable:c_mps2=0.2"], duration_s=5.0)
    flat, _ = hidden_log("cruise", 5, duration_s=5.0)
    lost = flat.torque.left_nm - own_log.torque.left_nm
    alpha = own_log.robot.alpha
    assert -lost[-1] == pytest.approx(0.2 / (2 * alpha), rel=0.2)


def test_a_drawn_size_is_the_seeds():
    register_form("cable", OwnForm("−c", acceleration=constant))
    sizes = [
        hidden_log("cruise", seed, hide=["cable"], duration_s=1.0)[1]["effects"][0]["parameters"]["c_mps2"]
        for seed in (1, 1, 2)
    ]
    assert sizes[0] == sizes[1] != sizes[2]
    assert all(0.1 <= size <= 0.2 for size in sizes)


def test_a_form_is_for_an_installed_effect_that_is_not_built_in():
    with pytest.raises(InvalidSetting, match="no effect 'rope' is installed"):
        register_form("rope", OwnForm("−c"))
    with pytest.raises(InvalidSetting, match="slope is built in and has a form"):
        register_form("slope", OwnForm("−c"))
    register_form("cable", OwnForm("−c", acceleration=lambda motion, values: np.zeros(3)))
    with pytest.raises(InvalidSetting, match=r"the form of cable must give finite numbers of shape \(1, 3\)"):
        hidden_log("patrol", 3, hide=["cable"], duration_s=1.0)

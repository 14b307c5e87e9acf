"""The catalogue of effects against the documented list of the gap workflow, written out by hand."""

import subprocess
import sys
from dataclasses import replace

import pytest

from wmr_schemas.effects import (
    BEYOND,
    BUILT_IN,
    EFFECTS,
    BaseModel,
    EffectDeclaration,
    Parameter,
    Range,
    built_in,
    catalogue,
    effects_of,
    named_of,
    own,
)
from wmr_schemas.effects.declaration import Domain
from wmr_schemas.effects.own import OwnEffect, check_own, loaded, own_effects
from wmr_schemas.errors import InvalidEffect

DOCUMENTED = {
    "payload": ("mass_ratio",),
    "yaw_inertia": ("ratio",),
    "drive_gain": ("ratio",),
    "rolling_resistance": ("c0_mps2",),
    "viscous_drag": ("c1_per_s",),
    "aerodynamic_drag": ("c2_per_m", "e2_per_m"),
    "scrub_torque": ("d0_mps2",),
    "yaw_damping": ("d1_per_s",),
    "wheel_coulomb": ("torque_nm",),
    "wheel_viscous": ("nm_per_radps",),
    "slope": ("grade_x_mps2", "grade_y_mps2"),
    "torque_imbalance": ("ratio",),
    "torque_bias_common": ("bias_nm",),
    "torque_bias_differential": ("bias_nm",),
    "actuator_lag": ("time_constant_s",),
    "input_delay": ("delay_s",),
    "torque_deadzone": ("threshold_nm",),
    "torque_saturation": ("limit_nm",),
    "com_offset": ("offset_m",),
    "heading_misalignment": ("angle_rad",),
    "pose_lever_arm": ("x_m", "y_m"),
    "cornering_stiffness": ("ratio",),
    "load_step": ("mass_ratio", "t0_s"),
    "low_friction_patch": ("x_m", "y_m", "radius_m", "loss"),
    "slip_interval": ("start_s", "end_s", "loss", "loss_apart"),
    "undeclared_skid": ("stiffness_ratio",),
    "yaw_drift": ("rate_radps",),
}
HELD = {"swivel_friction": ("s0_mps2",), "support_friction": ("p0_mps2", "d0_mps2")}
WHEEL_HELD = {"wide_turn_scrub": ("ratio",)}
"""Effects that a base model may hold, and that no analysis names: on torques, and on wheel speeds."""
WHEEL_SPEED = {
    "wheel_scale": ("ratio",),
    "wheel_scale_difference": ("ratio",),
    "effective_track": ("ratio",),
    "icr_offset": ("offset_m",),
    "lateral_slip": ("seconds",),
    "turning_slip": ("s_per_m",),
    "slip_ratio": ("seconds",),
    "pose_delay": ("delay_s",),
    "slope_slip": ("x_mps", "y_mps"),
    "low_grip_patch": ("x_m", "y_m", "radius_m", "loss", "loss_apart"),
    "turn_gain": ("ratio",),
    "speed_deadzone": ("threshold_mps",),
    "speed_saturation": ("limit_mps",),
    "acceleration_limit": ("limit_mps2",),
    "turn_saturation": ("limit_radps",),
    "speed_desaturation": ("limit_mps",),
    "turn_acceleration_limit": ("limit_radps2",),
}
"""Effects of the wheel-speed base alone."""
ON_BOTH = {"drive_gain", "actuator_lag", "input_delay", "heading_misalignment", "pose_lever_arm"} | {
    "yaw_drift",
    "slip_interval",
}
COMMANDED = {"drive_gain", "actuator_lag", "input_delay", "turn_gain", "acceleration_limit"} | {
    "speed_deadzone",
    "speed_saturation",
    "turn_saturation",
    "speed_desaturation",
    "turn_acceleration_limit",
}
"""Effects that the wheel-speed base has only where commands drive it."""
UNIT_BY_SUFFIX = {
    "s_per_m": "s/m",
    "seconds": "s",
    "_mps": "m/s",
    "_mps2": "m/s²",
    "_radps2": "rad/s²",
    "_per_s": "1/s",
    "_per_m": "1/m",
    "_per_radps": "N·m/(rad/s)",
    "_nm": "N·m",
    "_rad": "rad",
    "_radps": "rad/s",
    "_s": "s",
    "_m": "m",
}

QUANTITIES = {"wheel_radius", "wheel_inertia", "torque_constant", "half_track", "back_emf", "epsilon"} | {
    "lateral_mass",
    "pose_clock_offset",
    "encoder_delay",
    "constant_slip_ratio",
    "slip_in_turning",
}
"""Quantities that an effect is confounded with and that no effect of the catalogue describes."""


def test_the_catalogue_is_the_documented_one() -> None:
    assert {
        name: tuple(form.parameters) for name, form in EFFECTS.items()
    } == DOCUMENTED | WHEEL_SPEED | HELD | WHEEL_HELD


def test_each_base_model_has_its_effects() -> None:
    assert list(effects_of("torque")) == [*DOCUMENTED, *HELD]
    assert list(named_of("torque")) == list(DOCUMENTED)
    assert set(effects_of("wheel_speed")) == set(WHEEL_SPEED) | ON_BOTH | set(WHEEL_HELD)
    assert set(named_of("wheel_speed")) == set(WHEEL_SPEED) | ON_BOTH
    assert {effect.name for effect in built_in("torque")} == {*DOCUMENTED, *HELD}
    assert {effect.name for effect in BUILT_IN if effect.needs_commands} == COMMANDED


def test_what_is_exact_on_a_base_model_names_effects_of_that_base() -> None:
    bases: dict[str, BaseModel] = {"torque": "torque", "wheel_speed": "wheel_speed", "command": "wheel_speed"}
    for driven_by, base in bases.items():
        for effect in built_in(base):
            same = {n for exact in effect.exact if driven_by in exact.driven_by for n in exact.same_as}
            assert same - QUANTITIES <= set(effects_of(base)), (effect.name, driven_by)


def test_a_formula_may_differ_from_base_to_base() -> None:
    gain = EFFECTS["drive_gain"]
    assert "alpha" in gain.formula_of("torque")
    assert gain.formula_of("wheel_speed") == "commanded wheel speeds·(1 + ratio)"
    assert EFFECTS["yaw_drift"].formula_of("wheel_speed") == EFFECTS["yaw_drift"].formula


def test_an_entry_is_filed_under_its_own_name_and_has_a_formula() -> None:
    assert all(name == form.name and form.formula for name, form in EFFECTS.items())


def test_each_parameters_unit_is_the_one_in_its_name() -> None:
    for form in EFFECTS.values():
        for key, unit in form.units.items():
            suffix = next((suffix for suffix in UNIT_BY_SUFFIX if key.endswith(suffix)), None)
            assert unit == UNIT_BY_SUFFIX.get(suffix or "", "1"), (form.name, key)


def test_numbers_are_given_once_and_their_order_is_that_of_the_table() -> None:
    numbers = [effect.number for effect in (EFFECTS | BEYOND).values()]
    assert sorted(numbers) == list(range(len(numbers)))
    assert list(EFFECTS) == [*DOCUMENTED, *WHEEL_SPEED, *HELD, *WHEEL_HELD]


def test_what_is_confounded_or_separable_is_an_effect_or_a_known_quantity() -> None:
    for effect in BUILT_IN:
        others = {name for group in effect.separable for name in group.others} | set(effect.other_forms)
        beside = {name for confound in effect.exact for name in confound.beside}
        same = {name for confound in effect.exact for name in confound.same_as}
        assert others | beside <= set(EFFECTS), effect.name
        assert same <= set(EFFECTS) | QUANTITIES, effect.name
        assert all(effect.name in confound.same_as for confound in effect.exact), effect.name


def test_every_bound_has_a_reason_and_every_grid_lies_within_its_bounds() -> None:
    for effect in BUILT_IN:
        assert all(len(p.why.split()) >= 4 for p in effect.parameters.values()), effect.name
        first = next(iter(effect.parameters.values()))
        if not effect.search.grid_unit:
            assert all(first.least <= value <= first.most for value in effect.search.grid), effect.name
        assert all(first.least <= value <= first.most for value in effect.search.starts), effect.name


def test_drawn_sizes_are_ones_that_the_equations_and_the_fit_allow() -> None:
    for effect in BUILT_IN:
        for key, within in effect.ranges.items():
            parameter = effect.parameters[key]
            for value in (within.low, within.high, *((-within.high,) if within.signed else ())):
                assert parameter.domain.holds(value), (effect.name, key)
                assert parameter.least <= value <= parameter.most, (effect.name, key)


@pytest.mark.parametrize(
    ("domain", "inside", "outside"),
    [
        (Domain.ANY, (-1e9, 0.0), ()),
        (Domain.NOT_NEGATIVE, (0.0, 1e9), (-1e-9,)),
        (Domain.ABOVE_ZERO, (1e-9,), (0.0, -1.0)),
        (Domain.ABOVE_MINUS_ONE, (-0.999, 0.0), (-1.0, -2.0)),
        (Domain.SHARE, (0.0, 0.999), (1.0, -0.001)),
    ],
)
def test_domains(domain: Domain, inside: tuple[float, ...], outside: tuple[float, ...]) -> None:
    assert all(map(domain.holds, inside))
    assert not any(map(domain.holds, outside))


def test_a_declaration_whose_parts_do_not_fit_is_refused() -> None:
    parameters = {"c_per_s": Parameter("1/s", 1e-4)}
    with pytest.raises(ValueError, match="draws d_per_s, which it does not have"):
        EffectDeclaration("a", "yaw", "−c", parameters, "acceleration", ranges={"d_per_s": Range(0, 1)})
    with pytest.raises(ValueError, match="needs a name, a parameter and a base model"):
        EffectDeclaration("a", "yaw", "−c", {}, "acceleration")
    with pytest.raises(ValueError, match="ordered bounds"):
        Parameter("1/s", 1e-4, 1.0, 0.0)


def test_a_declaration_carries_effects_of_the_wheel_speed_base() -> None:
    """``turning_slip`` of robots that record wheel speeds and no torque."""
    assert EFFECTS["turning_slip"].models == ("wheel_speed",)
    assert EFFECTS["payload"].models == ("torque",)
    assert EFFECTS["slip_interval"].models == ("torque", "wheel_speed")


class Tether(OwnEffect):
    declaration = EffectDeclaration(
        "tether", "longitudinal", "−c·r", {"c_per_s2": Parameter("1/s²", 1e-4)}, acts_on="acceleration"
    )

    def acceleration(self, at, values):  # type: ignore[no-untyped-def]
        return -values["c_per_s2"] * at["x_m"]


class Entry:
    """An entry point as importlib.metadata gives it."""

    name, value, module = "tether", "tether_effect:Tether", "tether_effect"

    def __init__(self, made: object) -> None:
        self.made = made

    def load(self) -> object:
        if isinstance(self.made, Exception):
            raise self.made
        return self.made


def test_a_users_effect_joins_the_catalogue_and_its_sources_the_cache(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []
    monkeypatch.setattr(own, "entry_points", lambda group: [Entry(Tether)])
    monkeypatch.setattr(own, "register_sources", told.append)
    own_effects.cache_clear()
    try:
        assert list(catalogue()) == [*EFFECTS, "tether"]
        assert told == ["tether_effect"]
    finally:
        own_effects.cache_clear()


def changed(**fields: object) -> type[OwnEffect]:
    """The tether with another declaration."""
    return type("Changed", (Tether,), {"declaration": replace(Tether.declaration, **fields)})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("made", "problem"),
    [
        (ImportError("no such module"), "cannot be loaded"),
        (object(), "is no OwnEffect"),
        (changed(acts_on="tyre"), "acts_on is one of acceleration, efforts, pose, not 'tyre'"),
        (changed(channel="lateral"), "channel is one of longitudinal, yaw, not 'lateral'"),
        (changed(name="my:tether"), "a name has no colon"),
        (changed(number=3), "numbers belong to the built-in effects"),
        (changed(extent="time"), "acts always"),
        (changed(acts_on="pose"), "lacks the method pose_error"),
    ],
)
def test_a_users_effect_that_cannot_be_used_is_refused_by_name(made: object, problem: str) -> None:
    with pytest.raises(InvalidEffect, match=f"tether_effect:Tether.*{problem}"):
        loaded(Entry(made))  # type: ignore[arg-type]


def test_a_users_effect_without_fault_passes() -> None:
    check_own("tether", Tether())


def test_the_vocabulary_needs_neither_polars_nor_numba() -> None:
    code = (
        "import sys, wmr_schemas, wmr_schemas.effects, wmr_schemas.model_file\n"
        "sys.exit(', '.join({'polars', 'numba', 'scipy'} & set(sys.modules)) or None)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")

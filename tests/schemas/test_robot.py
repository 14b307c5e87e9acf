"""Robot parameters: accepted and rejected values, and the round trip through the metadata record."""

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wmr_schemas import PAPER_ROBOT, RobotParameters
from wmr_schemas.errors import InvalidFile

KEYS = (
    "alpha",
    "alpha_yaw",
    "half_track_m",
    "wheel_radius_m",
    "mass_kg",
    "wheel_inertia_kgm2",
    "yaw_inertia_kgm2",
    "cornering_stiffness_over_epsilon",
    "longitudinal_stiffness_over_epsilon",
    "average_speed_mps",
)
"""The keys that the canonical log documents."""

positive = st.floats(min_value=0, exclude_min=True, allow_nan=False, allow_infinity=False)
robots = st.builds(
    lambda values, speed: RobotParameters(**values, average_speed_mps=speed),
    st.fixed_dictionaries({}, optional=dict.fromkeys(KEYS[:-1], positive)),
    st.none() | st.just("auto") | positive,
)


def test_known_parameters_stand_in_the_documented_order() -> None:
    assert tuple(RobotParameters(**dict.fromkeys(KEYS, 1.0)).known()) == KEYS


@given(robots)
def test_the_metadata_record_gives_the_same_robot_back(robot: RobotParameters) -> None:
    record = robot.to_metadata()
    assert all(isinstance(value, str) for value in record.values())
    assert RobotParameters.from_metadata(record) == robot


def test_metadata_leaves_other_tools_keys_alone() -> None:
    assert RobotParameters.from_metadata({"alpha": "0.5", "vendor": "somebody"}) == RobotParameters(alpha=0.5)


def test_metadata_that_is_no_number_is_named() -> None:
    with pytest.raises(InvalidFile, match=r"^metadata record wmr_replay: mass_kg: 'heavy' is not a number$"):
        RobotParameters.from_metadata({"mass_kg": "heavy"})


def test_metadata_out_of_range_is_named() -> None:
    with pytest.raises(
        InvalidFile, match=r"^metadata record wmr_replay: mass_kg: expected a number above 0, found -2\.0$"
    ):
        RobotParameters.from_metadata({"mass_kg": "-2"})


def test_an_unknown_key_is_named_beside_the_known_ones() -> None:
    expected = f"robot.toml: [robot] weight: unknown key; known are {', '.join(KEYS)}"
    with pytest.raises(InvalidFile, match=f"^{re.escape(expected)}$"):
        RobotParameters.from_values({"weight": 3}, "robot.toml")


@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, True, "1", "auto", None, [1.0]])
def test_a_parameter_is_a_finite_number_above_zero(value: object) -> None:
    expected = f"f.toml: [robot] alpha: expected a number above 0, found {value!r}"
    with pytest.raises(InvalidFile, match=f"^{re.escape(expected)}$"):
        RobotParameters.from_values({"alpha": value}, "f.toml")


@pytest.mark.parametrize("value", ["automatic", 0, -0.3])
def test_the_average_speed_is_a_number_or_auto(value: object) -> None:
    expected = f'f.toml: [robot] average_speed_mps: expected a number above 0 or "auto", found {value!r}'
    with pytest.raises(InvalidFile, match=f"^{re.escape(expected)}$"):
        RobotParameters.from_values({"average_speed_mps": value}, "f.toml")


def test_parameters_are_checked_at_construction_too() -> None:
    with pytest.raises(InvalidFile, match=r"^robot: half_track_m: expected a number above 0, found -1\.0$"):
        RobotParameters(half_track_m=-1.0)


def test_whole_numbers_become_floats() -> None:
    mass = RobotParameters.from_values({"mass_kg": 20}, "f.toml").mass_kg
    assert (mass, type(mass)) == (20.0, float)


def test_the_yaw_gain_is_alpha_unless_given() -> None:
    assert RobotParameters(alpha=0.02).alpha_yaw_or_alpha == 0.02
    assert RobotParameters(alpha=0.02, alpha_yaw=0.03).alpha_yaw_or_alpha == 0.03
    assert RobotParameters().alpha_yaw_or_alpha is None


def test_the_papers_alpha_is_r_squared_over_three_wheel_inertias() -> None:
    exact = Fraction(35, 100) ** 2 / (3 * Fraction(16, 10))
    assert PAPER_ROBOT.alpha == pytest.approx(float(exact), rel=1e-15)
    assert PAPER_ROBOT.alpha == pytest.approx(0.0255, abs=5e-5)


@pytest.mark.parametrize(("key", "value"), [("wheel_radius_m", 100), ("half_track_m", 250), ("mass_kg", 3e7)])
def test_a_parameter_of_a_file_that_makes_no_sense_is_refused(key: str, value: float) -> None:
    said = re.escape(f"robot.toml: [robot] {key}: {value:g} makes no sense; expected ")
    with pytest.raises(InvalidFile, match=f"^{said}"):
        RobotParameters.from_values({key: value}, "robot.toml")


@pytest.mark.parametrize(("mass_kg", "radius_m"), [(0.3, 0.01), (2000.0, 1.5)])
def test_small_and_large_robots_make_sense(mass_kg: float, radius_m: float) -> None:
    alpha = 1 / (mass_kg * radius_m)
    RobotParameters.from_values({"alpha": alpha, "mass_kg": mass_kg, "wheel_radius_m": radius_m}, "f.toml")

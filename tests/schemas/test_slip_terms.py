"""Terms that are added to a velocity: names, units, products."""

import numpy as np
import pytest

from wmr_schemas.errors import InvalidTerm
from wmr_schemas.slip_terms import is_slip_term, parse_slip_term, unit_of


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("unnamed:v_long:v*abs(v)", "s/m"),
        ("unnamed:v_long:v*t", "1/s"),
        ("unnamed:v_long:v*cos(yaw)", "1"),
        ("unnamed:v_lat:v*v*yaw_rate", "s²/m"),
        ("unnamed:yaw_rate:yaw_rate*abs(yaw_rate)", "s"),
        ("unnamed:yaw_rate:v*abs(v)", "s/m²"),
        ("unnamed:v_lat:a", "s"),
    ],
)
def test_a_coefficient_has_the_unit_that_gives_a_velocity(name, unit):
    assert is_slip_term(name)
    assert parse_slip_term(name).name == name
    assert parse_slip_term(name).unit == unit


def test_units_below_a_line():
    assert unit_of({"m": -1, "s": -2}) == "1/(m·s²)"


def test_a_term_is_the_product_of_its_factors():
    columns = {"v": np.array([-2.0, 1.0]), "yaw_rate": np.array([0.5, -3.0])}
    assert parse_slip_term("unnamed:v_lat:abs(v)*v*yaw_rate").evaluate(columns).tolist() == [-2.0, -3.0]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("unnamed:longitudinal:v", "no channel 'longitudinal'; on wheel speeds these are v_long"),
        ("unnamed:v_lat:effort_sum", "no factor 'effort_sum'"),
        ("unnamed:v_lat", "expected unnamed:"),
        ("unnamed:v_lat:" + "*".join("v" * 7), "has 7 factors"),
    ],
)
def test_what_is_no_term_is_refused(name, said):
    with pytest.raises(InvalidTerm, match=said):
        parse_slip_term(name)


def test_a_term_of_torques_is_none_of_these():
    assert not is_slip_term("unnamed:longitudinal:v")
    assert not is_slip_term("wheel_scale")

"""Factors that shape a term by one quantity or by time: by hand, texts, parities and what is refused."""

import math

import numpy as np
import pytest

from wmr_schemas.errors import InvalidTerm
from wmr_schemas.placed_factors import slanted_text, wave_text
from wmr_schemas.shape_factors import digits, shape_text
from wmr_schemas.terms import Term, parse_term

ROW = {"v": -0.6, "yaw": 0.5, "yaw_rate": 0.4, "effort_sum": 30.0, "effort_diff": -3.0}
PLACE = {"t": 12.0, "x": 1.2, "y": -3.0, "s": 11.0}
BY_HAND = {
    "effort_sum*fall(v,0.3)": 30.0 / 3.0,
    "v*over(v,0.45)": -0.6 + 0.45,
    "v*over(v,0.9)": 0.0,
    "bell(effort_diff,1.5)": math.exp(-2.0),
    "sgn(v)*ring(v,0.5,0.2)": -math.exp(-0.125),
    "rise(effort_diff,2)*v": -0.6 * math.tanh(1.5),
    "soft(v,0.3)": math.tanh(-2.0),
    "soft(yaw_rate,0.2)*bell(v,0.6)": math.tanh(2.0) * math.exp(-0.5),
    "beyond(v,0.4,0.5)": 1 / (1 + math.exp(-0.8)),
    "above(v,0.4,0.5)": 1 / (1 + math.exp(4.0)),
    "above(effort_diff,-3,2)*v": -0.3,
    "gust(10,4)*cos(yaw)": math.exp(-0.125) * math.cos(0.5),
    "pulse(10,4)*v": -0.6 / (1 + 0.5**8),
    "edge(yaw,0.2,0.6)": math.tanh(0.5),
    "after(12)*v": -0.6,
    "after(12.5)*v": 0.0,
    "decay(6)*yaw_rate": 0.4 * math.exp(-2.0),
    "fall(t,4)*v": -0.6 / 4.0,
    "saw(10,4)*v": -0.6 * 0.5 / 0.95,
    "saw(13,20)": 1.0,
    "saw(8.5,3.5714286)": 0.4,
    "effort_sum*over(a_lat,0.08)": 30.0 * 2.0 / 3.0,
    "soft(power,9)": math.tanh(-2.0),
    "above(a_lat,-0.24,0.1)": 0.5,
    "sin(0.5t)": math.sin(6.0),
    "sin(0.8x-0.3y)*cos(yaw)": math.sin(0.8 * 1.2 + 0.9) * math.cos(0.5),
    "cos(0.8x+0.3y)": math.cos(0.8 * 1.2 - 0.9),
    "v*cos(2yaw)": -0.6 * math.cos(1.0),
    "v*x": -0.72,
    "v*edge(x,1,0.4)": -0.6 * math.tanh(0.5),
    "tilt(0.2,-2,1.5)": (-math.cos(0.5) - math.sin(0.5)) / 1.5 * math.exp(-2.0 / 4.5),
    "rope(4.2,1,12)": math.cos(math.atan2(4.0, 3.0) - 0.5) * 5.0 / 13.0,
    "rope_left(4.2,1,12)": math.sin(math.atan2(4.0, 3.0) - 0.5) * 5.0 / 13.0,
}
UNITS = {
    "effort_sum*fall(v,0.3)": "m/(s²·N·m)",
    "v*over(v,0.3)": "1/s",
    "soft(v,0.3)": "m/s²",
    "gust(10,4)": "m/s²",
    "v*x": "1/(m·s)",
}
PARITIES = {
    "effort_sum*fall(v,0.3)": {"effort_sum": "odd", "v": "even"},
    "v*over(v,0.3)": {"v": "odd"},
    "sgn(v)*ring(v,0.5,0.2)": {"v": "odd"},
    "soft(v,0.3)*fall(v,0.2)": {"v": "odd"},
    "rise(v,0.3)*sin(2yaw)": {"v": "even"},
    "v*soft(v,0.3)*soft(yaw_rate,0.1)": {"v": "even", "yaw_rate": "odd"},
    "sgn(v)*beyond(yaw_rate,0.4,0.2)": {"v": "odd", "yaw_rate": "even"},
    "v*above(v,0,0.2)": {"v": "mixed"},
    "sgn(v)*above(yaw_rate,-0.4,0.2)": {"v": "odd", "yaw_rate": "mixed"},
    "gust(10,4)*cos(yaw)": {},
    "effort_sum*over(a_lat,0.1)": {"effort_sum": "odd", "v": "even", "yaw_rate": "even"},
    "v*soft(a_lat,0.1)": {"v": "even", "yaw_rate": "odd"},
    "sgn(v)*above(power,1,2)": {"v": "mixed", "effort_sum": "mixed"},
}


@pytest.mark.parametrize("product", BY_HAND)
def test_a_shaped_term_by_hand(product: str) -> None:
    term = parse_term(f"unnamed:longitudinal:{product}")
    columns = {name: np.full(2, value) for name, value in (ROW | PLACE).items()}
    assert parse_term(term.name) == term
    assert not term.is_listed
    assert term.evaluate(columns) == pytest.approx(np.full(2, BY_HAND[product]))


@pytest.mark.parametrize("product", UNITS)
def test_a_shape_has_no_unit(product: str) -> None:
    assert parse_term(f"unnamed:yaw:{product}").unit == UNITS[product]


@pytest.mark.parametrize("product", PARITIES)
def test_a_shape_is_even_but_for_a_soft_sign_and_one_side(product: str) -> None:
    assert parse_term(f"unnamed:yaw:{product}").parity == PARITIES[product]


def test_a_shape_by_a_speed_is_no_place() -> None:
    assert not parse_term("unnamed:yaw:v*fall(v,0.3)").is_placed
    assert parse_term("unnamed:yaw:gust(10,4)*v").is_placed
    assert parse_term("unnamed:yaw:v*v").is_listed


def test_texts_are_read_back() -> None:
    for factor in (
        shape_text("ring", "v", 0.51234, 1e-7),
        shape_text("gust", "t", 123456.0, 3.0),
        shape_text("above", "effort_sum", -0.5, 2e-4),
        shape_text("after", "t", -2.0),
        shape_text("saw", "t", -2.0, 9.0),
        shape_text("beyond", "power", 3.0, 1.5),
        slanted_text("sin", 0.78539, -0.2),
        slanted_text("cos", -0.5, 0.2),
        wave_text("sin", 0.2, "t"),
        wave_text("cos", 2.0, "yaw"),
    ):
        assert not Term("longitudinal", (factor,)).is_listed
    assert wave_text("cos", 1.0, "yaw") == "cos(yaw)"
    assert [digits(x) for x in (0.123456, 30.0, 123456.0, 2e-6)] == ["0.1235", "30", "123500", "2e-06"]


@pytest.mark.parametrize(
    "factor",
    [
        *("fall(x,1)", "fall(v)", "fall(v,0)", "fall(v,-1)", "fall(v,1,2)", "ring(v,1)", "ring(v,1,0)"),
        *(
            "over(t,1)",
            "gust(1)",
            "gust(1,0)",
            "decay(0)",
            "after()",
            "saw(1,0)",
            "saw(2)",
            "over(sidewards,1)",
            "sin(2x+y)",
            "bell(v,nan)",
            "edge(v,1,1)",
            "beyond(v,0,1)",
            "above(v,1,0)",
            "above(x,1,1)",
            "edge(x,1,0)",
        ),
    ],
)
def test_other_texts_are_refused(factor: str) -> None:
    with pytest.raises(InvalidTerm, match="no factor"):
        parse_term(f"unnamed:longitudinal:{factor}")

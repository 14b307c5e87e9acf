"""Factors that read time or place: by hand, their units, parities and texts."""

import math

import numpy as np
import pytest

from wmr_schemas.errors import InvalidTerm
from wmr_schemas.placed_factors import bell_text, cut_text, line_text, number, wave_text
from wmr_schemas.terms import Term, parse_term

ROW = {"v": -2.0, "yaw": 0.5, "yaw_rate": 0.4, "effort_sum": 30.0, "effort_diff": 3.0, "t": 7.0}
PLACE = {"x": 1.2, "y": -3.0, "s": 11.0}
DX, DY, R = 1.2 - 0.5, -3.0 + 2.0, 1.5
BELL = math.exp(-(DX**2 + DY**2) / (2 * R**2))
BY_HAND = {
    "effort_sum*t": 210.0,
    "sin(0.8x)*cos(yaw)": math.sin(0.96) * math.cos(0.5),
    "cos(2y)": math.cos(-6.0),
    "sin(0.25s)": math.sin(2.75),
    "bump(0.5,-2,1.5)": BELL,
    "away(0.5,-2,1.5)": (DX**2 + DY**2) / (DX**2 + DY**2 + R**2),
    "circle(0.5,-2,1,0.3)": math.exp(-0.5 * ((math.hypot(DX, DY) - 1.0) / 0.3) ** 2),
    "disc(0.5,-2,1.5)": 1 / (1 + ((DX**2 + DY**2) / R**2) ** 4),
    "band(y,-2,1.5)": math.exp(-0.5 / 1.5**2),
    "edge(x,0.5,0.2)": math.tanh(3.5),
    "side(0.5,-2,0.6,1.5)": math.tanh((DX * math.cos(0.6) + DY * math.sin(0.6)) / R),
    "strip(0.5,-2,0.6,1.5)": math.exp(-0.5 * ((DX * math.cos(0.6) + DY * math.sin(0.6)) / R) ** 2),
    "hill(0.5,-2,1.5)": (DX * math.cos(0.5) + DY * math.sin(0.5)) / R * BELL,
}
UNITS = {
    "1": "m/s²",
    "v": "1/s",
    "v*v": "1/m",
    "v*v*v": "s/m²",
    "sgn(v)": "m/s²",
    "abs(v)*yaw_rate": "1",
    "yaw_rate": "m/s",
    "effort_sum": "m/(s²·N·m)",
    "effort_sum*t": "m/(s³·N·m)",
    "sin(0.8x)*cos(yaw)": "m/s²",
    "hill(0,0,1)": "m/s²",
}
PARITIES = {
    "v*abs(v)": {"v": "odd"},
    "v*v": {"v": "even"},
    "effort_sum*abs(v)": {"effort_sum": "odd", "v": "even"},
    "v*yaw_rate": {"v": "odd", "yaw_rate": "odd"},
    "abs(v)*sgn(yaw_rate)": {"v": "even", "yaw_rate": "odd"},
    "sin(0.8x)*cos(yaw)": {},
}


@pytest.mark.parametrize("product", BY_HAND)
def test_a_placed_term_by_hand(product: str) -> None:
    term = parse_term(f"unnamed:longitudinal:{product}")
    columns = {name: np.full(2, value) for name, value in (ROW | PLACE).items()}
    assert term.is_placed
    assert parse_term(term.name) == term
    assert term.evaluate(columns) == pytest.approx(np.full(2, BY_HAND[product]))


@pytest.mark.parametrize("product", UNITS)
def test_the_unit_makes_an_acceleration_of_the_product(product: str) -> None:
    assert parse_term(f"unnamed:yaw:{product}").unit == UNITS[product]


@pytest.mark.parametrize("product", PARITIES)
def test_parity(product: str) -> None:
    assert parse_term(f"unnamed:longitudinal:{product}").parity == PARITIES[product]


def test_texts_are_read_back() -> None:
    for factor in (
        wave_text("sin", 0.78539, "x"),
        wave_text("cos", 12.0, "s"),
        bell_text("hill", -1.25, 0.0, 2.0),
        bell_text("circle", -1.25, 0.0, 2.0, 0.4),
        cut_text("band", "y", -1.25, 0.3),
        cut_text("edge", "t", 40.0, 0.3),
        line_text("side", -1.25, 0.0, 2.9, 0.3),
        line_text("strip", 1e5, -2.0, -0.1, 0.3),
    ):
        assert Term("longitudinal", (factor,)).is_placed
    assert [number(x) for x in (-0.00001, 3.0, 0.12345, -1.5)] == ["0", "3", "0.1235", "-1.5"]


OTHERS = (
    *("sin(x)", "sin(2z)", "bump(1,2)", "disc(1,2,0)", "tan(2x)", "sin(2x);v", "band(t,1,1)", "band(x,1,0)"),
    *("hill(0,0,0)", "side(1,2,3)", "side(1,2,3,0)", "strip(1,2,3,-1)", "edge(v,1,1)"),
    *("circle(1,2,3)", "circle(1,2,0,1)", "circle(1,2,1,0)"),
)


@pytest.mark.parametrize("factor", OTHERS)
def test_other_texts_are_refused(factor: str) -> None:
    with pytest.raises(InvalidTerm, match="no factor"):
        parse_term(f"unnamed:longitudinal:{factor}")

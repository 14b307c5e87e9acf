"""Dictionary terms: a grammar of named products that is looked up and never executed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wmr_schemas.errors import InvalidTerm
from wmr_schemas.terms import CHANNELS, COLUMNS, FACTORS, MOST_FACTORS, Term, parse_term

terms = st.builds(
    Term,
    st.sampled_from(CHANNELS),
    st.lists(st.sampled_from(tuple(FACTORS)), min_size=1, max_size=MOST_FACTORS).map(tuple),
)
ROW = {"v": -1.3, "v_lat": 0.2, "yaw": 2.0, "yaw_rate": -0.4, "effort_sum": 30.0, "effort_diff": -7.0}
BY_HAND = {
    "v*abs(yaw_rate)": -1.3 * 0.4,
    "v*v*v": (-1.3) ** 3,
    "cos(yaw) * effort_sum": math.cos(2.0) * 30.0,
    "abs(v)*sin(yaw)*abs(effort_diff)": 1.3 * math.sin(2.0) * 7.0,
    "1": 1.0,
    "sgn(v)*abs(v_lat)": -0.2,
    "sgn(yaw_rate)*effort_diff": 7.0,
}


@given(terms)
def test_a_term_comes_back_from_its_name(term):
    assert parse_term(term.name) == term
    assert sum(term.powers) == len(term.factors)


@pytest.mark.parametrize("product", BY_HAND)
def test_a_term_is_the_product_of_its_factors(product):
    columns = {name: np.full(3, value) for name, value in ROW.items()}
    assert tuple(columns) == COLUMNS
    value = parse_term(f"unnamed:yaw:{product}").evaluate(columns)
    assert value == pytest.approx(np.full(3, BY_HAND[product]))


def test_columns_that_a_term_does_not_read_may_be_missing():
    assert parse_term("unnamed:longitudinal:v*v").evaluate({"v": np.array([2.0, 3.0])}).tolist() == [4.0, 9.0]


REFUSED = {
    "unnamed:v": "expected unnamed:<channel>:<factor>",
    "viscous_drag": "expected unnamed:<channel>:<factor>",
    "unnamed:up:v": "no channel 'up'; known are longitudinal, lateral, yaw",
    "unnamed:yaw:v**2": "no factor ''",
    "unnamed:yaw:__import__('os')": "no factor",
    "unnamed:yaw:v+v": "no factor 'v\\+v'; known are 1, v, abs\\(v\\)",
    "unnamed:yaw:": "no factor ''",
    "unnamed:yaw:" + "*".join("v" * 7): "has 7 factors; 1 to 6 are allowed",
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_such_product_is_refused_with_the_reason(name):
    with pytest.raises(InvalidTerm, match=REFUSED[name]):
        parse_term(name)

"""Kinds of findings, and which of several found together stand."""

import pytest

from wmr_schemas.findings import KINDS, Severity, finding, without_explained

BARS, WARNING = Severity.BARS, Severity.WARNING


def codes(*found):
    return [f.code for f in without_explained(found)]


def test_only_kinds_that_are_declared_explain_others_and_none_in_a_circle():
    assert {code for kind in KINDS.values() for code in kind.explained_by} <= set(KINDS)

    def causes(code):
        return {code} | {c for cause in KINDS[code].explained_by for c in causes(cause)}

    assert all(causes(code) for code in KINDS)  # RecursionError in a circle


def test_the_cause_stands_alone_whatever_the_order():
    yaw, heading = finding("yaw_unit", BARS, "degrees", 50), finding("heading_not_along_path", BARS, "", 60)
    torque = finding("torque_sign", BARS, "", 40)
    assert codes(yaw, heading, torque) == codes(torque, heading, yaw) == ["yaw_unit"]


@pytest.mark.parametrize(
    ("cause", "n"), [(finding("yaw_unit", BARS, "", 4), 60), (finding("yaw_unit", WARNING, ""), 60)]
)
def test_a_cause_that_is_brief_or_less_severe_explains_nothing(cause, n):
    assert codes(cause, finding("heading_not_along_path", BARS, "", n)) == [
        cause.code,
        "heading_not_along_path",
    ]


def test_faults_that_have_nothing_to_do_with_each_other_are_all_told():
    found = [finding(code, WARNING, "") for code in ("coloured_noise", "clock_offset", "steered")]
    assert without_explained(found) == found

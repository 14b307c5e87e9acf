"""Preliminary models: what is significant and its near rivals; those that are alike are one."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap import plain_loop
from tests.replay.gap.plain_loop import candidate, made_fit, made_log, problem_of

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.modes_and_effects import Solution
from wmr_replay.gap.search.preliminary import alike, distinct, models_from
from wmr_replay.gap.search.select import Selection
from wmr_synth.driving.patrol import SMALL_ROBOT

BASE = Extension(base_of(SMALL_ROBOT))
DRAG = BASE.with_effect("viscous_drag", {"c1_per_s": 0.2})


PLAIN = Extension(plain_loop.BASE)


@pytest.fixture(scope="module")
def drive():
    """40 s of the base model."""
    return problem_of(made_log(1))


def drag(c1_per_s: float) -> Extension:
    return DRAG.with_effect("viscous_drag", {"c1_per_s": c1_per_s})


def test_of_models_alike_the_first_is_kept_and_their_order_stays():
    other = BASE.with_effect("aerodynamic_drag", {"c2_per_m": 0.2})
    models = [drag(0.2), other, drag(0.21), drag(0.3), drag(0.19), other]
    assert distinct(models, 0.1) == [drag(0.2), other, drag(0.3)]


@pytest.mark.parametrize(
    "other",
    [
        drag(-0.2),
        drag(0.25),
        DRAG.with_effect("payload", {"mass_ratio": 0.2}),
        replace(DRAG, friction_speed_mps=0.1),
        replace(DRAG, known=(("payload", {"mass_ratio": 0.2}),)),
    ],
    ids=["sign", "size", "name", "form", "known"],
)
def test_models_that_differ_are_not_alike(other):
    assert not alike(DRAG, other, 0.1)
    assert not alike(other, DRAG, 0.1)


def test_losses_in_a_time_or_place_are_never_alike():
    model = BASE.with_effect("slip_interval", {"t0_s": 1.0, "t1_s": 3.0, "loss": 0.5})
    assert not alike(model, model, 0.1)


def selection_of(problem: Problem, stages, effects) -> Selection:
    """A selection whose candidates, (name, score, p), were fitted to a size of 0.1."""
    e, extension = np.zeros((len(problem.binned), 3)), PLAIN
    made = tuple(
        tuple(
            candidate(n, s, score=s, p=p, fit=made_fit(problem, extension.with_effect(n, {"size": 0.1}), e))
            for n, s, p in stage
        )
        for stage in stages
    )
    for name in effects:
        extension = extension.with_effect(name, {"size": 0.1})
    return Selection(made_fit(problem, PLAIN, e), made_fit(problem, extension, e), (), made)


@pytest.mark.parametrize(
    ("stages", "effects", "expected"),
    [
        ([[("payload", 20.0, 0.5)]], [], []),
        ([[("payload", 90.0, 1e-9), ("drive_gain", 29.0, 1e-9)]], ["payload"], [["payload"]]),
        (
            [[("payload", 90.0, 1e-9), ("drive_gain", 80.0, 1e-9)]],
            ["payload"],
            [["payload"], ["drive_gain"]],
        ),
        (
            [[("payload", 90.0, 1e-9)], [("undeclared_skid", 60.0, 1e-9)]],
            ["payload", "undeclared_skid"],
            [["payload"]],
        ),
        ([[("input_delay", 90.0, 1e-9)], [("actuator_lag", 30.0, 1e-4)]], ["input_delay"], [["input_delay"]]),
        (
            [[("viscous_drag", 90.0, 1e-9)], [("scrub_torque", 30.0, 1e-4)]],
            ["viscous_drag"],
            [["viscous_drag", "scrub_torque"]],
        ),
        (
            [[("undeclared_skid", 90.0, 1e-9), ("pose_lever_arm", 60.0, 1e-9), ("slope", 50.0, 1e-9)]],
            ["undeclared_skid"],
            [["undeclared_skid"], ["pose_lever_arm"], ["slope"]],
        ),
        (
            [[("undeclared_skid", 90.0, 1e-9), ("pose_lever_arm", 60.0, 1e-9), ("slope", 29.0, 1e-9)]],
            ["undeclared_skid"],
            [["undeclared_skid"], ["pose_lever_arm"]],
        ),
    ],
)
def test_preliminary_models_are_what_is_significant_and_its_near_rivals(drive, stages, effects, expected):
    found = models_from(drive, PLAIN, selection_of(drive, stages, effects))
    assert [list(model.effects) for model in found] == expected


@pytest.mark.parametrize(
    ("preliminary", "found", "holds"),
    [
        ("payload", ["payload"], True),
        ("payload", ["drive_gain"], True),
        ("payload", [], False),
        ("undeclared_skid", ["payload", "undeclared_skid"], True),
        ("undeclared_skid", ["payload"], False),
    ],
)
def test_skidding_replaced_by_ideal_must_be_found_as_an_undeclared_skid(drive, preliminary, found, holds):
    selection = selection_of(drive, [], [])
    selection = replace(selection, found=tuple(candidate(name, 50.0) for name in found))
    assert Solution(drive, selection, Extension(plain_loop.BASE, {preliminary: {"size": 0.1}})).holds is holds

"""Preliminary models: those that are alike are one."""

from dataclasses import replace

import pytest

from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.preliminary import alike, distinct
from wmr_synth.driving.patrol import SMALL_ROBOT

BASE = Extension(base_of(SMALL_ROBOT))
DRAG = BASE.with_effect("viscous_drag", {"c1_per_s": 0.2})


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

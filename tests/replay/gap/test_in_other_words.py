"""What named effects mean together, or what acts alike: one side's torques, a centre of mass to a side."""

import numpy as np
import pytest

from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.in_other_words import one_side, sideways_mass, wide_weight
from wmr_replay.gap.result.result import Estimate, FoundEffect
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters

OWN = GateSettings().report
MASS_KG, INERTIA_KGM2, L, R = 20.0, 1.6, 0.25, 0.1
ROBOT = RobotParameters(
    half_track_m=L,
    wheel_radius_m=R,
    mass_kg=MASS_KG,
    yaw_inertia_kgm2=INERTIA_KGM2,
    alpha=1 / (R * MASS_KG),
    alpha_yaw=L**2 / (R * INERTIA_KGM2),
)
EXTENSION = Extension(base_of(ROBOT), wheel_radius_m=R)


def named(name: str, ratio: float) -> FoundEffect:
    return FoundEffect(name, "input", "", {"ratio": Estimate(ratio, (ratio, ratio), "1")}, (), (), 0.0, "")


def turned_by_mass(offset_m: float, force_n: float) -> float:
    """The yaw acceleration of a rigid body whose mass lies to the left, pushed ahead at both wheels alike:
    Newton's and Euler's equations for the three unknowns, the tyres holding the axle sideways.
    """
    about_mass = INERTIA_KGM2 - MASS_KG * offset_m**2
    # unknowns: dv/dt of the axle's middle, yaw acceleration, the tyres' side force
    equations = [[MASS_KG, -MASS_KG * offset_m, 0.0], [0.0, about_mass, 0.0], [0.0, 0.0, 1.0]]
    return float(np.linalg.solve(equations, [force_n, offset_m * force_n, 0.0])[1])


@pytest.mark.parametrize(("ratio", "side"), [(0.08, "left"), (-0.08, "right")])
def test_the_mass_that_is_said_turns_the_robot_as_the_imbalance(ratio, side):
    (note,) = sideways_mass([named("torque_imbalance", ratio)], EXTENSION)
    assert f"m to the {side} of the middle" in note
    size_m = float(note.split(" m to the")[0].split()[-1])
    offset_m = size_m if side == "left" else -size_m
    both_nm = 3.0
    by_torques = L / R * 2 * ratio * both_nm / INERTIA_KGM2
    assert turned_by_mass(offset_m, 2 * both_nm / R) == pytest.approx(by_torques, rel=0.05)


def test_no_mass_is_said_for_another_effect_nor_one_outside_of_the_wheels():
    assert not list(sideways_mass([named("drive_gain", 0.1)], EXTENSION))
    assert list(sideways_mass([named("torque_imbalance", 0.9)], EXTENSION))
    light = RobotParameters(half_track_m=L, alpha=0.5, alpha_yaw=1.5, mass_kg=1.0, yaw_inertia_kgm2=1.0)
    narrow = Extension(base_of(light))
    assert not list(sideways_mass([named("torque_imbalance", 0.9)], narrow))


def sized(name: str, key: str, value: float, sd: float = 0.003) -> FoundEffect:
    interval = (value - 2 * sd, value + 2 * sd)
    return FoundEffect(name, "input", "", {key: Estimate(value, interval, "")}, (), (), 0.0, "")


@pytest.mark.parametrize(
    ("left", "right", "said"),
    [
        (1.0, 0.85, "the right side alone: -15.0% of its torque"),
        (1.2, 1.0, "the left side alone: +20.0% of its torque"),
        (1.1, 0.9, ""),
        (0.95, 0.85, ""),
    ],
)
def test_a_gain_and_an_imbalance_may_be_one_side_alone(left, right, said):
    gain, ratio = (left + right) / 2, (right - left) / (right + left)
    effects = [sized("drive_gain", "ratio", gain - 1), sized("torque_imbalance", "ratio", ratio)]
    assert "".join(one_side(effects, OWN)).endswith(said)
    assert bool(list(one_side(effects, OWN))) is bool(said)
    assert not list(one_side(effects[:1], OWN))


@pytest.mark.parametrize(
    ("left", "right", "said"), [(0.7, 0.0, "the left side alone: +0.7 N·m"), (0.3, 0.5, "")]
)
def test_two_biases_may_be_one_side_alone(left, right, said):
    effects = [
        sized("torque_bias_common", "bias_nm", (left + right) / 2),
        sized("torque_bias_differential", "bias_nm", (right - left) / 2),
    ]
    assert "".join(one_side(effects, OWN)).endswith(said)
    assert bool(list(one_side(effects, OWN))) is bool(said)


def test_a_weight_as_far_out_as_the_robots_mass_is_said_of_a_weaker_drive():
    """Newton's and Euler's equations of the robot with 30 % more of both, against weaker motors."""
    both_nm, apart_nm = 3.0, 2.0
    ahead = [both_nm / R / mass_kg for mass_kg in (MASS_KG, 1.3 * MASS_KG)]
    turning = [L * apart_nm / R / inertia_kgm2 for inertia_kgm2 in (INERTIA_KGM2, 1.3 * INERTIA_KGM2)]
    ratio = ahead[1] / ahead[0] - 1
    assert turning[1] / turning[0] - 1 == pytest.approx(ratio)
    (note,) = wide_weight([named("drive_gain", ratio)])
    assert "a payload and a yaw_inertia of 30% each" in note
    assert not list(wide_weight([named("drive_gain", 0.2)]))
    assert not list(wide_weight([named("drive_gain", ratio), named("payload", 0.1)]))
    assert not list(wide_weight([named("torque_imbalance", ratio)]))

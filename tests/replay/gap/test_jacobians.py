"""The closed-form Jacobians of the gap analysis's step and measurement against finite differences."""

from itertools import product

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from wmr_replay.effects.motion import is_held
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap.model.dynamics import (
    N_MOTION,
    N_ROW,
    N_STATE,
    Base,
    Row,
    V,
    W,
    halfway,
    heading,
    measured,
    responses,
    step,
)
from wmr_replay.gap.model.jacobians import jacobian, slopes_of_measurement

SPEEDS_MPS = (0.0, 0.7)
LARGEST = {
    Theta.ROLLING: 0.3,
    Theta.SCRUB: 0.3,
    Theta.WHEEL_COULOMB: 0.3,
    Theta.SUPPORT: 0.3,
    Theta.SUPPORT_YAW: 0.3,
    Theta.UNDECLARED: 2.0,
    Theta.HELD_SIDEWAYS: 1.0,
}
POSITIVE = {Theta.UNDECLARED, Theta.HELD_SIDEWAYS, Theta.SWIVEL, Theta.SUPPORT, Theta.SUPPORT_YAW}
LEAST = {Theta.FRICTION_SPEED: 0.01}


def numbers(n, largest):
    """``n`` numbers within ±``largest``."""
    return st.lists(st.floats(-largest, largest), min_size=n, max_size=n).map(np.array)


@st.composite
def thetas(draw):
    """Parameters of one to four effects."""
    theta = np.zeros(N_THETA)
    for place in draw(st.lists(st.sampled_from(Theta), max_size=4, unique=True)):
        size = LARGEST.get(place, 0.4)
        least = LEAST.get(place, 0.0 if place in POSITIVE else -size)
        theta[place] = draw(st.floats(least, size))
    return theta


@st.composite
def rows(draw):
    """A step's inputs, in any mode, with v_lat held or loose."""
    row = np.zeros(N_ROW)
    row[Row.DT] = draw(st.floats(0.005, 0.08))
    row[[Row.LEFT, Row.RIGHT]] = draw(numbers(2, 3.0))
    row[Row.MODE] = draw(st.sampled_from([0.0, 1.0, 2.0, 3.0]))
    row[Row.LOAD : Row.LOOSE] = draw(st.floats(0.0, 1.0))
    row[Row.LOOSE] = draw(st.sampled_from([0.0, 0.1]))
    row[[Row.LONG_BY_V, Row.LONG_BY_W, Row.YAW_BY_V, Row.YAW_BY_W]] = draw(numbers(4, 3.0))
    return row


def bases(speed_mps, skid_decay_mps2):
    """A base model whose skids decay by the speed, or by a fixed one."""
    return Base(0.28, 0.34, 0.25, skid_decay_mps2, speed_mps, 0.25, 0.2, 5.0, 5.0)


def differences(function, z, n, size=1e-4):
    """Slopes (n, 9) of ``function(z, out)``: central differences of fourth order."""
    slopes, out = np.zeros((n, N_STATE)), np.zeros(n)
    for j in range(N_STATE):
        for k, weight in ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)):
            moved = z.copy()
            moved[j] += k * size
            function(moved, out)
            slopes[:, j] += weight / size * out
    return slopes


def fill_jacobian(z, row, theta, base, F):
    """``F`` ← the Jacobian of the step from ``z``."""
    moved, middle, gains = np.zeros(N_STATE), np.zeros(N_STATE), responses(row, theta, base)
    step(z, row, theta, base, moved)
    halfway(z, gains, row, theta, base, middle)
    jacobian(z, gains, row, theta, base, moved, middle, heading(middle), F)


@settings(max_examples=300, deadline=None)
@given(numbers(N_STATE, 2.0), rows(), thetas(), st.sampled_from(SPEEDS_MPS), st.sampled_from([0.0, 0.3, 8.0]))
def test_the_jacobian_is_the_slope_of_a_step(z, row, theta, speed_mps, skid_decay_mps2):
    base = bases(speed_mps, skid_decay_mps2)
    moved, F = np.zeros(N_STATE), np.zeros((N_STATE, N_STATE))
    step(z, row, theta, base, moved)
    mean = (z + moved) / 2
    for v_lat in (z[5], 0.0):  # away from where the decay's speed stops being held at its least
        assume(abs(np.sqrt(mean[V] ** 2 + v_lat**2 + mean[W] ** 2) - 0.3) > 1e-3)
    assume(abs(z[V]) > 1e-3 and abs(mean[V]) > 1e-3)
    corners = product((-1e-3, 0.0, 1e-3), repeat=2)  # away from where friction begins to hold
    assume(len({is_held(z[V] + by, z[W] + turn, theta) for by, turn in corners}) == 1)
    for at in (z + 0.5, z):  # an earlier Jacobian, its disturbances decayed, leaves nothing behind
        fill_jacobian(at, row, theta, base, F)
        F[N_MOTION:] *= 1.0 if at is z else 0.5
    expected = differences(lambda at, out: step(at, row, theta, base, out), z, N_STATE)
    np.testing.assert_allclose(F, expected, rtol=1e-6, atol=2e-7)


@given(numbers(N_STATE, 3.0), rows(), thetas(), numbers(2, 0.5))
def test_the_slopes_of_a_measurement_are_those_of_the_measured_pose(z, row, theta, arm_m):
    theta[[Theta.ARM_X, Theta.ARM_Y]] = arm_m
    H = np.full((3, 3), np.nan)
    slopes_of_measurement(z, theta, H)
    expected = differences(lambda at, out: measured(at, row, theta, out), z, 3)
    np.testing.assert_allclose(H, expected[:, :3], atol=1e-8)
    np.testing.assert_allclose(expected[:, 3:], 0.0, atol=1e-8)

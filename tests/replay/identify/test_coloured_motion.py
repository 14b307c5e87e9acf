"""Deviations under coloured noise: the propagation of errors, written out as matrices."""

import numpy as np

from wmr_replay.identify.coloured_motion import Deviations
from wmr_replay.identify.motion import Derived, motion_of

PAIRS = ((0, 0), (0, 1), (1, 1), (2, 2))


def some_rows(n, seed=3):
    """Estimates, covariance factors and variances of n rows, none of them 0."""
    rng = np.random.default_rng(seed)
    roots = rng.normal(size=(n, 3, 3))
    gains = np.moveaxis(roots @ roots.transpose(0, 2, 1), 0, -1)
    gains[0, 2] = gains[2, 0] = gains[1, 2] = gains[2, 1] = 0.0  # no formula has them
    return rng.normal(size=(3, 3, n)), gains, rng.uniform(0.1, 2.0, (2, n))


def propagated(estimates, factors, biases):
    """Deviations (5,) of one row: the Jacobian of the motion by x, y, yaw and their derivatives, times their
    covariance. ``factors`` (2, 3, 3) of position and yaw already hold the variances.
    """

    def motion(z):
        (_, vx, ax), (_, vy, ay), (yaw, rate, turn) = z.reshape(3, 3)
        cos, sin = np.cos(yaw), np.sin(yaw)
        v_lat = vy * cos - vx * sin
        return np.array([vx * cos + vy * sin, v_lat, rate, ax * cos + ay * sin + rate * v_lat, turn])

    z, step = estimates.ravel(), 1e-6
    jacobian = np.stack(
        [(motion(z + step * e) - motion(z - step * e)) / (2 * step) for e in np.eye(9)], axis=1
    )
    covariance = np.zeros((9, 9))
    for k, which in enumerate((0, 0, 1)):
        block = slice(3 * k, 3 * k + 3)
        covariance[block, block] = factors[which] + np.diag(biases[which])
    return np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))


def test_deviations_are_those_of_propagated_errors():
    n, rng = 12, np.random.default_rng(8)
    estimates, gains, variances = some_rows(n)
    derived = Derived.of(estimates, gains, variances)
    motion = motion_of(derived)
    noises = np.concatenate([rng.uniform(0.5, 3.0, (2, 4)), rng.uniform(0.0, 0.5, (2, 3))], axis=1)
    noises[:, 1] = 0.1
    found = Deviations(motion, derived)
    found.widen(slice(3, 9), noises)
    for i in range(n):
        if not 3 <= i < 9:
            assert [sd[i] for sd in found.motion[5:]] == [sd[i] for sd in motion[5:]]
            continue
        factors = np.zeros((2, 3, 3))
        for which in range(2):
            for k, (a, b) in enumerate(PAIRS):
                factors[which, a, b] = factors[which, b, a] = (
                    noises[which, k] * variances[which, i] * gains[a, b, i]
                )
        expected = propagated(estimates[:, :, i], factors, noises[:, 4:])
        np.testing.assert_allclose([sd[i] for sd in found.motion[5:]], expected, rtol=1e-5)


def test_white_noise_without_bias_leaves_the_deviations_as_they_are():
    derived = Derived.of(*some_rows(20))
    motion = motion_of(derived)
    found = Deviations(motion, derived)
    found.widen(slice(0, 20), np.tile([1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (2, 1)))
    np.testing.assert_allclose(found.motion, motion, rtol=1e-14)

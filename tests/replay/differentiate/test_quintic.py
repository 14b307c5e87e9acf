"""The quintic spline against scipy's, and scipy's LAPACK with and without its package."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.special import eval_jacobi, gammaln

from wmr_replay.differentiate.kernel import jacobi_norm, jacobi_values
from wmr_replay.differentiate.quintic import through


def stamps(n: int, *, even: bool) -> np.ndarray:
    steps = np.full(n, 0.01) if even else np.random.default_rng(n).uniform(0.005, 0.015, n)
    return np.cumsum(steps)


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("n", [6, 7, 60, 800])
def test_the_spline_and_its_derivatives_are_scipys(n, even):
    t = stamps(n, even=even)
    values = np.random.default_rng(0).standard_normal((n, 3))
    within = np.concatenate([t[0] + np.array([-0.03, -0.001]), t, t[:-1] + 0.003, t[-1] + np.array([0.02])])
    for ours, column in zip(through(t, values), values.T, strict=True):
        theirs = make_interp_spline(t, column, 5)
        for order in range(4):
            expected = theirs(within, order)
            scale = np.abs(expected).max()
            np.testing.assert_allclose(ours(within, order), expected, rtol=0, atol=1e-12 * scale)
            np.testing.assert_array_equal(ours.scaled(2.0)(within, order), 2 * ours(within, order))


def test_a_polynomial_of_degree_five_comes_back_with_its_slopes():
    t = stamps(40, even=False)
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    (spline,) = through(t, polynomial(t)[:, None])
    at = t[:-1] + 0.002
    for order, tolerance in ((0, 1e-12), (1, 1e-9), (2, 1e-6)):
        expected = polynomial.deriv(order)(at) if order else polynomial(at)
        np.testing.assert_allclose(spline(at, order), expected, atol=tolerance)


def test_jacobi_polynomials_and_their_norms_are_scipys():
    u = np.linspace(-1, 1, 41)
    for i, a, b in np.ndindex(9, 10, 10):
        expected = eval_jacobi(i, a, b, u)
        np.testing.assert_allclose(jacobi_values(i, a, b, u), expected, atol=1e-13 * np.abs(expected).max())
        logs = gammaln(i + a + 1) + gammaln(i + b + 1) - gammaln(i + a + b + 1) - gammaln(i + 1)
        norm = 2.0 ** (a + b + 1) / (2 * i + a + b + 1) * np.exp(logs)
        assert jacobi_norm(i, a, b) == pytest.approx(norm, rel=1e-12)


BOTH = """
import sys
import numpy as np
from wmr_schemas.lapack import routines
matrix, right = np.random.default_rng(0).standard_normal((2, 5, 5))
alone = routines("_flapack").dgesv(matrix, right)[2], routines("_fblas").dgemm(1.0, matrix, right)
assert "scipy.linalg" not in sys.modules
from scipy.linalg import blas, lapack, solve
assert np.array_equal(lapack.dgesv(matrix, right)[2], alone[0])
assert np.array_equal(blas.dgemm(1.0, matrix, right), alone[1])
assert np.allclose(solve(matrix, right), alone[0])
"""
PACKAGE = """
from importlib.machinery import PathFinder
PathFinder.find_spec = classmethod(lambda cls, name, path=None, target=None, find=PathFinder.find_spec:
    None if name.endswith("_flapack") and "scipy.linalg" not in sys.modules else find(name, path, target))
import sys
from wmr_schemas.lapack import routines
assert routines("_flapack").dgesv([[2.0]], [[4.0]])[2] == 2.0
assert "scipy.linalg" in sys.modules
"""


@pytest.mark.parametrize("script", [BOTH, PACKAGE], ids=["alone", "not found alone"])
def test_lapack_is_the_packages(script):
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr

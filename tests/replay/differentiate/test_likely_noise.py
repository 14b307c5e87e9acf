"""What an unsure colour counts as; the mean squares are those of the sources by hand, or of drawn noise."""

import numpy as np
import pytest

from wmr_replay.differentiate.colour import EVIDENCE, TIMES_S, Scales, colour_of, explanations, shapes_of
from wmr_replay.differentiate.likely_noise import FORGOTTEN_S, UNKNOWN, likely_noise

STEP_S = 0.01


def seen(white, wobble, at):
    """Shapes, and the mean squares of white noise and of a wobble that lasts for ``TIMES_S[at]``."""
    shapes = shapes_of([scale.b for scale in Scales(STEP_S).scales], STEP_S)
    return shapes, white * shapes[at, :, 0] + wobble * shapes[at, :, 1]


@pytest.mark.parametrize("at", [1, 2, 3])
def test_a_wobble_that_is_sure_counts_by_its_density(at):
    shapes, squares = seen(1e-4, 1e-4, at)
    found = likely_noise(explanations(np.full(len(squares), 500.0), squares, shapes), STEP_S)
    lasts = 2 * TIMES_S[at] / (1 + (TIMES_S[at] / FORGOTTEN_S) ** 2) / STEP_S
    assert found.as_white == pytest.approx(1e-4 * (1 + lasts), rel=0.3)
    assert found.factor == pytest.approx(found.as_white / squares[0])


def test_white_noise_counts_as_itself():
    shapes, squares = seen(1e-4, 0.0, 0)
    found = likely_noise(explanations(np.full(len(squares), 500.0), squares, shapes), STEP_S)
    assert found.as_white == pytest.approx(1e-4, rel=0.05)
    assert found.wobble < 1e-5


def test_a_wobble_that_is_not_sure_counts():
    """Few differences are no evidence of a wobble, and yet it is likelier than none."""
    shapes, squares = seen(1e-4, 3e-5, 2)
    n = np.full(len(squares), 9.0)
    explained = explanations(n, squares, shapes)
    assert 0 < colour_of(explained).evidence < EVIDENCE
    assert likely_noise(explained, STEP_S).factor > 2.0


def test_too_few_differences_say_nothing():
    shapes, squares = seen(1e-4, 0.0, 0)
    few = explanations(np.full(len(squares), 2.0), squares, shapes)
    assert few is None
    assert likely_noise(few, STEP_S) == UNKNOWN
    assert UNKNOWN.factor == 1.0

"""A drive as a list of parts: lengths, speeds and yaw rates, with ramps between."""

import numpy as np

from wmr_synth.driving.drivers import Waypoints
from wmr_synth.driving.patrol import ramped

Rng = np.random.Generator
Range = tuple[float, float]


def in_parts(
    parts: list[tuple[float, float, float]],
    rng: Rng,
    by_mps2: Range = (0.5, 1.3),
    by_radps2: Range = (0.8, 2.2),
) -> Waypoints:
    """Lengths in s, speeds in m/s and yaw rates in rad/s, with ramps drawn once from the two ranges."""
    lengths, speed, turning = np.array(parts).T
    rates = np.full(len(parts), rng.uniform(*by_mps2)), np.full(len(parts), rng.uniform(*by_radps2))
    return ramped(lengths, (speed, turning), rates)

"""One step of a variance that is tracked over squares with outliers among them.

Squares are clipped at nine times the present variance: outliers and switches of the mode count little. The
mean of the clipped squares of white noise is b = E[min(z², 9)] of its variance, z standard normal.
"""

from wmr_schemas.compiled import compiled

CLIPPED_AT = 9.0
"""Three standard deviations, squared."""
CLIPPED_MEAN = 0.9950072780344535
"""b = 1 + 16 Q(3) − 6 φ(3), with the tail probability Q and the density φ of a standard normal."""
PER_CLIPPED_MEAN = 1 / CLIPPED_MEAN


@compiled
def clipped_update(variance: float, square: float, gain: float) -> float:
    """s² + g (min(d², 9 s²)/b − s²), from the variance s², the new square d² and the gain g in 0 to 1."""
    return variance + gain * (min(square, CLIPPED_AT * variance) * PER_CLIPPED_MEAN - variance)

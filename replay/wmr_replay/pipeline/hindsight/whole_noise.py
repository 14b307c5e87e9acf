"""Variances of the first pass's bins with the colour of the noise that the whole log shows.

The first pass multiplies a row's tracked variances by factors for the colour that is likely by then: none in
the first seconds, uncertain ones for long. The second pass has those of the whole log for every bin where
they are larger.
"""

from collections.abc import Sequence

import numpy as np

from wmr_replay.identify.filter_bank.bins import Bins
from wmr_replay.pipeline.colour import PoseColour

POSITION_AND_YAW = [0, 0, 1]
"""Which factor the variances of x, y and yaw take."""


class WholeNoise:
    """What the looks at the colour of a log, one :class:`PoseColour` for each rate of the pose, end with."""

    def __init__(self, colours: Sequence[PoseColour]) -> None:
        parts = [colour.in_hindsight() for colour in colours]
        self._since_ns = np.concatenate([since_ns for since_ns, _ in parts])
        self._ratios = np.concatenate([ratios for _, ratios in parts])

    def told(self, bins: Bins) -> Bins:
        """The bins (m,) with variances of x, y and yaw raised to what the whole log shows."""
        at = np.maximum(np.searchsorted(self._since_ns, bins.stamps, side="right") - 1, 0)
        values = bins.values.copy()
        values[3:6] *= self._ratios[at][:, POSITION_AND_YAW].T
        return Bins(values, bins.stamps)

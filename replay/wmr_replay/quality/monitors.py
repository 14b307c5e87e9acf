"""All monitors as one stage."""

from collections.abc import Sequence

import numpy as np

from wmr_replay.quality.clock_offset import ClockOffset
from wmr_replay.quality.heading import HeadingMonitor
from wmr_replay.quality.interface import Monitor, Observed
from wmr_replay.quality.noise_colour import NoiseColour
from wmr_replay.quality.plausibility import PlausibilityMonitor
from wmr_schemas.arrays import I8
from wmr_schemas.findings import Finding, without_explained
from wmr_schemas.status import Status


def default_monitors() -> list[Monitor]:
    """Every monitor, the one whose status goes first in front."""
    return [
        ClockOffset(),
        HeadingMonitor(),
        NoiseColour(),
        PlausibilityMonitor(),
    ]


class Quality:
    """Stage: rows → the status that bars each of them, by the first monitor that bars it."""

    def __init__(self, monitors: Sequence[Monitor] | None = None) -> None:
        self._monitors = default_monitors() if monitors is None else list(monitors)

    def push(self, rows: Observed) -> I8:
        """The status (n,) that bars each row, ``OK`` where nothing does."""
        barred = np.full(len(rows.t_ns), Status.OK, np.int8)
        for monitor in self._monitors:
            found = monitor.push(rows)
            barred = np.where(barred == Status.OK, found, barred).astype(np.int8)
        return barred

    def findings(self) -> list[Finding]:
        """What was found so far, without what another finding explains."""
        return without_explained(found for monitor in self._monitors for found in monitor.findings())

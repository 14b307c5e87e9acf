"""All monitors as one stage."""

from collections.abc import Mapping, Sequence

import numpy as np

from wmr_replay.quality.clock_offset import ClockOffset
from wmr_replay.quality.heading import HeadingMonitor
from wmr_replay.quality.interface import Monitor, Observed
from wmr_replay.quality.noise_colour import NoiseColour
from wmr_replay.quality.plausibility import PlausibilityMonitor
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_schemas.arrays import I8, Bool
from wmr_schemas.findings import KINDS, Finding, without_explained
from wmr_schemas.status import Status


def default_monitors(sums: Sums = PLAIN) -> list[Monitor]:
    """Every monitor, the one whose status goes first in front."""
    return [
        ClockOffset(),
        HeadingMonitor(sums),
        NoiseColour(sums),
        PlausibilityMonitor(sums),
    ]


class Quality:
    """Stage: rows → the status that bars each of them.

    It is that of the first monitor that bars the row; where the row is barred by the cause of that monitor's
    finding, too, it is the cause's.
    """

    def __init__(self, monitors: Sequence[Monitor] | None = None) -> None:
        self._monitors = default_monitors() if monitors is None else list(monitors)

    def push(self, rows: Observed) -> I8:
        """The status (n,) that bars each row, ``OK`` where nothing does."""
        every = [(monitor.push(rows), monitor.barred) for monitor in self._monitors]
        barred = np.full(len(rows.t_ns), Status.OK, np.int8)
        if not any((found != Status.OK).any() for found, _ in every):
            return barred
        decided, masks = np.zeros(len(barred), bool), dict[str, Bool]()
        for found, marked in every:
            barred = np.where(barred == Status.OK, found, barred).astype(np.int8)
            if not marked:
                decided |= barred != Status.OK
            masks |= marked
        return with_causes(barred, masks, ~decided)

    def findings(self) -> list[Finding]:
        """What was found so far, without what another finding explains."""
        return without_explained(found for monitor in self._monitors for found in monitor.findings())


def with_causes(barred: I8, masks: Mapping[str, Bool], open_rows: Bool) -> I8:
    """Statuses (n,) with that of the cause in place of what it explains, among the ``open_rows`` (n,).

    ``masks``: by code which rows its finding bars.
    """
    for code, marked in masks.items():
        for cause in KINDS[code].explained_by:
            status = KINDS[cause].bars
            if cause not in masks or status is None:
                continue
            both = open_rows & marked & masks[cause] & (barred == KINDS[code].bars)
            barred = np.where(both, status, barred).astype(np.int8)
    return barred

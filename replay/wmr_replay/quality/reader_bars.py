"""Bars that the reader sets: findings in messages and names that no column shows."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from wmr_replay.quality.interface import Observed
from wmr_schemas.arrays import I8, Bool
from wmr_schemas.batches import Bar
from wmr_schemas.findings import Finding
from wmr_schemas.status import Status


class ReaderBars:
    """Monitor: the status that the reader's latest bar gives each row; the reader states the findings."""

    barred: Mapping[str, Bool] = MappingProxyType({})

    def __init__(self) -> None:
        self._bars: dict[str, list[Bar]] = {}

    def take(self, bars: tuple[Bar, ...]) -> None:
        """Further bars, those of one code by their stamps."""
        for bar in bars:
            self._bars.setdefault(bar.code, []).append(bar)

    def push(self, rows: Observed) -> I8:
        """The status (n,) that bars each row, ``OK`` where nothing does."""
        barred = np.full(len(rows.t_ns), Status.OK, np.int8)
        for bars in self._bars.values():
            after = np.array([bar.after_ns for bar in bars])
            status = np.array([Status.OK, *(bar.status for bar in bars)], np.int8)
            found = status[np.searchsorted(after, rows.t_ns, side="left")]
            barred = np.where(barred == Status.OK, found, barred).astype(np.int8)
        return barred

    def findings(self) -> list[Finding]:
        """None: the reader states them."""
        return []

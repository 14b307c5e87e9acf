"""Whether the noise of the pose is correlated in time.

Third differences x_i − 3 x_{i−m} + 3 x_{i−2m} − x_{i−3m}, whose mean square over 20 is the variance of white
noise, are taken over more and more steps m. White noise gives the same at every m. Noise that is correlated
gives more at longer steps, by a factor of 2 to 4 at most for each doubling, and then levels off. Motion gives
more too, but by a factor of 8 (velocity in steps) to 64 (smooth) for each doubling. Where the wheels stand
still no motion disturbs, and longer steps are looked at.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from wmr_replay.quality.interface import Observed
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.status import Status


@dataclass(frozen=True)
class ColourRules:
    """When noise is coloured."""

    longest_moving_s: float = 0.16
    """Longest step in motion: skids set in within .1 s, and motion levels off beyond."""
    longest_resting_s: float = 2.0
    """Longest step where the wheels stand still."""
    rest_radps: float = 0.01
    """Wheels that turn more slowly stand still."""
    excess: float = 1.8
    """Variance over longer steps in that over single ones: a third more deviation."""
    growth: float = 4.0
    """For a further doubling; motion gives 8 and more, and (1 + .8·8)/1.8 = 4.1 where it is just seen."""
    least_spans: float = 40.0
    """Independent differences: their variance is known to 22 %."""
    scatter_sd: float = 3.0
    """Standard deviations of that variance on top of the excess."""
    least_m: float = 2e-5
    least_rad: float = 2e-5
    """Smaller noise is none of a pose: rounding, or a simulation without noise."""


RULES = ColourRules()


class Level(NamedTuple):
    """Variance of position in m² and yaw in rad² over steps of ``m`` rows, of ``n`` differences."""

    m: int
    n: float
    position: float
    yaw: float


class Differences:
    """Sums of squared third differences over steps of m rows, at every (m/4)-th row."""

    def __init__(self, m: int, step_ns: float, sums: Sums) -> None:
        self._add_differences = sums.add_differences
        self.m, self._stride, self._step_ns = m, max(m // 4, 1), m * step_ns
        self._sums = np.zeros(3)

    def add(self, columns: F64, n_old: int, first: int, usable_s: F64) -> None:
        """Rows t, x, y, yaw (4, n) of which the last from ``n_old`` on are new; ``first`` is the ordinal of
        column 0, ``usable_s`` (n,) for how long each row has been usable.
        """
        begin = max(n_old, 3 * self.m)
        begin += -(begin + first) % self._stride
        self._add_differences(columns, usable_s, (begin, self._stride, self.m), self._step_ns, self._sums)

    @property
    def level(self) -> Level:
        """The variances so far."""
        n, position, yaw = self._sums.tolist()
        return Level(self.m, n * self._stride / self.m, position / max(n, 1.0), yaw / max(n, 1.0))


class NoiseColour:
    """Monitor: bars nothing; finds noise of the pose that is correlated in time."""

    barred: Mapping[str, Bool] = MappingProxyType({})

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._sums, self._step_s = sums, np.nan
        self._moving: list[Differences] = []
        self._resting: list[Differences] = []
        self._held = np.empty((4, 0))
        self._rest_s = np.empty(0)
        self._n = 0

    def push(self, rows: Observed) -> I8:
        """``OK`` for each of n rows."""
        if np.isnan(self._step_s) and len(rows.t_ns) > 1:
            self._begin(rows.t_ns)
        if self._moving:
            self._add(rows)
        return np.full(len(rows.t_ns), Status.OK, np.int8)

    def _begin(self, t_ns: I64) -> None:
        """The first rows are those of the initial stretch, whatever the batches; they tell the step."""
        step_ns = float(np.median(np.diff(t_ns)))
        self._step_s, self._start_ns = step_ns / NS_PER_S, int(t_ns[0])
        moving, resting = (
            [Differences(m, step_ns, self._sums) for m in doublings(longest_s / self._step_s)]
            for longest_s in (RULES.longest_moving_s, RULES.longest_resting_s)
        )
        self._moving, self._resting = moving, resting

    def _add(self, rows: Observed) -> None:
        """Take up the next rows."""
        new = np.stack([(rows.t_ns - self._start_ns).astype(np.float64), *rows.pose])
        n_old = self._held.shape[1]
        columns = np.concatenate([self._held, new], axis=1)
        rest_s = np.concatenate([self._rest_s, self._rested(rows)])
        first = self._n - n_old
        always = np.full(len(rest_s), np.inf)
        for each in self._moving:
            each.add(columns, n_old, first, always)
        if (rest_s[n_old:] > 0).any():
            for each in self._resting:
                each.add(columns, n_old, first, rest_s)
        self._n += len(rows.t_ns)
        kept = 3 * max(self._moving[-1].m, self._resting[-1].m)
        self._held, self._rest_s = columns[:, -kept:], rest_s[-kept:]

    def _rested(self, rows: Observed) -> F64:
        """For how long (n,) the wheels have stood still."""
        with np.errstate(invalid="ignore"):
            still = np.asarray((np.abs(rows.inputs[2:]) <= RULES.rest_radps).all(axis=0))
        if not still.any():
            return np.zeros(len(still))
        before = float(self._rest_s[-1]) if len(self._rest_s) else 0.0
        since = rows.t_s[0] - before if len(rows.t_s) else 0.0
        moved_s = np.maximum.accumulate(np.where(still, since, rows.t_s))
        return np.where(still, rows.t_s - moved_s, 0.0)

    def findings(self) -> list[Finding]:
        """What was found so far."""
        texts = [
            text
            for levels, how in ((self._moving, ""), (self._resting, " at rest"))
            for name, unit, least in (("position", "mm", RULES.least_m), ("yaw", "mrad", RULES.least_rad))
            if (text := self._text([each.level for each in levels], name, unit, least, how))
        ]
        return [finding("coloured_noise", Severity.WARNING, "; ".join(texts))] if texts else []

    def _text(self, levels: list[Level], name: str, unit: str, least: float, how: str) -> str:
        """Size and duration of coloured noise of one signal; empty where it is white."""
        found = colour_of(levels, name, least)
        if found is None:
            return ""
        m, single, longer = found
        sizes = f"{1e3 * single:.2g} {unit} from one pose to the next, {1e3 * longer:.2g} {unit}"
        return f"the {name}'s noise{how} is {sizes} over {m * self._step_s:.2g} s"


def doublings(most: float) -> list[int]:
    """1, 2, 4 … up to ``most``."""
    return [1 << k for k in range(int(np.log2(max(most, 1.0)) + 1e-9) + 1)]


def colour_of(levels: list[Level], name: str, least: float) -> tuple[int, float, float] | None:
    """Rows over which noise is correlated, and its deviation over one row and over these; None where it is
    white, or too little is known.
    """
    known = [level for level in levels if level.n >= RULES.least_spans]
    variance = [level.position if name == "position" else level.yaw for level in known]
    found = None
    for k in range(1, len(known) - 1):
        excess = RULES.excess * (1 + RULES.scatter_sd * np.sqrt(2 / known[k + 1].n))
        exceeds = variance[k] >= excess * variance[0] > 0 and variance[k] >= least**2
        if exceeds and variance[k + 1] <= RULES.growth * variance[k]:
            found = known[k].m, float(np.sqrt(variance[0])), float(np.sqrt(variance[k]))
    return found

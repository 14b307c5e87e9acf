"""Whether the pose moves as a robot on the ground does: roll, pitch and height of ten poses a second.

A tracker that is mounted askew shows a constant tilt, which is no fault here: the world's upright axis, seen
in the body's frame, then stays where it is. A camera in a hand and a flying tracker tilt to and fro, or rise
and sink as much as they go ahead.
"""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.batches import Bar
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.running_sums import LastEntries, RunningSums
from wmr_schemas.status import Status

CODE = "pose_not_planar"


@dataclass(frozen=True)
class PlanarRules:
    """When a pose is none of a robot on the ground."""

    cell_ns: int = NS_PER_S // 10
    """Poses are looked at ten times a second: hands and propellers tilt at 1 Hz."""
    n_last: int = 200
    """Poses looked back on, 20 s: long enough for several tilts."""
    least: float = 50.0
    """Poses before a verdict, 5 s."""
    tilt_rad: float = float(np.radians(20.0))
    """Tilt about its mean (rms). Ramps of 20° up and down, half of the time each, reach it at most; hands and
    the trackers of acrobats pass 25°."""
    level_rad: float = float(np.radians(10.0))
    """Below it the pose is planar again."""
    lag: int = 10
    """Heights are compared over a second."""
    climb_m: float = 0.1
    """Mean change of height within a second."""
    climb_share: float = 0.7
    """Mean change of height in that of place: 35°, which no wheel climbs."""
    level_share: float = 0.35
    """Below it the pose is planar again."""
    over_noise: float = 3.0
    """Change of height over a second against that over a tenth: 1 for noise, 10 for a steady climb."""


RULES = PlanarRules()


class Planarity:
    """Stage: ``choose`` rows, then ``push`` what they show; ``take_bars`` gives what changed since."""

    def __init__(self) -> None:
        self._cell, self._newest_ns = -1, np.iinfo(np.int64).min
        self._sums = RunningSums(7, RULES.n_last)
        self._second, self._tenth = LastEntries(3, RULES.lag), LastEntries(3, 1)
        self._bars: list[Bar] = []
        self._barred = False
        self._texts: list[str] = []
        self._n = 0

    def choose(self, t_ns: I64) -> I64:
        """Indices of those of the next n rows that are looked at: the first of each tenth of a second."""
        cells = t_ns // RULES.cell_ns
        chosen = np.flatnonzero(np.diff(np.concatenate([[self._cell], cells])) != 0)
        if len(cells):
            self._cell = int(cells[-1])
        return chosen

    def push(self, t_ns: I64, chosen: I64, columns: F64) -> None:
        """Stamps (n,) of the next rows; of the ``chosen`` k the upright axis, height, x and y (6, k)."""
        newest = np.maximum(np.maximum.accumulate(t_ns), self._newest_ns) if len(t_ns) else t_ns
        if len(newest):
            self._newest_ns = int(newest[-1])
        known = np.isfinite(columns).all(axis=0)
        columns, chosen = columns[:, known], chosen[known]
        tilt_rad, climb_m, place_m, over_noise, n = self._statistics(columns)
        r = RULES
        tilts = (n >= r.least) & (tilt_rad >= r.tilt_rad)
        climbs = (n >= r.least) & (climb_m >= np.maximum(r.climb_m, r.climb_share * place_m))
        climbs &= over_noise >= r.over_noise
        level = (tilt_rad <= r.level_rad) & (climb_m <= np.maximum(r.climb_m, r.level_share * place_m))
        self._keep(newest[chosen], tilts, climbs, level, (tilt_rad, climb_m, place_m))

    def _statistics(self, columns: F64) -> tuple[F64, F64, F64, F64, F64]:
        """Tilt about its mean, mean changes of height and place in a second, the change of height over that
        in a tenth, and the number of poses (k,), over the last ones up to each.
        """
        moved = columns[3:]
        second, tenth = np.abs(moved - self._second.push(moved)), np.abs(moved - self._tenth.push(moved))
        changes = np.nan_to_num([second[0], np.hypot(second[1], second[2]), tenth[0]])
        sums = self._sums.push(np.concatenate([np.ones((1, moved.shape[1])), columns[:3], changes]))
        n = sums[0]
        means = sums[1:] / np.maximum(n, 1.0)
        tilt_rad = np.sqrt(2 * np.maximum(1 - np.sqrt((means[:3] ** 2).sum(axis=0)), 0.0))
        return tilt_rad, means[3], means[4], means[3] / np.maximum(means[5], 1e-9), n

    def _keep(
        self, after_ns: I64, tilts: Bool, climbs: Bool, level: Bool, sizes: tuple[F64, F64, F64]
    ) -> None:
        """Keep a bar where the verdict changes."""
        said = np.where(tilts | climbs, 1, np.where(level, 0, -1))
        told = np.flatnonzero(said >= 0)
        changes = told[np.diff(np.concatenate([[int(self._barred)], said[told]])) != 0]
        for k in changes.tolist():
            self._barred = bool(said[k])
            status = Status.NO_HEADING if self._barred else Status.OK
            self._bars.append(Bar(CODE, int(after_ns[k]), status))
            if self._barred:
                self._n += 1
                self._texts.append(_text(bool(tilts[k]), *(float(size[k]) for size in sizes)))

    def take_bars(self) -> tuple[Bar, ...]:
        """The bars since the last call."""
        bars, self._bars = tuple(self._bars), []
        return bars

    def findings(self) -> list[Finding]:
        """What was found so far."""
        if not self._texts:
            return []
        times = f" ({self._n} times)" if self._n > 1 else ""
        return [finding(CODE, Severity.BARS, self._texts[0] + times)]


def _text(tilts: bool, tilt_rad: float, climb_m: float, place_m: float) -> str:
    """What was found, with its numbers."""
    if tilts:
        return f"roll and pitch vary by {np.degrees(tilt_rad):.0f}° (rms) within 20 s"
    return f"the height changes by {climb_m:.2g} m in a second, the place by {place_m:.2g} m"

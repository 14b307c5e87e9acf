"""By how much the stamps of torques and wheel speeds are off those of the pose, from their correlation.

Wheel speeds are compared with v_long and the yaw rate where there are any: their sum ~ c₀ + c₁ v_long, their
difference ~ c₀ + c₁ yaw rate. Else efforts are, with the accelerations, with drag and with dry friction:
their sum ~ c₀ + c₁ dv_long/dt + c₂ v_long + c₃ sign(v_long), their difference alike with the yaw rate. Drag
has to be among them: the speed lags the acceleration, and would shift the best lag. Both sides pass through
the same window and describe the same instants, see :class:`~wmr_replay.quality.interface.Observed`.

The offset minimises Σ n log(1 − R²) over both pairs. Wheel speeds have one set of coefficients for the log.
Efforts have one for each block of 5 s: wheels that slip pass on a part of the effort, and a block that slips
throughout would blur the others. Nothing is corrected and no row is barred: what is found depends on the log
as a whole.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from wmr_replay.quality.best_lag import best_lag
from wmr_replay.quality.even_grid import EvenGrid
from wmr_replay.quality.interface import Observed
from wmr_replay.quality.lag_costs import BlockCosts, PooledCosts
from wmr_schemas.arrays import F64, I8, I64, Bool
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.status import Status


@dataclass(frozen=True)
class OffsetSettings:
    """Thresholds of the estimate, and why."""

    step_s: float = 0.05
    """Grid. A robot's speeds change within some tenths of a second; the parabola through the best three lags
    resolves a tenth of a step."""

    largest_s: float = 2.5
    """Lags. Offsets up to 2 s lie well inside; larger ones are seen by the log time (clocks_apart)."""

    block_s: float = 5.0
    """Blocks of the jackknife: longer than residuals are correlated, while a minute has a dozen."""

    least_groups: int = 6
    """Fewer blocks, 30 s, give no deviation worth the name."""

    longest_gap_s: float = 0.5
    """Rows further apart are not interpolated."""

    least_s: float = 0.05
    """Smaller offsets are those of transport and of held samples, and change no mode."""

    least_sd: float = 6.0
    """An offset is named beyond so many of its standard deviations: that of a jackknife over six blocks is
    itself known to a third."""

    largest_sd_s: float = 0.1
    """Beyond this the best lag is one among several, as in periodic driving."""

    least_share: float = 0.3
    """R² that one pair reaches at the best lag; below, signals and motion have little in common."""

    least_excess: float = 1.6
    """Standard errors by which every other lag costs more. Of 300 pairs of motion and another log's efforts
    none exceeds 1.4; where they belong together, the least of 300 logs of 180 s is 1.9."""

    delay_s: float = 0.3
    """Below this, `gap` names the offset as a delay."""


DEFAULTS = OffsetSettings()
LEAST_SHOWN_S = 0.001
SPEEDS, EFFORTS = "wheel speeds", "torques"


@dataclass(frozen=True)
class Estimate:
    """Seconds to be added to the stamps of ``signal``, their standard deviation, and the R² of its pairs."""

    signal: str
    offset_s: float
    sd_s: float
    share: float


class ClockOffset:
    """Monitor: the offset between pose and wheel signals over the whole log. It bars no row."""

    barred: Mapping[str, Bool] = MappingProxyType({})

    def __init__(self, settings: OffsetSettings = DEFAULTS) -> None:
        self._settings = settings
        n_lags, n_block = (round(s / settings.step_s) for s in (settings.largest_s, settings.block_s))
        self._grid = EvenGrid(settings.step_s, 8, settings.longest_gap_s)
        self._speeds = [PooledCosts(1, n_lags, n_block) for _ in range(2)]
        self._efforts = [BlockCosts(3, n_lags, n_block) for _ in range(2)]
        self._holds = HeldSamples()

    def push(self, rows: Observed) -> I8:
        """Take rows in; none is barred."""
        self._holds.push(rows.t_s, rows.inputs[2])
        m = rows.motion
        measured = m.v_long_mps, m.yaw_rate_radps, m.a_long_mps2, m.yaw_acc_radps2

        def signals(at: I64) -> F64:
            left_nm, right_nm, left_radps, right_radps = rows.smoothed[:, at]
            sums = left_radps + right_radps, right_radps - left_radps, left_nm + right_nm, right_nm - left_nm
            return np.stack([*(one[at] for one in measured), *sums])

        points = self._grid.push(rows.t_s, signals)
        for k in range(2):
            speed, acceleration, wheels, effort = points[k], points[2 + k], points[4 + k], points[6 + k]
            self._speeds[k].push(speed[None], wheels)
            friction = np.stack([acceleration, speed, np.sign(speed)])
            self._efforts[k].push(friction, np.where(np.isnan(wheels), effort, np.nan))
        return np.full(len(rows.t_ns), Status.OK, np.int8)

    def estimate(self) -> Estimate | None:
        """The offset as far as the log has come; None where it does not tell."""
        speeds = estimated(SPEEDS, self._speeds, self._settings)
        if speeds is not None:
            offset_s = speeds.offset_s + self._holds.delay_s
            return Estimate(speeds.signal, offset_s, speeds.sd_s, speeds.share)
        return estimated(EFFORTS, self._efforts, self._settings)

    def findings(self) -> list[Finding]:
        """The offset, where it is there for certain."""
        found, settings = self.estimate(), self._settings
        if found is None:
            return []
        least_s = max(settings.least_s + self._holds.row_step_s / 2, settings.least_sd * found.sd_s)
        if abs(found.offset_s) < least_s:
            return []
        small = abs(found.offset_s) < settings.delay_s
        text = (
            f"{found.signal} fit the motion best with {found.offset_s:+.3f} ± "
            f"{max(found.sd_s, LEAST_SHOWN_S):.3f} s added "
            "to their stamps"
        )
        advice = f"give --clock-offset {found.offset_s:.3g} if the clocks are the cause"
        advice += "; `gap` names so small an offset as a delay" if small else ", or set them before recording"
        return [finding("clock_offset", Severity.NOTE if small else Severity.WARNING, text, advice=advice)]


def estimated(
    signal: str, pairs: Sequence[PooledCosts | BlockCosts], settings: OffsetSettings
) -> Estimate | None:
    """The best lag of both pairs together, and its jackknife deviation; None where the log does not tell."""
    known = np.logical_and.reduce([pair.known for pair in pairs])
    share = max(pair.share for pair in pairs)
    if np.count_nonzero(known) < settings.least_groups or share < settings.least_share:
        return None
    costs: F64 = np.sum([pair.costs() for pair in pairs], axis=0)
    best = best_lag(costs, known)
    if best is None or best.excess < settings.least_excess:
        return None
    sd_s = best.sd * settings.step_s
    return Estimate(signal, best.lag * settings.step_s, sd_s, share) if sd_s < settings.largest_sd_s else None


class HeldSamples:
    """By how much an input is late because its samples are held: ``delay_s``.

    Rows hold means over their own step, which the window takes for what they are. A sample that is held for
    longer, over h in the mean, is late by half of the rest, (h − step)/2.
    """

    def __init__(self) -> None:
        self._last, self._last_t_s = np.nan, np.nan
        self._lasting_s, self._n_rows, self._n_changes = 0.0, 0, 0

    def push(self, t_s: F64, values: F64) -> None:
        """The next rows (n,) of the input."""
        if not len(t_s):
            return
        steps = np.diff(values, prepend=self._last)
        known = np.isfinite(steps)
        self._n_rows += int(np.count_nonzero(known))
        self._n_changes += int(np.count_nonzero(steps[known]))
        self._lasting_s += float(np.diff(t_s, prepend=self._last_t_s)[known].sum())
        self._last, self._last_t_s = float(values[-1]), float(t_s[-1])

    @property
    def row_step_s(self) -> float:
        """Mean step of the rows."""
        return self._lasting_s / self._n_rows if self._n_rows else 0.0

    @property
    def delay_s(self) -> float:
        """Half of what samples are held beyond the rows' step; 0 below one change a second, as at rest."""
        if self._n_changes < self._lasting_s:
            return 0.0
        return max(self._lasting_s / self._n_changes - self.row_step_s, 0.0) / 2 if self._n_changes else 0.0

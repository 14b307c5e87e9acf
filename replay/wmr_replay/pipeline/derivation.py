"""The differentiation of a log under the design that holds, from row to row."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.differentiate import Derivatives, Differentiator, KernelSpec
from wmr_replay.pipeline.designs import Design, Trial, first_design
from wmr_replay.pipeline.settings import Settings
from wmr_replay.pipeline.stretch import InitialLevels
from wmr_schemas.arrays import I64, NS_PER_S, Bool

EFFORT_FOLD, SPEED_FOLD = 2, 1
NEVER_NS = -(2**62)


@dataclass(frozen=True)
class Tuning:
    """What the log's first stretches decided. ``design`` is ``given``, the ``rule``'s or ``tuned``; a tuned
    one holds from ``design_since_s`` on, and its expected error over the rule's is ``error_ratio``.
    """

    rate_hz: float
    position_sd_m: float
    yaw_sd_rad: float
    window_s: float
    delay_s: float
    degree: int
    kappa: int
    mu: int
    theta: float
    shares: tuple[float, ...]
    design: str
    design_reason: str
    design_since_s: float
    error_ratio: float | None


def differentiator_of(design: Design, step_s: float, start_ns: int | None = None) -> Differentiator:
    """The differentiator of a design; torques and wheel speeds pass through the same window. The log
    starts at ``start_ns``, None: with the first row.
    """
    folds = (EFFORT_FOLD, EFFORT_FOLD, SPEED_FOLD, SPEED_FOLD)
    return Differentiator(
        design.spec, window_s=design.window_s, step_s=step_s, folds=folds, start_ns=start_ns
    )


class Derivation:
    """Stage: kept rows → derivatives, with the design that :class:`~wmr_replay.pipeline.designs.Trial` sets.

    A caller pushes at most ``rows_left`` rows, and calls ``change_design`` where none are left.
    """

    def __init__(self, settings: Settings, levels: InitialLevels) -> None:
        self._settings, self._levels = settings, levels
        design = first_design(settings, levels.step_s, levels.position_sd_m)
        self._trial = Trial(settings, design, levels.step_s, levels.pose_sd, levels.start_ns)
        self._differentiator, self._gaps_before = differentiator_of(design, levels.step_s), 0
        self._jump_ns = NEVER_NS

    @property
    def window_s(self) -> float:
        """Window of the design that holds."""
        return self._differentiator.window_s

    @property
    def kernel(self) -> tuple[KernelSpec, int]:
        """Shape and number of taps of the design that holds."""
        return self._differentiator.spec, self._differentiator.n_taps

    @property
    def bridged_ns(self) -> int:
        """The longest hole that the present window bridges."""
        return self._differentiator.hole_ns

    @property
    def n_gaps(self) -> int:
        """Holes in the pose so far."""
        return self._gaps_before + self._differentiator.n_gaps

    @property
    def tuning(self) -> Tuning:
        """What the log's first stretches have decided so far."""
        design, levels = self._trial.design, self._levels
        return Tuning(
            1 / levels.step_s,
            levels.position_sd_m,
            levels.yaw_sd_rad,
            self._differentiator.window_s,
            self._differentiator.delay_s,
            **asdict(design.spec),
            design=design.origin,
            design_reason=design.reason,
            design_since_s=design.since_s,
            error_ratio=design.error_ratio,
        )

    def rows_left(self, t_ns: I64) -> int:
        """How many of the rows the present design differentiates."""
        return self._trial.rows_left(t_ns)

    def push(self, rows: SampleBatch) -> Derivatives:
        """Derivatives of the repaired pose, one row for each."""
        self._trial.watch(rows)
        return self._differentiator.push(rows.t_ns, rows.pose, rows.inputs, rows.restarts)

    def change_design(self, t_ns: int) -> None:
        """A stretch has ended; from the row at ``t_ns`` on its design holds, if it found one."""
        stretch = self._trial.conclude(t_ns)
        if not stretch:
            return
        n_gaps = self.n_gaps
        self._differentiator = differentiator_of(self._trial.design, self._levels.step_s)
        for rows in stretch:
            self._differentiator.push(rows.t_ns, rows.pose, rows.inputs, rows.restarts)
        self._gaps_before = n_gaps - self._differentiator.n_gaps

    def change_rate(self, levels: InitialLevels, t_ns: int, recent: SampleBatch) -> None:
        """From the row at ``t_ns`` on the pose comes at another rate: the design is chosen and tuned again.

        Its window is filled with the ``recent`` rows.
        """
        since_s = (t_ns - levels.start_ns) / NS_PER_S
        design = first_design(self._settings, levels.step_s, levels.position_sd_m)
        design = replace(
            design, reason=f"{design.reason}; the rate changed at {since_s:.3g} s", since_s=since_s
        )
        self._trial = Trial(
            self._settings, design, levels.step_s, levels.pose_sd, levels.start_ns, first_ns=t_ns
        )
        n_gaps, self._levels = self.n_gaps, levels
        self._differentiator = differentiator_of(design, levels.step_s, levels.start_ns)
        self._differentiator.push(recent.t_ns, recent.pose, recent.inputs, recent.restarts)
        self._gaps_before = n_gaps - self._differentiator.n_gaps

    def after_jump(self, t_ns: I64, restarts: Bool) -> Bool:
        """Mask (n,) of the rows within a window after a jump of the pose."""
        if not t_ns.size:
            return restarts
        last_ns = np.maximum.accumulate(np.where(restarts, t_ns, self._jump_ns))
        self._jump_ns = int(last_ns[-1])
        return np.asarray(t_ns - last_ns <= round(self._differentiator.window_s * NS_PER_S))

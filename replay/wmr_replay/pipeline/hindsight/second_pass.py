"""The second pass: columns of the hindsight table from what the first pass recorded."""

from collections.abc import Iterator

import numpy as np

from wmr_replay.identify.filter_bank.bins import Bins
from wmr_replay.identify.filter_bank.hindsight import Intervals, LookingBack
from wmr_replay.identify.filter_bank.identifier import efforts_of, no_demand
from wmr_replay.identify.posterior import decided_modes, open_slip
from wmr_replay.pipeline.columns import POSTERIOR, Columns
from wmr_replay.pipeline.hindsight.motion import AtInstants, Shift
from wmr_replay.pipeline.hindsight.record import DESCRIBED, Record
from wmr_replay.pipeline.hindsight.spool import Table
from wmr_replay.pipeline.hindsight.whole_noise import WholeNoise
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, U8, Bool
from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.status import BARRING, Status

NO_ANSWER = np.array(sorted({*BARRING, Status.POSE_NOT_INDEPENDENT}))
"""A causal row with one of these statuses has no answer in hindsight either."""


class SecondPass:
    """Iterate over :meth:`columns` once the first pass is over; without ``noise``, bins keep the variances of
    the first pass.

    ``by_wheel_speeds``: the status ``no_torque`` then means rows without wheel speeds, which have no answer;
    where such a row shows a skid, that is all it shows.
    """

    def __init__(
        self,
        record: Record,
        looking_back: LookingBack | None,
        noise: WholeNoise | None = None,
        *,
        min_confidence: float,
        all_modes: ModeSet,
        by_wheel_speeds: bool = False,
    ) -> None:
        self._record, self._looking_back, self._noise = record, looking_back, noise
        self._by_wheel_speeds = by_wheel_speeds
        self._min_confidence, self._all_modes = min_confidence, all_modes
        self._no_answer = np.append(NO_ANSWER, Status.NO_TORQUE) if by_wheel_speeds else NO_ANSWER
        self._intervals = self._smoothed() if looking_back is not None else iter(())
        self._held = Intervals(np.empty(0, np.int64), np.empty((4, 0)), np.empty((2, 0)))
        self._held_coasts = np.empty(0, np.bool_)
        self._bin_ns, self._efforts = np.empty(0, np.int64), np.empty(0)
        self._exhausted = looking_back is None
        self._start_ns = 0

    def columns(self) -> Iterator[Columns]:
        """Batches of the hindsight table, every row of the samples table once and in order."""
        shift = Shift(float(np.nan_to_num(self._record.first_delay_s)))
        for k, rows in enumerate(self._record.rows()):
            if k == 0:
                self._start_ns = int(rows["t_ns"][0])
            yield from self._told(shift.push(rows))
        yield from self._told(shift.finish())

    def _told(self, ready: AtInstants | None) -> Iterator[Columns]:
        """Columns of rows whose motion is known."""
        if ready is None:
            return
        columns = dict(zip(DESCRIBED, ready.described, strict=True))
        columns |= {"t_ns": ready.rows["t_ns"], "mode_true": ready.rows["mode_true"]}
        columns["t_s"] = (ready.rows["t_ns"] - self._start_ns) / NS_PER_S
        columns |= self._modes(ready)
        yield columns

    def _modes(self, ready: AtInstants) -> Columns:
        """Mode, probabilities, α and status; those of the first pass where the bank has none."""
        at = self._interval_of(ready.rows["t_ns"])
        if at is None:
            decided = np.stack([ready.later["mode"], ready.later["mode_set"].view(np.int8)])
            posterior, alpha = np.full((4, len(ready.rows)), np.nan), np.full((2, len(ready.rows)), np.nan)
        else:
            posterior, ln_alpha = self._held.posterior[:, at], self._held.ln_alpha[:, at]
            decided = decided_modes(posterior, self._min_confidence)
            decided[0, self._held_coasts[at] & open_slip(decided)] = ContactMode.UNDECIDED
            alpha = np.stack([np.exp(ln_alpha[0]), np.exp(ln_alpha[0]) * np.sqrt(ln_alpha[1])])
        if ModeSet.SKIDDING_SLIPPING not in self._all_modes:
            posterior[3] = np.nan
        return self._barred(ready.rows, decided, posterior, alpha)

    def _barred(self, rows: Table, decided: I8, posterior: F64, alpha: F64) -> Columns:
        """The answers where one may be given, and the status of every row."""
        cause = rows["status"]
        if self._record.whole_log is not None:
            cause = np.full(len(rows), self._record.whole_log, np.int8)
        in_hole = (cause == Status.GAP) & (rows["mode"] == ContactMode.UNDECIDED)
        barred = np.isin(cause, self._no_answer) | in_hole
        mode, mode_set = decided[0].copy(), decided[1].view(np.uint8).copy()
        mode[barred], mode_set[barred] = ContactMode.UNDECIDED, self._all_modes
        posterior[:, barred] = alpha[:, barred] = np.nan
        if self._by_wheel_speeds:
            bare = (rows["status"] == Status.OK) & ~rows["slip_known"] & ~barred
            mode[bare], mode_set[bare], posterior[:, bare] = (
                rows["mode"][bare],
                rows["mode_set"][bare],
                np.nan,
            )
        status = np.where(mode != ContactMode.UNDECIDED, Status.OK, reason(cause, mode_set))
        return {
            **dict(zip(POSTERIOR, posterior, strict=True)),
            "mode": mode,
            "mode_set": mode_set,
            "alpha": alpha[0],
            "alpha_sd": alpha[1],
            "status": status.astype(np.int8),
        }

    def _interval_of(self, t_ns: I64) -> I64 | None:
        """For each stamp the interval that holds it, at the ends the nearest; None without any."""
        while not self._exhausted and (not len(self._held.end_ns) or self._held.end_ns[-1] < t_ns[-1]):
            self._extend(int(t_ns[0]))
        if not len(self._held.end_ns):
            return None
        return np.minimum(np.searchsorted(self._held.end_ns, t_ns), len(self._held.end_ns) - 1)

    def _extend(self, needed_ns: int) -> None:
        """The next intervals; those that end before ``needed_ns`` are dropped."""
        more = next(self._intervals, None)
        if more is None:
            self._exhausted = True
            return
        keep = max(int(np.searchsorted(self._held.end_ns, needed_ns)) - 1, 0)
        self._held_coasts = np.concatenate([self._held_coasts[keep:], self._coasts(more)])
        parts = zip(self._held, more, strict=True)
        self._held = Intervals(*(np.concatenate([held[..., keep:], new], axis=-1) for held, new in parts))

    def _smoothed(self) -> Iterator[Intervals]:
        """The intervals of the second pass in order."""
        assert self._looking_back is not None
        for bins in self._record.bins():
            self._keep_efforts(bins)
            yield self._looking_back.push(bins if self._noise is None else self._noise.told(bins))
        yield self._looking_back.finish()

    def _keep_efforts(self, bins: Bins) -> None:
        """What the wheels are asked for, for the intervals to come."""
        if not self._by_wheel_speeds:
            self._bin_ns = np.concatenate([self._bin_ns, bins.stamps])
            self._efforts = np.concatenate([self._efforts, efforts_of(bins)])

    def _coasts(self, intervals: Intervals) -> Bool:
        """Whether no wheel is driven at the end of each interval (m,)."""
        if self._by_wheel_speeds or not len(intervals.end_ns):
            return np.zeros(len(intervals.end_ns), np.bool_)
        at = np.maximum(np.searchsorted(self._bin_ns, intervals.end_ns, side="right") - 1, 0)
        coasts = no_demand(self._efforts[at], np.exp(intervals.ln_alpha[0]))
        self._bin_ns, self._efforts = self._bin_ns[at[-1] :], self._efforts[at[-1] :]
        return coasts


def reason(cause: I8, mode_set: U8) -> I8:
    """Why a row (n,) has no mode: the first pass's reason; where that had none, what cannot be told apart."""
    open_reason = np.where(mode_set & int(ModeSet.SKIDDING), Status.NOT_TURNING, Status.NOT_EXCITED)
    return np.where(cause == Status.OK, open_reason, cause)

"""The stages behind the initial stretch: repair, differentiate, track the noise, identify."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.differentiate import Derivatives
from wmr_replay.identify import Evidence, motion_of, wheel_slip
from wmr_replay.identify.independence import UNKNOWN, fresh_independence, track_independence
from wmr_replay.identify.motion import Derived
from wmr_replay.pipeline.beside import LEAST_ROWS, Beside
from wmr_replay.pipeline.colour import PoseColour
from wmr_replay.pipeline.columns import Columns, estimated_columns, measured_columns
from wmr_replay.pipeline.derivation import Derivation, Tuning
from wmr_replay.pipeline.hindsight import Record, SecondPass, WholeNoise
from wmr_replay.pipeline.identifiers import (
    BANKS,
    follow_rate,
    make_identifier,
    undecided_where_barred,
    undecided_while_filling,
)
from wmr_replay.pipeline.jumps_told import JumpsTold
from wmr_replay.pipeline.known_accelerations import known_acceleration, own_accelerations
from wmr_replay.pipeline.known_slip import KnownSlip, without_slide
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.outliers import OutlierFill
from wmr_replay.pipeline.repairing import Repairing
from wmr_replay.pipeline.settings import JOINT_BANK, NO_IDENTIFIER, WHEEL_BANK, Settings
from wmr_replay.pipeline.stretch import initial_levels
from wmr_replay.quality import Observed, Quality
from wmr_replay.quality.monitors import default_monitors
from wmr_replay.quality.rate import RateChange, SlowPose, rate_findings
from wmr_replay.quality.reader_bars import ReaderBars
from wmr_replay.quality.sums import COMPILED
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.findings import Finding, without_explained
from wmr_schemas.status import Status

PIECE_ROWS = 32768
"""Rows of one pass: what Python does is done once for all of them. Half as many take 5 % more time, and
30 MiB less.
"""


class Piece(NamedTuple):
    """Rows of one pass, those ``kept`` that have a measured pose, and what the latter are differentiated to:
    derivatives, what of them motion is ``derived`` from, the colour ``which`` of the pose's noise, and the
    evidence.
    """

    rows: SampleBatch
    kept: SampleBatch
    derivatives: Derivatives
    derived: Derived
    which: I64
    evidence: Evidence


class Chain:
    """Stage: measured rows → rows of the samples table."""

    def __init__(
        self,
        settings: Settings,
        model: ReplayModel,
        stretch: SampleBatch,
        bars: ReaderBars | None = None,
        record: Record | None = None,
    ) -> None:
        levels = initial_levels(stretch.without_outliers())
        self._model, self._all_modes, self._start_ns = model, settings.all_modes, levels.start_ns
        self._repairing = Repairing(levels, stretch, settings.noise_time_constant_s)
        self._derivation = Derivation(settings, levels)
        self._colours = [PoseColour(levels.start_ns, levels.step_s)]
        self._changes, self._slow = list[RateChange](), SlowPose()
        self._independence = fresh_independence()
        self._identifier = make_identifier(
            settings, model, window_s=self._derivation.window_s, step_s=levels.step_s
        )
        self._beside = Beside()
        self._known_slip = KnownSlip(model.robot, model.effects)
        self._outliers = OutlierFill(settings.all_modes)
        self._jumps_told = JumpsTold()
        self._quality = Quality([bars or ReaderBars(), *default_monitors(COMPILED)])
        self._settings, self._record = settings, record
        self._under_way: Callable[[], Columns] | None = None

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the data, so far."""
        rates = [*rate_findings(self._changes), *self._slow.findings()]
        return without_explained([*rates, *self._quality.findings()])

    @property
    def tuning(self) -> Tuning:
        """What the log's first stretches have decided so far."""
        return self._derivation.tuning

    @property
    def bridged_s(self) -> float:
        """The longest hole in the pose over which estimates go on."""
        return self._derivation.bridged_ns / NS_PER_S

    @property
    def n_gaps(self) -> int:
        """Holes in the pose so far."""
        return self._derivation.n_gaps

    @property
    def n_pose_jumps(self) -> int:
        """Jumps of the pose so far, those that the repair took out and those that the identifier found."""
        return self._repairing.n_jumps + self._jumps_told.n

    @property
    def n_outliers(self) -> int:
        """Outliers among the poses so far."""
        return self._repairing.n_outliers

    def second_pass(self) -> SecondPass | None:
        """The log once more, with what the first pass has learned; None where it was not recorded."""
        if self._record is None:
            return None
        looking_back = None
        if isinstance(self._identifier, BANKS):
            looking_back = self._identifier.looking_back(self._settings.hindsight_lag_s)
        return SecondPass(
            self._record,
            looking_back,
            WholeNoise(self._colours),
            min_confidence=self._settings.min_confidence,
            all_modes=self._all_modes,
            by_wheel_speeds=self._settings.identifier in (WHEEL_BANK, JOINT_BANK),
        )

    def push(self, rows: SampleBatch) -> list[Columns]:
        """One row of the table for each row; an outlier's row holds the last verdict.

        While the identifier is busy with a long piece, the next one is repaired and differentiated, so that
        the rows of the last one come with the next push, or with :meth:`finish`.
        """
        done: list[Columns] = []
        n = 0
        while len(rows):
            n = self._rows_left(rows, done)
            if n:
                piece = self._differentiated(rows.part(slice(n)))
                self._complete(done)
                self._under_way = self._begin(piece)
                rows = rows.part(slice(n, None))
            else:
                self._derivation.change_design(int(rows.t_ns[0]))
        if n < LEAST_ROWS:
            self._complete(done)
        return done

    def finish(self) -> list[Columns]:
        """The rows of the piece under way."""
        done: list[Columns] = []
        self._complete(done)
        return done

    def _complete(self, done: list[Columns]) -> None:
        """Append the rows of the piece under way, if there is one."""
        if self._under_way is not None:
            begun, self._under_way = self._under_way, None
            done.append(begun())

    def _rows_left(self, rows: SampleBatch, done: list[Columns]) -> int:
        """How many rows the present design and rate serve; at a change of the rate, both are chosen again,
        and the identifier is told once what is under way is ``done``.
        """
        n = min(PIECE_ROWS, self._derivation.rows_left(rows.t_ns))
        piece = rows.part(slice(n))
        if not n or (left := self._repairing.rows_left(piece)):
            return left if n else 0
        self._complete(done)
        self._change_rate(int(rows.t_ns[0]))
        return self._rows_left(rows, done)

    def _change_rate(self, t_ns: int) -> None:
        """The row at ``t_ns`` shows another rate: step and noise come from the rows just before it."""
        before_s, window_s = self._repairing.step_s, self._derivation.window_s
        levels = self._repairing.change_rate(t_ns)
        self._derivation.change_rate(levels, t_ns, self._repairing.recent)
        follow_rate(self._identifier, levels.step_s)
        self._colours.append(PoseColour(t_ns, levels.step_s))
        at_s = (t_ns - self._start_ns) / NS_PER_S
        self._changes.append(RateChange(at_s, before_s, levels.step_s, window_s, self._derivation.window_s))

    def _differentiated(self, rows: SampleBatch) -> Piece:
        """Repair rows, and differentiate the kept ones, under one design."""
        rows = self._repairing.push(rows)
        kept, slid_m = self._known_slip.push(rows.without_outliers())
        derivatives = self._derivation.push(kept)
        variances, which = self._repairing.variances(kept), self._colours[-1].push(kept)
        derived = Derived.of(derivatives.estimates, derivatives.gains, variances)
        evidence = self._evidence(kept, derivatives, derived, which, slid_m)
        return Piece(rows, kept, derivatives, derived, which, evidence)

    def _begin(self, piece: Piece) -> Callable[[], Columns]:
        """Begin to identify a piece; what is returned waits for the answer, and gives the table's rows, with
        those without a measured pose filled in.
        """
        estimates = self._begin_estimates(piece)
        rows, bridged_ns = piece.rows, self._derivation.bridged_ns

        def complete() -> Columns:
            filled = self._outliers.push(rows, estimates(), bridged_ns)
            if self._record is not None:
                self._record.push_rows(rows, filled)
            return measured_columns(self._start_ns, rows) | filled

        return complete

    def _begin_estimates(self, piece: Piece) -> Callable[[], Columns]:
        """Motion, slip velocities and verdict of a piece's kept rows, once the identifier has answered."""
        rows, derivatives, evidence = piece.kept, piece.derivatives, piece.evidence
        answer = self._beside.begin(self._identifier.push, evidence, len(rows))
        barred = self._barred(rows, derivatives, evidence)
        motion, robot = evidence.motion, self._model.robot
        slip = wheel_slip(motion, derivatives.inputs[2:], robot.wheel_radius_m, robot.half_track_m)
        kernel = self._derivation.kernel
        shown = self._colours[-1].shown(motion, piece.derived, piece.which, kernel)
        delay_s = np.where(np.isnan(motion.v_long_mps), np.nan, derivatives.delay_s)
        jumped = self._derivation.after_jump(rows.t_ns, rows.restarts)

        def estimates() -> Columns:
            filling = derivatives.state == Status.WARMING_UP
            verdict = undecided_while_filling(answer(), filling, self._all_modes)
            if self._record is not None and isinstance(self._identifier, BANKS):
                self._record.push_bins(self._identifier.new_bins)
            verdict = undecided_where_barred(verdict, barred, self._all_modes)
            status = self._status(derivatives, verdict.outcome, jumped)
            return estimated_columns(derivatives.estimates[:, 0], shown, slip, verdict, delay_s, status)

        return estimates

    def _barred(self, rows: SampleBatch, derivatives: Derivatives, evidence: Evidence) -> I8:
        """The status (n,) that bars each row, whatever the identifier says; ``OK`` where nothing does."""
        observed = self._observed(rows, derivatives, evidence)
        slow = self._slow.push(observed.t_s, self._repairing.step_s)
        return np.where(slow == Status.OK, self._quality.push(observed), slow).astype(np.int8)

    def _evidence(
        self, rows: SampleBatch, derivatives: Derivatives, derived: Derived, which: I64, slid_m: F64
    ) -> Evidence:
        """What the identifier is given of each row."""
        motion = self._colours[-1].widen(motion_of(derived), derived, which, self._derivation.kernel)
        known = known_acceleration(self._model, motion, derivatives.estimates[2, 0], derivatives.inputs[:2])
        efforts = rows.inputs[:2]
        if self._settings.identifier == JOINT_BANK:
            efforts = self._model.less_resistance(efforts, rows.inputs[2:], rows.pose[2])
        if self._model.accelerates:
            own = own_accelerations(self._model, rows.t_ns - self._start_ns, motion, derivatives)
            known, efforts = known + own[0], efforts + self._model.as_efforts(own)
        return Evidence(
            t_ns=rows.t_ns,
            pose=without_slide(rows.pose, slid_m) if self._known_slip.any else rows.pose,
            efforts=efforts,
            motion=motion,
            force=derivatives.inputs[0] + derivatives.inputs[1],
            known_acceleration=known,
            variances=self._colours[-1].as_white(derived, which),
            independence=self._independence_of(rows),
            restarts=rows.restarts,
            wheels=rows.inputs[2:],
            smoothed_wheels=derivatives.inputs[2:],
        )

    def _independence_of(self, rows: SampleBatch) -> F64:
        """Whether the pose is independent of the wheel speeds, (n,); unknown where no identifier asks."""
        if self._settings.identifier == NO_IDENTIFIER:
            return np.full(len(rows), float(UNKNOWN))
        return track_independence(rows.t_ns, rows.pose, self._independence)

    def _observed(self, rows: SampleBatch, derivatives: Derivatives, evidence: Evidence) -> Observed:
        """What the monitors of the data's quality are given of each row."""
        return Observed(
            t_ns=rows.t_ns,
            t_s=(rows.t_ns - self._start_ns) / NS_PER_S,
            pose=rows.pose,
            inputs=rows.inputs,
            smoothed=derivatives.inputs,
            motion=evidence.motion,
            variances=evidence.variances,
            robot=self._model.robot,
            smoothed_pose=derivatives.estimates[:, 0],
            pose_raw=rows.pose_raw,
        )

    def _status(self, derivatives: Derivatives, outcome: I8, jumped: Bool) -> I8:
        """The verdict's outcome; where a window has a gap, the reason of the gap: one that reaches over a
        jump, or not.
        """
        reason = np.where(jumped, Status.POSE_JUMP, Status.GAP)
        status = np.where(derivatives.state == Status.GAP, reason, outcome).astype(np.int8)
        self._jumps_told.push(status == Status.POSE_JUMP, jumped)
        return status

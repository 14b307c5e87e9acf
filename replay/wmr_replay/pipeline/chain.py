"""The stages behind the initial stretch, tuned by it: differentiate, track the noise, identify."""

from dataclasses import asdict, dataclass

import numpy as np

from wmr_replay.align import AlignedBatch
from wmr_replay.align.repair import OUTLIER, POSE_JUMP, PoseRepair
from wmr_replay.differentiate import (
    GAP,
    WARMING_UP,
    Derivatives,
    Differentiator,
    NoiseTracker,
    robust_sigma,
)
from wmr_replay.identify import (
    Evidence,
    Identifier,
    Motion,
    PaperIdentifier,
    Rules,
    Verdict,
    make_rules,
    motion_of,
    wheel_slip,
)
from wmr_replay.identify.algebraic import AlgebraicIdentifier, AlgebraicSettings
from wmr_replay.identify.filter_bank import BankIdentifier, BankSettings
from wmr_replay.identify.independence import fresh_independence, judge_independence
from wmr_replay.identify.terms import extra_along
from wmr_replay.pipeline.aside import Aside
from wmr_replay.pipeline.columns import Columns, estimated, part
from wmr_replay.pipeline.designs import Design, Trial, first_design
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool

EFFORT_FOLD, SPEED_FOLD = 2, 1
GAP_STATUS = 2
NEVER_NS = -(2**62)
PIECE_ROWS = 16384
"""So many rows at once have room in a processor's cache with all that is made of them."""


@dataclass(frozen=True)
class Tuning:
    """What the log's first stretches decided. ``design`` is ``given``, the ``rule``'s or ``tuned``; a tuned
    one holds from ``design_since_s`` on, its expected error over the rule's is ``error_ratio``.
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


def make_identifier(settings: Settings, model: ReplayModel, rules: Rules, step_s: float) -> Identifier:
    """The identifier that the settings name."""
    if settings.identifier == "paper":
        return PaperIdentifier(rules)
    if settings.identifier == "algebraic":
        algebraic = AlgebraicSettings(settings.min_confidence)
        return AlgebraicIdentifier(model.robot, rules, algebraic, terms=model.terms)
    bank = BankSettings(min_confidence=settings.min_confidence)
    return BankIdentifier(model.robot, rules, step_s, bank, both=settings.simultaneous, terms=model.terms)


def silent_while_filling(verdict: Verdict, filling: Bool, all_modes: int) -> Verdict:
    """No verdict while the differentiator's window fills, whatever an identifier makes of the first rows."""
    return verdict._replace(
        posterior=np.where(filling, np.nan, verdict.posterior),
        mode=np.where(filling, -1, verdict.mode).astype(np.int8),
        mode_set=np.where(filling, all_modes, verdict.mode_set).astype(np.uint8),
        outcome=np.where(filling, WARMING_UP, verdict.outcome).astype(np.int8),
    )


def differentiator_of(design: Design, step_s: float) -> Differentiator:
    """The differentiator of a design, torques and wheel speeds through the same window."""
    folds = (EFFORT_FOLD, EFFORT_FOLD, SPEED_FOLD, SPEED_FOLD)
    return Differentiator(design.spec, window_s=design.window_s, step_s=step_s, folds=folds)


class Chain:
    """Stage: aligned rows → rows of the samples table."""

    def __init__(self, settings: Settings, model: ReplayModel, stretch: AlignedBatch) -> None:
        robot = model.robot
        self._step_s = step_s = float(np.median(np.diff(stretch.t_ns))) / NS_PER_S
        sigma = np.array([robust_sigma(stretch.t_ns, signal) for signal in stretch.pose])
        position_sd_m, yaw_sd_rad = float(np.sqrt(np.mean(sigma[:2] ** 2))), float(sigma[2])
        self._position_sd_m, self._yaw_sd_rad, self._start_ns = (
            position_sd_m,
            yaw_sd_rad,
            int(stretch.t_ns[0]),
        )
        design = first_design(settings, step_s, position_sd_m)
        levels = np.array([position_sd_m, position_sd_m, yaw_sd_rad])
        self._trial = Trial(settings, design, step_s, levels, self._start_ns)
        self.differentiator, self._gaps_before = differentiator_of(design, step_s), 0
        self._noise = NoiseTracker(sigma, step_s=step_s, time_constant_s=settings.noise_time_constant_s)
        # twice the delay: of a tuned, longer window's noise and signal nine tenths lie within it as well
        rules = make_rules(
            robot,
            window_ns=round(self.differentiator.window_s * NS_PER_S),
            threshold_sd=settings.threshold_sd,
            min_c_k_mps=settings.min_c_k_mps,
            min_c_d_mps2=settings.min_c_d_mps2,
            min_sideslip=settings.min_sideslip_of(robot),
        )
        self._identifier = make_identifier(settings, model, rules, step_s)
        self._all_modes = settings.all_modes
        self._terms, self._model = model.terms, model
        self._robot = robot
        self.repair = PoseRepair(step_s=step_s, position_sd_m=position_sd_m, yaw_sd_rad=yaw_sd_rad)
        self._aside = Aside(self._start_ns, OUTLIER)
        self._jump_ns = NEVER_NS
        self._independence = fresh_independence()

    @property
    def tuning(self) -> Tuning:
        """What the log's first stretches have decided so far."""
        design, differentiator = self._trial.design, self.differentiator
        return Tuning(
            1 / self._step_s,
            self._position_sd_m,
            self._yaw_sd_rad,
            differentiator.window_s,
            differentiator.delay_s,
            **asdict(design.spec),
            design=design.origin,
            design_reason=design.reason,
            design_since_s=design.since_s,
            error_ratio=design.error_ratio,
        )

    @property
    def n_gaps(self) -> int:
        """Holes in the pose so far."""
        return self._gaps_before + self.differentiator.n_gaps

    def push(self, rows: AlignedBatch) -> list[Columns]:
        """One row for each; outliers among the poses keep the last verdict."""
        done = []
        while len(rows):
            n = min(PIECE_ROWS, self._trial.rows_left(rows.t_ns))
            if n:
                done.append(self._advance(part(rows, slice(n))))
                rows = part(rows, slice(n, None))
            else:
                self._conclude(int(rows.t_ns[0]))
        return done

    def _advance(self, rows: AlignedBatch) -> Columns:
        """Rows under one design."""
        repaired = self.repair.push(rows)
        self._trial.watch(repaired)
        return self._aside.push(rows, repaired.kept, self._judge(repaired.rows, repaired.restarts))

    def _conclude(self, t_ns: int) -> None:
        """A stretch has ended; from the row at ``t_ns`` on its design holds, if it found one."""
        stretch = self._trial.conclude(t_ns)
        if not stretch:
            return
        n_gaps = self.n_gaps
        self.differentiator = differentiator_of(self._trial.design, self._step_s)
        for repaired in stretch:
            rows = repaired.rows
            self.differentiator.push(rows.t_ns, rows.pose, rows.inputs, repaired.restarts)
        self._gaps_before = n_gaps - self.differentiator.n_gaps

    def _judge(self, rows: AlignedBatch, restarts: Bool) -> Columns:
        """Rows with a good pose."""
        derivatives = self.differentiator.push(rows.t_ns, rows.pose, rows.inputs, restarts)
        x, y, yaw = self._noise.push(rows.t_ns, rows.pose) ** 2
        variances = np.stack([(x + y) / 2, yaw])
        independence = judge_independence(rows.t_ns, rows.pose, self._independence)
        motion = motion_of(derivatives.estimates, derivatives.gains, variances)
        slip = wheel_slip(
            motion, derivatives.inputs[2:], self._robot.wheel_radius_m, self._robot.half_track_m
        )
        force = derivatives.inputs[0] + derivatives.inputs[1]
        known = self._known_acceleration(motion, derivatives.estimates[2, 0], derivatives.inputs[:2])
        efforts = rows.inputs[:2]
        if self._model.accelerates:
            own = self._own_accelerations(rows.t_ns, motion, derivatives)
            known, efforts = known + own[0], efforts + self._model.as_efforts(own)
        verdict = self._identifier.push(
            Evidence(
                rows.t_ns,
                rows.pose,
                efforts,
                motion,
                force,
                known,
                variances,
                independence,
                restarts,
            )
        )
        verdict = silent_while_filling(verdict, derivatives.state == WARMING_UP, self._all_modes)
        blank = np.where(self._after_jump(rows.t_ns, restarts), POSE_JUMP, GAP_STATUS)
        status = np.where(derivatives.state == GAP, blank, verdict.outcome).astype(np.int8)
        delay_s = np.where(np.isnan(motion.v_long_mps), np.nan, derivatives.delay_s)
        return estimated(self._start_ns, rows, motion, slip, verdict, delay_s, status)

    def _after_jump(self, t_ns: I64, restarts: Bool) -> Bool:
        """Whether the pose has jumped within the last window."""
        if not t_ns.size:
            return restarts
        last_ns = np.maximum.accumulate(np.where(restarts, t_ns, self._jump_ns))
        self._jump_ns = int(last_ns[-1])
        return np.asarray(t_ns - last_ns <= round(self.differentiator.window_s * NS_PER_S))

    def _own_accelerations(self, t_ns: I64, motion: Motion, derivatives: Derivatives) -> F64:
        """Accelerations (2, n) of users' effects, at the instants that the derivatives describe."""
        x_m, y_m, yaw_rad = derivatives.estimates[:, 0]
        return self._model.own_accelerations(
            {
                "t_s": (t_ns - self._start_ns) / NS_PER_S - derivatives.delay_s,
                "x_m": x_m,
                "y_m": y_m,
                "yaw_rad": yaw_rad,
                "v_mps": motion.v_long_mps,
                "v_lat_mps": motion.v_lat_mps,
                "yaw_rate_radps": motion.yaw_rate_radps,
                "left_nm": derivatives.inputs[0],
                "right_nm": derivatives.inputs[1],
            }
        )

    def _known_acceleration(self, motion: Motion, yaw_rad: F64, efforts: F64) -> F64:
        """What the model knows of dv_long/dt besides the torques, at the motion's own instants."""
        if not self._terms.any:
            return np.zeros(len(yaw_rad))
        alpha = self._robot.alpha or 0.0
        moving = np.stack([motion.v_long_mps, motion.v_lat_mps, yaw_rad, motion.yaw_rate_radps])
        return extra_along(moving, efforts, alpha, self._terms)

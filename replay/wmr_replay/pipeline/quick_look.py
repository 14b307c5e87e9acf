"""The monitors of the data's quality over a few thousand rows, without the causal stages and their kernels.

``info`` answers within a second, also where nothing is compiled yet, which takes a replay ten. So the motion
comes from the same taps by convolution on an even grid of the rows' median step: no repair of outliers, no
tuning, no identifier. What is found depends on the rows looked at alone; ``run`` decides on every row.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wmr_replay.align.frozen import FrozenPose
from wmr_replay.differentiate.design import input_taps, uniform_taps
from wmr_replay.identify import Motion
from wmr_replay.pipeline.derivation import EFFORT_FOLD, SPEED_FOLD
from wmr_replay.pipeline.designs import first_design
from wmr_replay.pipeline.settings import Settings
from wmr_replay.quality import Observed, Quality
from wmr_replay.quality.frozen import RepeatedRows
from wmr_replay.quality.rate import SlowPose
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.findings import Finding, without_explained
from wmr_schemas.robot import RobotParameters

SETTINGS = Settings(tune=False, hindsight=False)
LONGEST_HOLE_STEPS, HOLE_SHARE = 3.5, 0.25
"""Rows further apart are not joined by a line. A replay bridges holes of such a share of its window."""
MOST_ROWS = 20_000
"""Poses of one stretch: 200 s at 100 Hz, and some hundredths of a second of computing."""
PIECE_ROWS = 50_000
"""Poses that are worked through together where there is no such limit."""
MAD_TO_SD, DIFFERENCE_SD = 1.4826, 20**0.5
"""Of the third differences 1, −3, 3, −1 of white noise."""
LEAST_STEP_S, LARGEST = 1e-4, 1e9
"""Poses come no more often, and lie no further away; such rows are left to ``run``."""
MOST_FILLED = 4
"""Points of the grid for each row: beyond it, most of them were made up."""


class QuickLook:
    """``push`` the batches of a stretch, then ``end_stretch``; ``n_rows`` poses were looked at."""

    def __init__(self, robot: RobotParameters, most_rows: int | None = MOST_ROWS) -> None:
        self._robot, self._most_rows = robot, most_rows
        self._quality, self._slow = Quality(), SlowPose()
        self._frozen, self._repeats, self._bridged_s = FrozenPose(), RepeatedRows(), 0.0
        self._held: list[RawBatch] = []
        self._n_held = self._n_stretch = 0
        self._start_ns: int | None = None
        self._last_ns: int | None = None
        self.n_rows, self.span_s = 0, 0.0

    def push(self, batch: RawBatch) -> None:
        """Take a batch in, up to the limit of the stretch."""
        room = len(batch.pose) if self._most_rows is None else max(self._most_rows - self._n_stretch, 0)
        if not room:
            return
        pose = batch.pose
        kept = Rows(pose.t_ns[:room], pose.order[:room], pose.values[:, :room])
        self._held.append(RawBatch(kept, batch.torque, batch.mode))
        self._n_held += len(kept)
        self._n_stretch += len(kept)
        if self._n_held >= PIECE_ROWS:
            self._look()

    def end_stretch(self) -> None:
        """The next batch does not follow on the last one."""
        self._look()
        self._n_stretch = 0

    def findings(self) -> list[Finding]:
        """What was found so far."""
        repeats = self._repeats.findings(self._bridged_s, self._frozen.n_position, self._frozen.n_yaw)
        return without_explained([*repeats, *self._slow.findings(), *self._quality.findings()])

    def _look(self) -> None:
        """Show the monitors what is held."""
        pose, torque = (
            by_time([getattr(batch, name) for batch in self._held], width)
            for name, width in (("pose", 3), ("torque", 4))
        )
        self._held, self._n_held = [], 0
        known = (np.abs(pose[1]) < LARGEST).all(axis=0)  # false for NaN
        known &= True if self._last_ns is None else pose[0] > self._last_ns
        pose = pose[0][known], pose[1][:, known]
        if len(pose[0]) < 2:
            return
        if self._start_ns is None:
            self._start_ns = int(pose[0][0])
        self._last_ns = int(pose[0][-1])
        self.n_rows += len(pose[0])
        self.span_s += float(pose[0][-1] - pose[0][0]) / NS_PER_S
        with np.errstate(all="ignore"):  # values of any size come from the file
            self._show(pose[0], np.stack([*pose[1][:2], np.unwrap(pose[1][2])]), torque)

    def _show(self, t_ns: I64, pose: F64, torque: tuple[I64, F64]) -> None:
        """Show the monitors n rows; those that repeat a frozen pose are none."""
        start_ns = self._start_ns or 0
        t_s, held_s = (t_ns - start_ns) / NS_PER_S, (torque[0] - start_ns) / NS_PER_S
        step_s = float(np.median(np.diff(t_s)))
        wheels = np.stack([held_means(held_s, u, t_s, step_s) for u in torque[1][2:]])
        frozen = self._frozen.frozen(t_ns, pose, wheels)
        self._repeats.push(t_ns, frozen)
        t_ns, t_s, pose = t_ns[~frozen], t_s[~frozen], pose[:, ~frozen]
        window = window_of(np.diff(t_s), pose) if len(t_s) > 1 else None
        if window is None:
            return
        self._bridged_s = max(self._bridged_s, HOLE_SHARE * (window.taps.shape[1] - 1) * window.step_s)
        self._slow.push(t_s, window.step_s)
        for rows in observed((t_ns, t_s, pose), (held_s, torque[1]), window, self._robot):
            self._quality.push(rows)


def by_time(parts: list[Rows], width: int) -> tuple[I64, F64]:
    """Stamps (n,), strictly increasing, and values (width, n) of rows in any order."""
    if not parts:
        return np.empty(0, np.int64), np.empty((width, 0))
    t_ns = np.concatenate([rows.t_ns for rows in parts])
    t_ns, first = np.unique(t_ns, return_index=True)
    return t_ns, np.concatenate([rows.values for rows in parts], axis=1)[:, first]


@dataclass(frozen=True, eq=False)
class Window:
    """Step of the grid, variances (2,) of position and yaw, taps (3, L) of motion and (L,) of each input."""

    step_s: float
    variances: F64
    taps: F64
    input_taps: tuple[F64, ...]


def window_of(steps_s: F64, values: F64) -> Window | None:
    """The window that ``run`` begins with on n poses (3, n); None for a rate that no pose has."""
    step_s = float(np.median(steps_s))
    if step_s < LEAST_STEP_S:
        return None
    sigma = np.array([noise_sd(signal) for signal in values])
    variances = np.array([np.mean(sigma[:2] ** 2), sigma[2] ** 2])
    design = first_design(SETTINGS, step_s, float(np.sqrt(variances[0])))
    taps = uniform_taps(design.spec, round(design.window_s / step_s) + 1, step_s)
    folds = (EFFORT_FOLD, EFFORT_FOLD, SPEED_FOLD, SPEED_FOLD)
    return Window(step_s, variances, taps, tuple(input_taps(taps[fold], step_s, fold) for fold in folds))


def observed(
    pose: tuple[I64, F64, F64], torque: tuple[F64, F64], window: Window, robot: RobotParameters
) -> Iterator[Observed]:
    """What the monitors are given of n poses – stamps, seconds, values (3, n) – one piece for each stretch
    without a hole; ``torque``: seconds (m,) and values (4, m).
    """
    t_ns, t_s, values = pose
    breaks = np.flatnonzero(np.diff(t_s) > LONGEST_HOLE_STEPS * window.step_s) + 1
    for piece in np.split(np.arange(len(t_s)), breaks):
        first_s, last_s = t_s[piece[[0, -1]]]
        n_points = int((last_s - first_s) / window.step_s + 1e-6) + 1
        if window.taps.shape[1] <= n_points <= MOST_FILLED * len(piece):
            grid_s = first_s + window.step_s * np.arange(n_points)
            means = np.stack([held_means(torque[0], u, grid_s, window.step_s) for u in torque[1]])
            yield observed_piece(t_ns[piece], t_s[piece], values[:, piece], (grid_s, means), window, robot)


def observed_piece(
    t_ns: I64, t_s: F64, pose: F64, grid: tuple[F64, F64], window: Window, robot: RobotParameters
) -> Observed:
    """The same of n poses (3, n) without a hole; ``grid`` (m,) and the mean inputs (4, m) on it."""
    grid_s, means = grid

    def at_rows(columns: F64) -> F64:
        return np.stack([np.interp(t_s, grid_s, column) for column in columns])

    on_grid = [np.interp(grid_s, t_s, signal) for signal in pose]
    estimates = np.stack([[filtered(signal, taps) for taps in window.taps] for signal in on_grid])
    smoothed = np.stack([filtered(u, taps) for u, taps in zip(means, window.input_taps, strict=True)])
    return Observed(
        t_ns=t_ns,
        t_s=t_s,
        pose=pose,
        inputs=at_rows(means),
        smoothed=at_rows(smoothed),
        motion=Motion(*at_rows(body_motion(estimates, window.taps @ window.taps.T, window.variances))),
        variances=np.repeat(window.variances[:, None], len(t_ns), axis=1),
        robot=robot,
        smoothed_pose=at_rows(estimates[:, 0]),
        pose_raw=pose,
    )


def noise_sd(signal: F64) -> float:
    """Standard deviation of the white noise of a signal (n,), as ``robust_sigma`` gives it on even stamps."""
    differences = np.abs(np.diff(signal, 3)) / DIFFERENCE_SD
    level = MAD_TO_SD * float(np.median(differences)) if len(differences) else 0.0
    return level or (float(np.sqrt(np.mean(differences**2))) if len(differences) else 0.0)


def held_means(at_s: F64, values: F64, grid_s: F64, step_s: float) -> F64:
    """Mean (m,) over the step before each point of an input that is held from its stamps on, NaN where none
    is in force.
    """
    known = np.isfinite(values)
    at_s, values = at_s[known], values[known]
    if not len(at_s):
        return np.full(len(grid_s), np.nan)
    end_s = max(float(grid_s[-1]), float(at_s[-1]) + SETTINGS.max_hold_s)
    knots = np.append(at_s, end_s)
    total = np.concatenate([[0.0], np.cumsum(values * np.diff(knots))])
    begin_s = grid_s - step_s
    mean = (np.interp(grid_s, knots, total) - np.interp(begin_s, knots, total)) / step_s
    latest = np.searchsorted(at_s, begin_s, side="right") - 1
    in_force = (latest >= 0) & (begin_s - at_s[np.maximum(latest, 0)] <= SETTINGS.max_hold_s)
    return np.where(in_force, mean, np.nan)


def filtered(signal: F64, taps: F64) -> F64:
    """Σ taps[k] signal[i − k] (n,), NaN while the window is not full."""
    return np.concatenate([np.full(len(taps) - 1, np.nan), np.convolve(signal, taps, "valid")])


def body_motion(estimates: F64, gains: F64, variances: F64) -> F64:
    """Rows of ``Motion`` (10, n) by the formulas of :func:`wmr_replay.identify.motion.body_motion`; gains
    (3, 3) and variances (2,) are the same for all rows here.
    """
    (x, y, yaw), (position, turn) = estimates, variances
    cos, sin = np.cos(yaw[0]), np.sin(yaw[0])
    v, w = x[1] * cos + y[1] * sin, y[1] * cos - x[1] * sin
    across = y[2] * cos - x[2] * sin - yaw[1] * v
    g00, g01, g11, g22 = gains[0, 0], gains[0, 1], gains[1, 1], gains[2, 2]
    from_yaw = np.maximum(across**2 * g00 + 2 * across * w * g01 + w**2 * g11, 0.0)
    fixed = np.full(len(v), turn)
    return np.stack([
        v,
        w,
        yaw[1],
        x[2] * cos + y[2] * sin + yaw[1] * w,
        yaw[2],
        np.sqrt(position * g11 + w**2 * turn * g00),
        np.sqrt(position * g11 + v**2 * turn * g00),
        np.sqrt(fixed * g11),
        np.sqrt(position * (g22 + yaw[1] ** 2 * g11) + turn * from_yaw),
        np.sqrt(fixed * g22),
    ])  # fmt: skip

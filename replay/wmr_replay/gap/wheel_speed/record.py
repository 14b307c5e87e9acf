"""Logs as one data set: stretches of driving on a common grid, poses unrolled into the body's frame.

A stretch ends where poses or wheel speeds pause, or where the pose restarts. Rows of all stretches lie one
behind the other; every operation on them is one on whole columns.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.settings.wheel_speed import LayoutSettings
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.signals import CommandTrack, Log, PoseTrack, WheelSpeedTrack


class Stretch(NamedTuple):
    """One stretch: poses (n,), and wheel angles (m + 1,) at the edges of the grid."""

    t_s: F64
    x_m: F64
    y_m: F64
    yaw_rad: F64
    edges_s: F64
    left_rad: F64
    right_rad: F64
    start_left_radps: float
    start_right_radps: float


@dataclass(frozen=True, eq=False)
class Record:
    """The data set. M rows of the grid, N poses, S stretches.

    ``left_rad``, ``right_rad`` (M + S,) are the wheels' angles at the grid's edges; ``first`` (S + 1,) the
    first grid row of each stretch, ``first_pose`` (S + 1,) its first pose. ``at`` (N,) is the grid
    coordinate of each pose. ``measured`` (3, N) is the path unrolled: ahead, left, yaw. ``world`` (3, M) is
    the measured pose at the middle of each grid row, ``time_s`` (M,) its time from the first log's start.
    """

    step_s: float
    left_radps: F64
    right_radps: F64
    started_radps: F64
    first: I64
    time_s: F64
    world: F64
    first_pose: I64
    at: F64
    pose_s: F64
    pose: F64
    measured: F64
    log_of: I64
    driven_by: str
    anchored: bool
    start_ns: int
    wheel_step_s: float

    @property
    def n_stretches(self) -> int:
        """How many stretches there are."""
        return len(self.first) - 1

    @property
    def stretch_of_pose(self) -> I64:
        """Stretch of each pose (N,)."""
        return np.repeat(np.arange(self.n_stretches), np.diff(self.first_pose))


def record_of(logs: Sequence[Log], settings: LayoutSettings, driven_by: str = "wheel_speed") -> Record:
    """The data set of ``logs``. Raises InvalidSignal where a log has no wheel speeds, or nothing usable."""
    tracks = [driving_track(log, driven_by) for log in logs]
    step_s = grid_step(tracks, settings, driven_by)
    found: list[Stretch] = []
    log_of: list[int] = []
    offset_s = 0.0
    for number, (log, track) in enumerate(zip(logs, tracks, strict=True)):
        mine = stretches_of(log, track, driven_by, step_s, settings)
        found += [moved(stretch, offset_s) for stretch in mine]
        log_of += [number] * len(mine)
        offset_s += (int(log.pose.t_ns[-1]) - int(log.pose.t_ns[0])) / NS_PER_S + 2 * settings.command_lead_s
    if not found:
        raise InvalidSignal("wheel speed", "no stretch of the log has poses and wheel speeds together")
    wheel_step_s = max(float(np.median(np.diff(track.t_ns))) / NS_PER_S for track in tracks)
    return joined(found, np.array(log_of), step_s, driven_by, int(logs[0].pose.t_ns[0]), wheel_step_s)


def driving_track(log: Log, driven_by: str) -> WheelSpeedTrack | CommandTrack:
    """What drives the model. Raises InvalidSignal without it."""
    track = log.commands if driven_by == "command" else log.wheels
    if track is None or not np.isfinite(track.left_radps + track.right_radps).any():
        what = "commanded wheel speeds" if driven_by == "command" else "measured wheel speeds"
        raise InvalidSignal("wheel speed", f"the log has no {what}")
    return track


def grid_step(
    tracks: Sequence[WheelSpeedTrack | CommandTrack], settings: LayoutSettings, driven_by: str
) -> float:
    """Step of the grid [s]: that of the fastest wheel speeds, within bounds."""
    steps = [float(np.median(np.diff(track.t_ns))) / NS_PER_S for track in tracks if len(track) > 1]
    longest_s = settings.command_step_s if driven_by == "command" else settings.longest_step_s
    return float(np.clip(min(steps, default=1.0), settings.shortest_step_s, longest_s))


def stretches_of(
    log: Log,
    track: WheelSpeedTrack | CommandTrack,
    driven_by: str,
    step_s: float,
    settings: LayoutSettings,
) -> list[Stretch]:
    """The stretches of one log; ``t_s`` counts from its first pose."""
    start_ns = int(log.pose.t_ns[0])
    known = np.isfinite(track.left_radps) & np.isfinite(track.right_radps)
    wheel_s = (track.t_ns[known] - start_ns) / NS_PER_S
    speeds = np.stack([track.left_radps[known], track.right_radps[known]])
    pose_s = (log.pose.t_ns - start_ns) / NS_PER_S
    covered = (pose_s >= wheel_s[0]) & (pose_s <= wheel_s[-1])
    parts = split(log.pose, pose_s, wheel_s, covered, log.breaks_ns, settings)
    measured = log.wheels if driven_by == "command" else None
    remembers = driven_by == "command" and measured is None
    lead_s = settings.command_lead_s if remembers else settings.lead_s
    angles = Angles.of(wheel_s, speeds, held=driven_by == "command", margin_s=lead_s + step_s)
    return [
        stretch(
            log.pose,
            pose_s[rows],
            rows,
            angles,
            Grid(lead_s, settings.lead_s, step_s),
            start_speeds(measured, start_ns, settings),
        )
        for rows in parts
    ]


class StartSpeeds(NamedTuple):
    """Measured wheel speeds by time, from which a drive starts that commands drive; empty where unknown."""

    t_s: F64
    left_radps: F64
    right_radps: F64
    longest_gap_s: float

    def at(self, t_s: float) -> tuple[float, float]:
        """Left and right [rad/s] at a time, NaN where nothing was measured near it."""
        if not len(self.t_s) or np.min(np.abs(self.t_s - t_s)) > self.longest_gap_s:
            return float("nan"), float("nan")
        return float(np.interp(t_s, self.t_s, self.left_radps)), float(
            np.interp(t_s, self.t_s, self.right_radps)
        )


def start_speeds(track: WheelSpeedTrack | None, start_ns: int, settings: LayoutSettings) -> StartSpeeds:
    """The measured wheel speeds of a log whose model commands drive."""
    if track is None:
        return StartSpeeds(np.empty(0), np.empty(0), np.empty(0), 0.0)
    known = np.isfinite(track.left_radps) & np.isfinite(track.right_radps)
    return StartSpeeds(
        (track.t_ns[known] - start_ns) / NS_PER_S,
        track.left_radps[known],
        track.right_radps[known],
        settings.wheel_gap_s,
    )


def split(
    pose: PoseTrack,
    pose_s: F64,
    wheel_s: F64,
    covered: Bool,
    breaks_ns: tuple[int, ...],
    settings: LayoutSettings,
) -> list[I64]:
    """Rows of the poses of each stretch."""
    step_s = np.diff(pose_s)
    longest_s = max(settings.pose_gap_s, 5 * float(np.median(step_s)))
    apart = step_s > longest_s
    gaps = np.flatnonzero(np.diff(wheel_s) > settings.wheel_gap_s)
    for gap in gaps:
        inside = (pose_s > wheel_s[gap]) & (pose_s < wheel_s[gap + 1])
        covered = covered & ~inside
        apart[np.clip(np.searchsorted(pose_s, wheel_s[gap + 1]) - 1, 0, len(apart) - 1)] = True
    at_origin = np.maximum(np.abs(pose.x_m), np.abs(pose.y_m)) < settings.origin_m
    at_origin &= np.abs(pose.yaw_rad) < settings.origin_m
    apart |= at_origin[1:] & ~at_origin[:-1]
    apart |= covered[1:] != covered[:-1]
    apart |= np.isin(np.arange(1, len(pose_s)), np.searchsorted(pose.t_ns, breaks_ns))
    label = np.concatenate([[0], np.cumsum(apart)])
    rows = np.split(np.arange(len(pose_s)), np.flatnonzero(np.diff(label)) + 1)
    return [part for part in rows if len(part) >= settings.least_rows and covered[part].all()]


class Angles(NamedTuple):
    """Both wheels' angles [rad] over time: a broken line through knots."""

    t_s: F64
    rad: F64

    @classmethod
    def of(cls, t_s: F64, radps: F64, *, held: bool, margin_s: float) -> "Angles":
        """From speeds (2, n). An encoder's speed is that of the step that ends at its stamp; a command holds
        from its stamp on (``held``). Before the first and after the last stamp the speed is constant.
        """
        knots = np.concatenate([[t_s[0] - margin_s], t_s, [t_s[-1] + margin_s]])
        spanned = [radps[:, :1], radps] if held else [radps, radps[:, -1:]]
        steps = np.concatenate(spanned, axis=1) * np.diff(knots)
        return cls(knots, np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1))

    def at(self, t_s: F64) -> F64:
        """Angles (2, n) at times."""
        return np.stack([np.interp(t_s, self.t_s, wheel) for wheel in self.rad])


class Grid(NamedTuple):
    """A grid's time before the first pose and behind the last [s], and its step [s]."""

    lead_s: float
    tail_s: float
    step_s: float

    def edges(self, first_s: float, last_s: float) -> F64:
        """Edges (m + 1,) around poses between two times."""
        n_steps = int(np.ceil((last_s - first_s + self.lead_s + self.tail_s) / self.step_s))
        return np.asarray(first_s - self.lead_s + self.step_s * np.arange(n_steps + 1))


def stretch(
    pose: PoseTrack, t_s: F64, rows: I64, angles: Angles, grid: Grid, starting: StartSpeeds
) -> Stretch:
    """The stretch of the poses ``rows`` at times ``t_s`` (n,)."""
    edges_s = grid.edges(float(t_s[0]), float(t_s[-1]))
    within = np.clip(edges_s, angles.t_s[0], angles.t_s[-1])
    left, right = angles.at(within)
    return Stretch(
        t_s,
        pose.x_m[rows],
        pose.y_m[rows],
        np.unwrap(pose.yaw_rad[rows]),
        edges_s,
        left,
        right,
        *starting.at(float(t_s[0])),
    )


def moved(part: Stretch, offset_s: float) -> Stretch:
    """A stretch of a later log, behind those of the earlier ones in time."""
    return part._replace(t_s=part.t_s + offset_s, edges_s=part.edges_s + offset_s)


def joined(
    parts: list[Stretch], log_of: I64, step_s: float, driven_by: str, start_ns: int, wheel_step_s: float
) -> Record:
    """All stretches as columns."""
    n_rows = [len(p.edges_s) - 1 for p in parts]
    first = np.concatenate([[0], np.cumsum(n_rows)])
    first_pose = np.concatenate([[0], np.cumsum([len(p.t_s) for p in parts])])
    middle = [(p.edges_s[1:] + p.edges_s[:-1]) / 2 for p in parts]
    world = np.concatenate(
        [
            np.stack([np.interp(m, p.t_s, c) for c in (p.x_m, p.y_m, p.yaw_rad)])
            for p, m in zip(parts, middle, strict=True)
        ],
        axis=1,
    )
    return Record(
        step_s=step_s,
        left_radps=np.concatenate([np.diff(p.left_rad) for p in parts]) / step_s,
        right_radps=np.concatenate([np.diff(p.right_rad) for p in parts]) / step_s,
        started_radps=np.array([(p.start_left_radps, p.start_right_radps) for p in parts]).T,
        first=first,
        time_s=np.concatenate(middle),
        world=world,
        first_pose=first_pose,
        at=np.concatenate([a + (p.t_s - p.edges_s[0]) / step_s for p, a in zip(parts, first, strict=False)]),
        pose_s=np.concatenate([p.t_s for p in parts]),
        pose=np.concatenate([np.stack([p.x_m, p.y_m, p.yaw_rad]) for p in parts], axis=1),
        measured=np.concatenate([unrolled(p) for p in parts], axis=1),
        log_of=log_of,
        driven_by=driven_by,
        anchored=is_anchored(parts),
        start_ns=start_ns,
        wheel_step_s=wheel_step_s,
    )


def unrolled(part: Stretch) -> F64:
    """The path in the body's frame, (3, n): Σ R(yaw)ᵀ Δp ahead and left, and yaw.

    The yaw is the measured one; its noise turns each step by a little, which averages out.
    """
    middle = (part.yaw_rad[1:] + part.yaw_rad[:-1]) / 2
    dx, dy, cos, sin = np.diff(part.x_m), np.diff(part.y_m), np.cos(middle), np.sin(middle)
    steps = np.stack([cos * dx + sin * dy, cos * dy - sin * dx])
    way = np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1)
    return np.concatenate([way, part.yaw_rad[None]])


def is_anchored(parts: list[Stretch]) -> bool:
    """Whether the stretches share one world: false where several all start at the same pose, their own."""
    starts = np.array([(p.x_m[0], p.y_m[0], p.yaw_rad[0]) for p in parts])
    return len(parts) < 3 or bool(np.ptp(starts, axis=0).max() > 1e-6)

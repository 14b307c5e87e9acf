"""A log as the gap's filter reads it: poses averaged over short bins, efforts as they act between them."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.differentiate.noise import robust_sigma
from wmr_replay.gap.model.inputs import TorqueHistory
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.signals import Log, ModeTrack, PoseTrack

BIN_S = 0.04
LABEL_S = 0.25
LEAST_ROWS = 200
LONGEST_STEP_S = 1.0
LEAST_POSITION_SD_M, LEAST_YAW_SD_RAD = 2e-5, 2e-5


@dataclass(frozen=True, eq=False)
class Drive:
    """Bins of at most ``BIN_S``: mean stamp ``t_s`` (n,), mean pose (n, 3) with yaw unwrapped, poses per bin
    (n,), contact mode (n,) over the step that ends at the bin, and the torques to be averaged over it.

    ``noise_sd`` (3,) is that of one pose in x, y [m] and yaw [rad], from the data alone.
    """

    start_ns: int
    t_s: F64
    pose: F64
    count: F64
    mode: F64
    torque: TorqueHistory
    noise_sd: F64
    log: Log
    track: ModeTrack | None
    margin: int

    def __len__(self) -> int:
        return len(self.t_s)

    @property
    def identified(self) -> bool:
        """Whether an identifier said the modes, which knows their changes less well than a label does."""
        return self.margin > 1

    @property
    def step_s(self) -> F64:
        """Length of each step (n,), the first one 0."""
        return np.diff(self.t_s, prepend=self.t_s[:1])

    def unsure(self, skids: Bool) -> F64:
        """1 at the bins (n,) next to a change into or out of skidding, ``skids`` (n,); 0 elsewhere."""
        changed = np.flatnonzero(np.diff(skids))
        near = (changed[:, None] + 1 + np.arange(-self.margin, self.margin + 1)).ravel()
        flags = np.zeros(len(self))
        flags[np.clip(near, 0, len(self) - 1)] = 1.0
        return flags

    @property
    def variances(self) -> F64:
        """Measurement variance of each bin's mean pose (n, 3)."""
        return self.noise_sd**2 / self.count[:, None]

    def finer(self) -> "Drive":
        """The same in bins of half the length."""
        return drive_of(self.log, self.track, BIN_S / 2, margin_s=self.margin * BIN_S)


def drive_of(
    log: Log, mode: ModeTrack | None = None, bin_s: float = BIN_S, *, margin_s: float = BIN_S
) -> Drive:
    """``log`` in bins; ``mode`` None means ideal throughout, its changes are known to ``margin_s``.

    Raises InvalidSignal where there is too little.
    """
    if log.torque is None:
        raise InvalidSignal("torque", "the log has none: nothing to simulate the robot with")
    pose, start_ns = log.pose, int(log.pose.t_ns[0])
    t_s = (pose.t_ns - start_ns) / NS_PER_S
    measured = np.stack([pose.x_m, pose.y_m, np.unwrap(pose.yaw_rad)], axis=1)
    starts = bin_starts(t_s, bin_s)
    if len(starts) < LEAST_ROWS:
        raise InvalidSignal("pose", f"{len(starts)} bins of {BIN_S} s; {LEAST_ROWS} are needed")
    count = np.diff(np.append(starts, len(t_s))).astype(np.float64)
    means = np.add.reduceat(np.column_stack([t_s, measured]), starts, axis=0) / count[:, None]
    return Drive(
        start_ns=start_ns,
        t_s=np.ascontiguousarray(means[:, 0]),
        pose=np.ascontiguousarray(means[:, 1:]),
        count=count,
        mode=mode_at(mode, means[:, 0], start_ns, bin_s),
        torque=TorqueHistory.of(log.torque, start_ns),
        noise_sd=noise_of(pose, measured),
        log=log,
        track=mode,
        margin=round(margin_s / bin_s),
    )


def bin_starts(t_s: F64, bin_s: float) -> I64:
    """First pose of each bin."""
    return np.flatnonzero(np.diff(np.floor(t_s / bin_s + 1e-6), prepend=-1.0) > 0).astype(np.int64)


def noise_of(pose: PoseTrack, measured: F64) -> F64:
    """Standard deviation of one pose, (3,): x and y share theirs; never below what a file resolves."""
    x, y, yaw = (robust_sigma(pose.t_ns, measured[:, k]) for k in range(3))
    position = max(float(np.sqrt((x**2 + y**2) / 2)), LEAST_POSITION_SD_M)
    return np.array([position, position, max(yaw, LEAST_YAW_SD_RAD)])


def mode_at(track: ModeTrack | None, t_s: F64, start_ns: int, bin_s: float) -> F64:
    """The mode in most of each step, labels of less than a fifth of a second taken for slips of the pen."""
    if track is None:
        return np.zeros(len(t_s))
    stamps = (track.t_ns - start_ns) / NS_PER_S
    edges = np.concatenate([[t_s[0] - bin_s], t_s])
    fine = np.linspace(edges[:-1], edges[1:], 5)[1:]
    held = held_modes(stamps, track.mode, fine.ravel()).reshape(fine.shape)
    votes = np.stack([(held == m).sum(axis=0) for m in range(4)]).astype(np.float64)
    width = 2 * round(LABEL_S / bin_s / 2) + 1
    smooth = np.stack(
        [np.convolve(np.pad(v, width // 2, mode="edge"), np.ones(width), "valid") for v in votes]
    )
    return np.asarray(smooth.argmax(axis=0), np.float64)


def held_modes(stamps: F64, modes: I8, at: F64) -> I8:
    """The mode that holds at each time; before the first, the first."""
    return np.asarray(modes[np.maximum(np.searchsorted(stamps, at, side="right") - 1, 0)])

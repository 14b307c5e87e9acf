"""A log as the model reads it: poses averaged over short bins, and efforts as they act between them."""

from dataclasses import dataclass, field, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from wmr_replay.differentiate.noise import robust_sigma
from wmr_replay.gap.model.inputs import TorqueHistory, are_known
from wmr_replay.gap.model.recent import Recent
from wmr_replay.gap.settings import GateSettings
from wmr_replay.gap.settings.log import BinSettings
from wmr_replay.pipeline.whole_colour import WholeColour, whole_colour
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.modes import MODES, ContactMode
from wmr_schemas.signals import Log, ModeTrack, PoseTrack

VOTES_PER_STEP = 4
OF_COMPONENT = [0, 0, 1]
"""Of x, y and yaw, whether it is a position or the yaw."""
PASSES_BYTES, INPUTS_BYTES, FITS_BYTES = 16_000_000, 12_000_000, 24_000_000
"""What a binned log keeps of the last passes, of their inputs and of fits: about a hundred passes of a log of
90 s.
"""

KNOWN_COLOURS: WeakKeyDictionary[PoseTrack, WholeColour] = WeakKeyDictionary()
"""The colours of the logs that are analysed: an analysis bins a log dozens of times."""


def recent_passes() -> Recent[Any]:
    """The last passes of the filter, tuples of arrays."""
    return Recent(PASSES_BYTES, lambda output: sum(part.nbytes for part in output))


def recent_inputs() -> Recent[F64]:
    """The last inputs of passes."""
    return Recent(INPUTS_BYTES, lambda inputs: inputs.nbytes)


def recent_fits() -> Recent[Any]:
    """The last fits, models or their noise."""
    return Recent(FITS_BYTES, lambda fit: int(getattr(fit, "nbytes", 0)))


@dataclass(frozen=True, eq=False)
class BinnedLog:
    """A log in bins of at most ``bin_s``.

    Mean stamp ``t_s`` (n,) from the first pose; mean pose (n, 3) x, y [m], yaw [rad] unwrapped; poses per bin
    ``count`` (n,); contact mode (n,) over the step that ends at the bin, as float(ContactMode); the torques.
    ``noise_sd`` (3,) is the noise of one pose in x, y [m] and yaw [rad], from the data alone, ``colour`` its
    correlation in time. Changes of the mode are known to ``margin`` bins. ``names_skid`` says whether a skid
    that the modes leave out is an effect. ``settings`` are those of the analysis that the bins are made for.
    ``passes``, ``inputs`` and ``fits`` are what was computed of it last, by what they follow from besides.
    """

    start_ns: int
    t_s: F64
    pose: F64
    count: F64
    mode: F64
    torque: TorqueHistory
    noise_sd: F64
    colour: WholeColour
    log: Log
    track: ModeTrack | None
    margin: int
    names_skid: bool
    settings: GateSettings
    passes: Recent[Any] = field(default_factory=recent_passes, init=False, repr=False)
    inputs: Recent[F64] = field(default_factory=recent_inputs, init=False, repr=False)
    fits: Recent[Any] = field(default_factory=recent_fits, init=False, repr=False)

    def __len__(self) -> int:
        return len(self.t_s)

    @property
    def identified(self) -> bool:
        """Whether the modes come from an identifier, which knows their changes less well than a label."""
        return self.margin > 1

    @property
    def step_s(self) -> F64:
        """Length of each step (n,), the first one 0."""
        return np.diff(self.t_s, prepend=self.t_s[:1])

    @property
    def skids(self) -> Bool:
        """Steps (n,) that skid, slipping or not."""
        return np.isin(self.mode, (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING))

    @property
    def slips(self) -> Bool:
        """Steps (n,) that slip, skidding or not."""
        return np.isin(self.mode, (ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING))

    def unsure(self, skids: Bool) -> F64:
        """1 at the bins (n,) next to a change into or out of skidding, ``skids`` (n,); 0 elsewhere."""
        changed = np.flatnonzero(np.diff(skids))
        near = (changed[:, None] + 1 + np.arange(-self.margin, self.margin + 1)).ravel()
        flags = np.zeros(len(self))
        flags[np.clip(near, 0, len(self) - 1)] = 1.0
        return flags

    @property
    def variances(self) -> F64:
        """Measurement variance of each bin's mean pose (n, 3), that of white noise which says as much."""
        as_white = np.maximum(self.noise_sd**2, self.colour.as_white[OF_COMPONENT])
        return as_white / self.count[:, None]

    @property
    def scatter(self) -> F64:
        """Variance of each bin's mean pose (n, 3) about the true one."""
        scattered = self.noise_sd**2 / self.count[:, None] + self.colour.wobble[OF_COMPONENT]
        return np.minimum(scattered, self.variances)

    def part(self, rows: slice) -> "BinnedLog":
        """Some of the bins, with the same stamps, torques and noise."""
        own = self.t_s[rows], self.pose[rows], self.count[rows], self.mode[rows]
        t_s, pose, count, mode = map(np.ascontiguousarray, own)
        return replace(self, t_s=t_s, pose=pose, count=count, mode=mode)

    def finer(self) -> "BinnedLog":
        """The same rows in bins of half the length."""
        bin_s = self.settings.bins.bin_s
        margin_s = self.margin * bin_s
        whole = bin_log(
            self.log, self.settings, self.track, bin_s / 2, margin_s=margin_s, names_skid=self.names_skid
        )
        mine, halves = bin_of(self.t_s, bin_s), bin_of(whole.t_s, bin_s)
        rows = slice(*np.searchsorted(halves, [mine[0], mine[-1] + 1]).tolist())
        return whole if len(whole.t_s[rows]) == len(whole) else whole.part(rows)

    def relabelled(self, track: ModeTrack) -> "BinnedLog":
        """The same bins with other contact modes, known as well as these."""
        bins = self.settings.bins
        return replace(
            self, mode=mode_at(track, self.t_s, self.start_ns, bins.bin_s, bins.label_s), track=track
        )


def bin_log(
    log: Log,
    settings: GateSettings,
    mode: ModeTrack | None = None,
    bin_s: float | None = None,
    *,
    margin_s: float | None = None,
    names_skid: bool = True,
) -> BinnedLog:
    """``log`` in bins of ``bin_s`` (default: the settings').

    ``mode`` None means ideal rolling throughout. Its changes are known to ``margin_s`` (default: one bin of
    the settings). Raises InvalidSignal without torques and where the log is too short.
    """
    if log.torque is None or not are_known(log.torque).any():
        raise InvalidSignal("torque", "the log has none: nothing to simulate the robot with")
    bins = settings.bins
    bin_s, margin_s = bin_s or bins.bin_s, margin_s or bins.bin_s
    pose, start_ns = log.pose, int(log.pose.t_ns[0])
    t_s = (pose.t_ns - start_ns) / NS_PER_S
    measured = np.stack([pose.x_m, pose.y_m, np.unwrap(pose.yaw_rad)], axis=1)
    starts = bin_starts(t_s, bin_s)
    if len(starts) < bins.least_rows:
        raise InvalidSignal("pose", f"{len(starts)} bins of {bins.bin_s} s; {bins.least_rows} are needed")
    count = np.diff(np.append(starts, len(t_s))).astype(np.float64)
    means = np.add.reduceat(np.column_stack([t_s, measured]), starts, axis=0) / count[:, None]
    return BinnedLog(
        start_ns=start_ns,
        t_s=np.ascontiguousarray(means[:, 0]),
        pose=np.ascontiguousarray(means[:, 1:]),
        count=count,
        mode=mode_at(mode, means[:, 0], start_ns, bin_s, bins.label_s),
        torque=TorqueHistory.of(log.torque, start_ns),
        noise_sd=noise_of(pose, measured, bins),
        colour=colour_of(pose, t_s, measured),
        log=log,
        track=mode,
        margin=round(margin_s / bin_s),
        names_skid=names_skid,
        settings=settings,
    )


def lasts_long(pose: PoseTrack, settings: GateSettings) -> bool:
    """Whether a log is so long that it is analysed in other ways than a short one."""
    return (int(pose.t_ns[-1]) - int(pose.t_ns[0])) / NS_PER_S >= settings.begun.long_s


def bin_starts(t_s: F64, bin_s: float) -> I64:
    """First pose of each bin."""
    return np.flatnonzero(np.diff(bin_of(t_s, bin_s), prepend=-1.0) > 0).astype(np.int64)


def bin_of(t_s: F64, bin_s: float) -> F64:
    """The bin in which each time lies, as a whole number."""
    return np.asarray(np.floor(t_s / bin_s + 1e-6))


def noise_of(pose: PoseTrack, measured: F64, bins: BinSettings) -> F64:
    """Standard deviation (3,) of one pose: x and y share theirs; never below what a file resolves."""
    x, y, yaw = (robust_sigma(pose.t_ns, measured[:, k]) for k in range(3))
    position = max(float(np.sqrt((x**2 + y**2) / 2)), bins.least_position_sd_m)
    return np.array([position, position, max(yaw, bins.least_yaw_sd_rad)])


def colour_of(pose: PoseTrack, t_s: F64, measured: F64) -> WholeColour:
    """The colour of the poses' noise, estimated once for all bins and labels of a log."""
    if pose not in KNOWN_COLOURS:
        KNOWN_COLOURS[pose] = whole_colour(t_s, measured.T)
    return KNOWN_COLOURS[pose]


def mode_at(track: ModeTrack | None, t_s: F64, start_ns: int, bin_s: float, label_s: float) -> F64:
    """The mode (n,) of most of each step, by a majority vote over ``label_s``; ideal without a track."""
    if track is None:
        return np.full(len(t_s), float(ContactMode.IDEAL))
    stamps = (track.t_ns - start_ns) / NS_PER_S
    edges = np.concatenate([[t_s[0] - bin_s], t_s])
    fine = np.linspace(edges[:-1], edges[1:], VOTES_PER_STEP + 1)[1:]
    held = held_modes(stamps, track.mode, fine.ravel()).reshape(fine.shape)
    votes = np.stack([(held == m).sum(axis=0) for m in MODES]).astype(np.float64)
    width = 2 * round(label_s / bin_s / 2) + 1
    smooth = np.stack(
        [np.convolve(np.pad(v, width // 2, mode="edge"), np.ones(width), "valid") for v in votes]
    )
    return np.asarray(smooth.argmax(axis=0), np.float64)


def held_modes(stamps: F64, modes: I8, at: F64) -> I8:
    """The mode that holds at each time; before the first, the first."""
    return np.asarray(modes[np.maximum(np.searchsorted(stamps, at, side="right") - 1, 0)])

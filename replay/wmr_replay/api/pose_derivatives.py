"""A differentiator on a log's pose: noise, size of the derivatives, and the kernel that tuning chooses."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.align import Aligner
from wmr_replay.api.places import Place, place_of
from wmr_replay.api.request import Instant, MappingLike, between_of, mapping_of
from wmr_replay.differentiate import (
    Derivatives,
    Differentiator,
    KernelSpec,
    NoiseTracker,
    robust_sigma,
)
from wmr_replay.differentiate.tuning import TuningResult, tune
from wmr_replay.ingest import LogReader, open_log
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.errors import LogUnusable
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.status import Status

Progress = Callable[[int, int], None]
SIGNALS = (("x", "m"), ("y", "m"), ("yaw", "rad"))
HEAD_ROWS = 5000
"""Rate, noise and the advice of ``tune`` come from as many rows at most."""


@dataclass(frozen=True, eq=False)
class SignalFigures:
    """Noise of one signal, root mean squares of its derivatives of order 1 and 2, and of their sd."""

    name: str
    unit: str
    sigma: float
    rms: tuple[float, float]
    sd: tuple[float, float]


@dataclass(frozen=True, eq=False)
class PoseDerivatives:
    """A differentiator on a log's pose.

    ``head`` holds stamps (n,), pose (3, n), estimates and their sd (3, 3, n) of the log's first rows, for a
    picture.
    """

    rate_hz: float
    n_rows: int
    n_ok: int
    n_gap: int
    mean_coverage: float
    signals: tuple[SignalFigures, ...]
    advice: tuple[TuningResult, ...]
    head: tuple[I64, F64, Derivatives, F64]

    def as_dict(self) -> dict[str, Any]:
        """Without the head."""
        signals = [
            {"name": s.name, "noise_sd": s.sigma, "rms": list(s.rms), "sd": list(s.sd)} for s in self.signals
        ]
        return {
            "rows": self.n_rows,
            "ok": self.n_ok,
            "gap": self.n_gap,
            "coverage": self.mean_coverage,
            "signals": signals,
            "advice": [advice_dict(result) for result in self.advice],
        }


def advice_dict(result: TuningResult) -> dict[str, Any]:
    """The choice and its rivals."""
    named = {"choice": result.choice, "butterworth": result.butterworth, "kalman": result.kalman}
    return {"order": result.order} | {
        name: e and {"label": e.label, "delay_s": e.delay_s, "sd": e.sd, "bias": e.bias, "rmse": e.rmse}
        for name, e in named.items()
    }


def differentiate_pose(
    log: Place,
    *,
    window_s: float = 0.5,
    degree: int = 2,
    kappa: int = 0,
    mu: int = 0,
    theta: float = 0.0,
    shares: tuple[float, ...] = (),
    rate_hz: float | None = None,
    max_delay_s: float | None = None,
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    progress: Progress | None = None,
) -> PoseDerivatives:
    """Send the pose of a log through a differentiator, and measure what comes out.

    Args:
        log: An MCAP file, a ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or a URL.
        window_s: Length T of the window.
        degree: Degree N of the local polynomial.
        kappa: Weight exponent at the window's newest end.
        mu: Weight exponent at the window's oldest end.
        theta: Instant described: 0 is the window's middle, 1 its newest end.
        shares: Shares of the degrees N + 1, N + 2 … that the kernel takes besides.
        rate_hz: Sampling rate; None: the log's.
        max_delay_s: Also find the best kernel at this delay or less (``advice``).
        mapping: Mapping or mapping file.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        progress: Called with bytes read and bytes in all.

    Raises:
        LogUnusable: The log cannot be read, or has fewer than four poses.
        InvalidSetting: A window with too few samples, or a kernel that is not possible.
    """
    place = place_of(log)
    reader = open_log(place, mapping_of(mapping) or LogMapping(), between=between_of(start, end))
    batches = pose_batches(reader, progress)
    first = next(batches)
    t_ns, pose = first
    if len(t_ns) < 4:
        raise LogUnusable(place, f"{len(t_ns)} pose rows are too few to differentiate")
    step_s = float(np.median(np.diff(t_ns))) / NS_PER_S if rate_hz is None else 1 / rate_hz
    sigma = np.array([robust_sigma(t_ns, signal) for signal in pose])
    spec = KernelSpec(degree, kappa, mu, theta, shares)
    differentiator = Differentiator(spec, window_s=window_s, step_s=step_s)
    tracker, sums = NoiseTracker(sigma, step_s=step_s), RunningSums()
    advice = () if max_delay_s is None else advise(t_ns, pose, sigma, step_s, max_delay_s)
    head = None
    for batch_ns, batch in itertools.chain([first], batches):
        out = differentiator.push(batch_ns, batch, np.empty((0, len(batch_ns))))
        sd = out.sd(tracker.push(batch_ns, batch))
        sums.push(out, sd)
        head = head or (batch_ns, batch, out, sd)
    assert head is not None
    if not sums.n_full:
        raise reader.nothing_between(f"the poses end before a window of {window_s:g} s is full,")
    return sums.figures(1 / step_s, sigma, advice, head)


def pose_batches(reader: LogReader, progress: Progress | None) -> Iterator[tuple[I64, F64]]:
    """Stamps and pose (3, n) of a log, in order; the first batch holds 5000 rows, or all."""
    aligner = Aligner()
    held: list[tuple[I64, F64]] = []
    for batch in reader.batches():
        rows = aligner.push(batch)
        held.append((rows.t_ns, rows.pose))
        if progress is not None:
            progress(reader.position_bytes, reader.size_bytes)
        if sum(len(t_ns) for t_ns, _ in held) >= HEAD_ROWS:
            yield concatenated(held)
            held = []
    rows = aligner.finish()
    yield concatenated([*held, (rows.t_ns, rows.pose)])


def concatenated(parts: list[tuple[I64, F64]]) -> tuple[I64, F64]:
    """Consecutive rows as one batch."""
    return np.concatenate([t for t, _ in parts]), np.concatenate([pose for _, pose in parts], axis=1)


def advise(t_ns: I64, pose: F64, sigma: F64, step_s: float, max_delay_s: float) -> tuple[TuningResult, ...]:
    """What ``tune`` finds for x, orders 1 and 2, on the first rows brought to a uniform step."""
    t_s = (t_ns - t_ns[0]) / NS_PER_S
    uniform = np.interp(np.arange(0, t_s[-1], step_s)[:HEAD_ROWS], t_s, pose[0])
    noise = max(float(sigma[0]), 1e-9)
    return tuple(tune(uniform, noise, max_delay_s, step_s=step_s, order=order) for order in (1, 2))


class RunningSums:
    """Counts and sums of squares over the rows of a log."""

    def __init__(self) -> None:
        self._n, self._n_ok, self._n_gap, self._coverage = 0, 0, 0, 0.0
        self._squares = np.zeros((2, len(SIGNALS), 2))

    def push(self, out: Derivatives, sd: F64) -> None:
        """Add a batch of rows."""
        good = out.state == Status.OK
        self._n += len(good)
        self._n_ok += int(np.count_nonzero(good))
        self._n_gap += int(np.count_nonzero(out.state == Status.GAP))
        self._coverage += float(np.sum(out.coverage[good]))
        for k, values in enumerate((out.estimates, sd)):
            self._squares[k] += np.sum(values[:, 1:, good] ** 2, axis=2)

    @property
    def n_full(self) -> int:
        """Rows whose window was full, or would have been without a gap."""
        return self._n_ok + self._n_gap

    def figures(
        self,
        rate_hz: float,
        sigma: F64,
        advice: tuple[TuningResult, ...],
        head: tuple[I64, F64, Derivatives, F64],
    ) -> PoseDerivatives:
        """The means and root mean squares over the rows so far."""
        n = max(self._n_ok, 1)
        rms, sd = np.sqrt(self._squares / n).tolist()
        signals = tuple(
            SignalFigures(name, unit, float(level), tuple(r), tuple(s))
            for (name, unit), level, r, s in zip(SIGNALS, sigma, rms, sd, strict=True)
        )
        return PoseDerivatives(
            rate_hz, self._n, self._n_ok, self._n_gap, self._coverage / n, signals, advice, head
        )

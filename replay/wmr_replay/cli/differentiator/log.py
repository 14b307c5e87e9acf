"""What a differentiator makes of a log's pose."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wmr_replay.align import Aligner
from wmr_replay.cli.progress import byte_progress
from wmr_replay.differentiate import (
    Derivatives,
    Differentiator,
    KernelSpec,
    NoiseTracker,
    robust_sigma,
)
from wmr_replay.ingest import open_log
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.errors import LogUnusable
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.status import Status

if TYPE_CHECKING:
    from wmr_replay.differentiate.tuning import TuningResult

SIGNALS = (("x", "m"), ("y", "m"), ("yaw", "rad"))
HEAD_ROWS = 5000
"""Rate, noise and the advice of ``tune`` come from as many rows at most."""


@dataclass(frozen=True, eq=False)
class SignalEffect:
    """Noise of one signal, root mean squares of its derivatives of order 1 and 2, and of their sd."""

    name: str
    unit: str
    sigma: float
    rms: tuple[float, float]
    sd: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Effect:
    """The differentiator on a log. ``head`` holds stamps, pose, estimates and sd of its first rows, for a
    picture.
    """

    rate_hz: float
    n_rows: int
    n_ok: int
    n_gap: int
    mean_coverage: float
    signals: tuple[SignalEffect, ...]
    advice: tuple["TuningResult", ...]
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

    def lines(self) -> Iterator[str]:
        """For the eye."""
        yield (
            f"\n{self.n_rows} rows, {share(self.n_ok, self.n_rows)} with an estimate, "
            f"{share(self.n_gap, self.n_rows)} behind a gap, coverage {self.mean_coverage:.3f}"
        )
        for s in self.signals:
            first, second = (f"{rms:.3g} ± {sd:.3g}" for rms, sd in zip(s.rms, s.sd, strict=True))
            yield (
                f"{s.name:4}noise {s.sigma:.3g} {s.unit}; rms of the first derivative {first} {s.unit}/s, "
                f"of the second {second} {s.unit}/s²"
            )
        for result in self.advice:
            yield f"\nx, order {result.order}: expected error (noise and bias) on the log's first rows"
            for e in (result.choice, result.butterworth, result.kalman):
                if e is not None:
                    yield f"  {e.rmse:8.3g} ({e.sd:.2g}, {e.bias:.2g}) at {e.delay_s:.3g} s: {e.label}"


def share(part: int, whole: int) -> str:
    """As per cent."""
    return f"{100 * part / max(whole, 1):.1f} %"


def advice_dict(result: "TuningResult") -> dict[str, Any]:
    """The choice and its rivals."""
    named = {"choice": result.choice, "butterworth": result.butterworth, "kalman": result.kalman}
    return {"order": result.order} | {
        name: e and {"label": e.label, "delay_s": e.delay_s, "sd": e.sd, "bias": e.bias, "rmse": e.rmse}
        for name, e in named.items()
    }


def pose_batches(log: Path, mapping: LogMapping) -> Iterator[tuple[I64, F64]]:
    """Stamps and pose (3, n) of a log, in order; the first batch holds 5000 rows, or all."""
    reader, aligner = open_log(log, mapping), Aligner()
    held: list[tuple[I64, F64]] = []
    with byte_progress(f"reading {log.name}") as progress:
        for batch in reader.batches():
            rows = aligner.push(batch)
            held.append((rows.t_ns, rows.pose))
            if progress is not None:
                progress(reader.position_bytes, reader.size_bytes)
            if sum(len(t_ns) for t_ns, _ in held) >= HEAD_ROWS:
                yield joined_rows(held)
                held = []
    rows = aligner.finish()
    yield joined_rows([*held, (rows.t_ns, rows.pose)])


def joined_rows(parts: list[tuple[I64, F64]]) -> tuple[I64, F64]:
    """Consecutive rows as one."""
    return np.concatenate([t for t, _ in parts]), np.concatenate([pose for _, pose in parts], axis=1)


def effect_on(
    log: Path,
    mapping: LogMapping,
    spec: KernelSpec,
    window_s: float,
    rate_hz: float | None,
    max_delay_s: float | None,
) -> Effect:
    """Send the pose of ``log`` through the differentiator."""
    batches = pose_batches(log, mapping)
    first = next(batches)
    t_ns, pose = first
    if len(t_ns) < 4:
        raise LogUnusable(log, f"{len(t_ns)} pose rows are too few to differentiate")
    step_s = float(np.median(np.diff(t_ns))) / NS_PER_S if rate_hz is None else 1 / rate_hz
    sigma = np.array([robust_sigma(t_ns, signal) for signal in pose])
    differentiator = Differentiator(spec, window_s=window_s, step_s=step_s)
    tracker, tally = NoiseTracker(sigma, step_s=step_s), Tally()
    advice = () if max_delay_s is None else advise(t_ns, pose, sigma, step_s, max_delay_s)
    head = None
    for batch_ns, batch in itertools.chain([first], batches):
        out = differentiator.push(batch_ns, batch, np.empty((0, len(batch_ns))))
        sd = out.sd(tracker.push(batch_ns, batch))
        tally.push(out, sd)
        head = head or (batch_ns, batch, out, sd)
    assert head is not None
    return tally.effect(1 / step_s, sigma, advice, head)


def advise(t_ns: I64, pose: F64, sigma: F64, step_s: float, max_delay_s: float) -> tuple["TuningResult", ...]:
    """What ``tune`` finds for x, orders 1 and 2, on the first rows brought to a uniform step."""
    from wmr_replay.differentiate.tuning import tune

    t_s = (t_ns - t_ns[0]) / NS_PER_S
    uniform = np.interp(np.arange(0, t_s[-1], step_s)[:HEAD_ROWS], t_s, pose[0])
    noise = max(float(sigma[0]), 1e-9)
    return tuple(tune(uniform, noise, max_delay_s, step_s=step_s, order=order) for order in (1, 2))


class Tally:
    """Running sums over the log."""

    def __init__(self) -> None:
        self._n, self._n_ok, self._n_gap, self._coverage = 0, 0, 0, 0.0
        self._squares = np.zeros((2, len(SIGNALS), 2))

    def push(self, out: Derivatives, sd: F64) -> None:
        """Take rows in."""
        good = out.state == Status.OK
        self._n += len(good)
        self._n_ok += int(np.count_nonzero(good))
        self._n_gap += int(np.count_nonzero(out.state == Status.GAP))
        self._coverage += float(np.sum(out.coverage[good]))
        for k, values in enumerate((out.estimates, sd)):
            self._squares[k] += np.sum(values[:, 1:, good] ** 2, axis=2)

    def effect(
        self,
        rate_hz: float,
        sigma: F64,
        advice: tuple["TuningResult", ...],
        head: tuple[I64, F64, Derivatives, F64],
    ) -> Effect:
        """The figures."""
        n = max(self._n_ok, 1)
        rms, sd = np.sqrt(self._squares / n).tolist()
        signals = tuple(
            SignalEffect(name, unit, float(level), tuple(r), tuple(s))
            for (name, unit), level, r, s in zip(SIGNALS, sigma, rms, sd, strict=True)
        )
        return Effect(rate_hz, self._n, self._n_ok, self._n_gap, self._coverage / n, signals, advice, head)

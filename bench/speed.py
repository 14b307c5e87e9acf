"""Speed in input samples × signals × orders a second: two orders of three signals, T = .5 s at 1 kHz."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from AlgDiff import AlgebraicDifferentiator
from peers import quiet
from scipy.signal import oaconvolve, savgol_filter

from wmr_replay.differentiate import Derivatives, Differentiator, KernelSpec, uniform_taps
from wmr_replay.differentiate.stream import joined
from wmr_schemas.arrays import F64, I64

STEP_S, WINDOW_S, BATCH = 0.001, 0.5, 10_000
N_ROWS, N_SIGNALS, N_ORDERS = 400_000, 3, 2
SPEC = KernelSpec(2)


def best_of_three(work: Callable[[], object]) -> float:
    """Shortest time [s] of three runs, after one to warm up."""
    work()
    times = []
    for _ in range(3):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def stream(t_ns: I64, samples: F64, batch: int) -> Iterator[Derivatives]:
    """Derivatives of our differentiator, batch by batch."""
    stage = Differentiator(SPEC, window_s=WINDOW_S, step_s=STEP_S)
    for a in range(0, len(t_ns), batch):
        stamps = t_ns[a : a + batch]
        yield stage.push(stamps, samples[:, a : a + batch], np.empty((0, len(stamps))))


def consume(t_ns: I64, samples: F64) -> int:
    """Consume every batch without keeping it; return the number of rows."""
    return sum(len(part.state) for part in stream(t_ns, samples, BATCH))


def same_bits(t_ns: I64, samples: F64) -> bool:
    """Whether batches of 10,000 and of 777 rows give the same bits on the first 50,000 rows."""
    one, other = (joined(list(stream(t_ns[:50_000], samples[:, :50_000], size))) for size in (BATCH, 777))
    return np.array_equal(one.estimates, other.estimates, equal_nan=True)


def algdiff_work(samples: F64) -> Callable[[], object]:
    """AlgDiff's batch call for both orders and all signals."""
    with quiet():
        peers = [
            AlgebraicDifferentiator(ts=STEP_S, alpha=n, beta=n, N=2 - n, T=WINDOW_S, display=False)
            for n in (1, 2)
        ]
        for n, peer in enumerate(peers, 1):
            peer.discretize(n, "mid-point")
    return lambda: [peer.estimateDer(n, x) for n, peer in enumerate(peers, 1) for x in samples]


LABELS = {
    "ours": "ours, streaming, three orders",
    "np.convolve": "np.convolve, batch",
    "AlgDiff": "AlgDiff, batch",
    "oaconvolve": "oaconvolve, batch (not bit-identical)",
    "savgol_filter": "savgol_filter, batch (not causal)",
}


@dataclass(frozen=True)
class Speeds:
    """Samples × signals × orders a second by name; irregular windows a second; whether bits agree."""

    rates: dict[str, float]
    windows: float
    same_bits: bool

    def lines(self) -> list[list[str]]:
        """Rows of the table."""
        convolve = self.rates["np.convolve"]
        rows = [[LABELS[n], f"{rate:.3g}", f"{rate / convolve:.2f}"] for n, rate in self.rates.items()]
        return [*rows, ["ours, irregular stamps, windows a second", f"{self.windows:.3g}", "–"]]


def measure_speeds() -> Speeds:
    """Measure all speeds, one after the other."""
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((N_SIGNALS, N_ROWS)).cumsum(axis=1)
    t_ns = 10**18 + np.arange(N_ROWS) * 1_000_000
    jittered = t_ns + rng.integers(-100_000, 100_000, N_ROWS)
    taps = uniform_taps(SPEC, round(WINDOW_S / STEP_S) + 1, STEP_S)[1:]
    work: dict[str, Callable[[], object]] = {
        "ours": lambda: consume(t_ns, samples),
        "np.convolve": lambda: [np.convolve(x, h, "valid") for h in taps for x in samples],
        "AlgDiff": algdiff_work(samples),
        "oaconvolve": lambda: [oaconvolve(x, h, "valid") for h in taps for x in samples],
        "savgol_filter": lambda: [savgol_filter(x, 501, 2, n, STEP_S) for n in (1, 2) for x in samples],
    }
    count = N_ROWS * N_SIGNALS * N_ORDERS
    rates = {name: count / best_of_three(run) for name, run in work.items()}
    windows = N_ROWS / best_of_three(lambda: consume(jittered, samples))
    return Speeds(rates, windows, same_bits(t_ns, samples) and same_bits(jittered, samples))

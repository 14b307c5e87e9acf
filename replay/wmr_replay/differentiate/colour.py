"""Colour of a signal's noise: white, a wobble that lasts for a time, and motion, told apart by scale.

Third differences of the means of four neighbouring blocks (a Hadamard variance) leave constant acceleration
out. Their mean square by the blocks' length b is A(b) = w/b for white noise; rises and falls about the
correlation time for a wobble, a first-order process; and grows as b³ and b⁵ for motion whose velocity or
acceleration jumps. A fit of all four says how much of each there is.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from wmr_replay.differentiate.design import KernelSpec, uniform_taps
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

BLOCK_DIFFERENCE = np.array([1.0, -3.0, 3.0, -1.0]) / np.sqrt(20.0)
TIMES_S = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)
"""Correlation times that are tried; a drift that never returns counts as the longest."""
LONGEST_S, MOST_PER_S = 0.65, 100.0
"""Blocks are no longer: motion hides noise beyond. So many differences of a scale in a second are enough."""
LEAST_DIFFERENCES, TRUSTED = 8.0, 200.0
"""Fewer say nothing of a scale. More are not trusted more: no shape is exact (200: to 10 %)."""
MOTION_RULES = 30.0
"""Behind the first scale with so many times the least mean square, motion alone is seen."""
EVIDENCE, LEAST_GAIN = 6.0, 1.1
"""Deviance that a wobble has to explain (of 1296 looks at clean logs 95 % give less than .9, all less than
3); and the least factor on a derivative's variance that counts."""
NEARLY_AS_GOOD = 1.0
"""Of two times that explain about as much, the longer is taken: its intervals are wider."""
UNEVEN = 1.5
"""Four blocks that span more than this times their nominal length hold a hole."""
SUBSETS = np.array([s for s in product((0.0, 1.0), repeat=4) if any(s)])
WHITE, WOBBLE, VELOCITY, ACCELERATION = range(4)
WITHOUT_WOBBLE = np.array([1.0, 0.0, 1.0, 1.0])
REWEIGHTINGS = 5


class Scale:
    """Third differences of the means of blocks of b rows: their number, and squares of position and yaw."""

    def __init__(self, b: int, step_s: float) -> None:
        self.b, self._span_s = b, 3 * b * step_s * UNEVEN
        self.stride = 1 << int(np.log2(max(1.0, 1 / (MOST_PER_S * b * step_s))))
        self._tail, self._n = np.empty((5, 0)), 0
        self._sums = np.zeros(3)

    def push(self, blocks: F64) -> F64:
        """New blocks (5, m): t, x, y, yaw, number of the piece; returns the means of their pairs."""
        held = self._tail.shape[1]
        columns = np.concatenate([self._tail, blocks], axis=1)
        first = self._n - held
        self._n += blocks.shape[1]
        self._tail = columns[:, -3:]
        end = max(held, 3)
        self._add(columns, end + -(end + first) % self.stride)
        odd = held + (held + first + 1) % 2
        second = columns[:, odd::2]
        return (
            0.5 * (columns[:, odd - 1 : odd - 1 + 2 * second.shape[1] : 2] + second) if odd else second[:, :0]
        )

    def _add(self, columns: F64, end: int) -> None:
        """Differences whose last block is ``end`` or a multiple of ``stride`` behind it; none over a hole or
        a jump of the pose.
        """
        if end < columns.shape[1]:
            add_differences(columns, (end, self.stride), self._span_s, self._sums)

    @property
    def level(self) -> tuple[float, float, float]:
        """Independent differences, mean squares of position and yaw."""
        n, position, yaw = self._sums.tolist()
        overlap = 2.3 if self.stride == 1 else 1.2 if self.stride == 2 else 1.0
        return n / overlap, position / max(n, 1.0), yaw / max(n, 1.0)


@lean
def add_differences(columns: F64, rows: tuple[int, int], span_s: float, sums: F64) -> None:
    """To number and squares (3,) the third differences of blocks (5, n): of those from a first one on, by a
    stride, each with the three before it, weighted by when they were.
    """
    t, x, y, yaw, piece = columns[0], columns[1], columns[2], columns[3], columns[4]
    for d in range(rows[0], columns.shape[1], rows[1]):
        a, b, c = d - 3, d - 2, d - 1
        whole = t[d] - t[a]
        if not (whole <= span_s and piece[a] == piece[d]):
            continue
        p, q, r = (t[b] - t[a]) / whole, (t[c] - t[b]) / whole, (t[d] - t[c]) / whole
        w_a, w_b = -1 / (p * (p + q)), 1 / (p * q * (q + r))
        w_c, w_d = -1 / ((p + q) * q * r), 1 / ((q + r) * r)
        size = math.sqrt(w_a * w_a + w_b * w_b + w_c * w_c + w_d * w_d)
        off_x = (w_a * (x[a] - x[d]) + w_b * (x[b] - x[d]) + w_c * (x[c] - x[d])) / size
        off_y = (w_a * (y[a] - y[d]) + w_b * (y[b] - y[d]) + w_c * (y[c] - y[d])) / size
        off_yaw = (w_a * (yaw[a] - yaw[d]) + w_b * (yaw[b] - yaw[d]) + w_c * (yaw[c] - yaw[d])) / size
        square_x, square_y, square_yaw = off_x * off_x, off_y * off_y, off_yaw * off_yaw
        if math.isfinite(square_x) and math.isfinite(square_y) and math.isfinite(square_yaw):
            sums[0] += 1.0
            sums[1] += 0.5 * (square_x + square_y)
            sums[2] += square_yaw


class Scales:
    """Rows in, Hadamard variances by scale out; the same bits in any batches."""

    def __init__(self, step_s: float) -> None:
        n = int(np.log2(max(LONGEST_S / step_s, 1.0))) + 1
        self.scales = [Scale(1 << k, step_s) for k in range(n)]

    def push(self, rows: F64) -> None:
        """Rows (5, n): t in s, x, y, yaw, number of the piece between jumps."""
        for scale in self.scales:
            if not rows.shape[1]:
                break
            rows = scale.push(rows)

    def levels(self) -> tuple[F64, F64]:
        """Independent differences (k,), and mean squares (2, k) of position and yaw."""
        found = np.array([scale.level for scale in self.scales]).T
        return found[0], found[1:]


def products_by_lag(one: F64, other: F64) -> F64:
    """Σ_ij one_i other_j over |i − j| = 0, 1 … n − 1, of two series (n,)."""
    n = 1 << int(np.ceil(np.log2(2 * len(one))))
    crossed = np.fft.irfft(np.fft.rfft(one, n) * np.conj(np.fft.rfft(other, n)), n)
    found = crossed[: len(one)].copy()
    found[1:] += crossed[: -len(one) : -1]
    return found


def correlated(by_lag: F64, times_s: F64, step_s: float) -> F64:
    """Σ_ij one_i other_j exp(−|i − j| step/τ) for each τ (k,), of products by lag (n,)."""
    return np.asarray(np.exp(-np.arange(len(by_lag)) * step_s / times_s[:, None]) @ by_lag)


def shapes_of(blocks: list[int], step_s: float) -> F64:
    """Mean squares (τ, k, 4) by correlation time, scale and source, each of unit size.

    White noise and wobble of unit variance; jumps of the velocity of 1 (m/s)²/s, of the acceleration of
    1 (m/s²)²/s.
    """
    times = np.array(TIMES_S)
    out = np.empty((len(times), len(blocks), 4))
    for k, b in enumerate(blocks):
        weights = np.repeat(BLOCK_DIFFERENCE, b) / b
        out[:, k, WHITE] = 1 / b
        out[:, k, WOBBLE] = correlated(products_by_lag(weights, weights), times, step_s)
        velocity = np.cumsum(np.cumsum(weights)) * step_s
        out[:, k, VELOCITY] = (velocity**2).sum() * step_s
        out[:, k, ACCELERATION] = (np.cumsum(velocity) ** 2).sum() * step_s**3
    return out


@dataclass(frozen=True)
class Colour:
    """What a signal's noise consists of: variances of its white part and its wobble, the wobble's correlation
    time, jumps of velocity and acceleration in (m/s)²/s and (m/s²)²/s, and the mean square of neighbouring
    rows' differences, which a tracker of white noise takes for the variance. ``evidence``: the deviance that
    the wobble explains.
    """

    white: float
    wobble: float
    time_s: float
    velocity_jumps: float
    acceleration_jumps: float
    tracked: float
    evidence: float


def known_scales(n: F64, squares: F64, shapes: F64) -> tuple[F64, F64, F64] | None:
    """Of the scales that say something of noise: how far each is trusted, its mean square out of ``squares``
    (k,) of ``n`` (k,) differences, and its shapes. None where these are too few.
    """
    known = n >= LEAST_DIFFERENCES
    least = np.minimum.accumulate(np.where(squares > 0, squares, np.inf))
    far = np.flatnonzero(squares > MOTION_RULES * least)
    if len(far):
        known[far[0] + 1 :] = False
    if known.sum() < 4 or not (squares[known] > 0).all():
        return None
    return np.minimum(n[known], TRUSTED), squares[known], shapes[:, known]


@dataclass(frozen=True)
class Explained:
    """Sizes (τ, 4) of the four sources for each correlation time and the deviance (τ,) that they leave; and
    the same without a wobble, (4,) and a number.
    """

    sizes: F64
    deviance: F64
    sizes_white: F64
    deviance_white: float
    tracked: float
    """Mean square of neighbouring rows' differences, a tracker's variance of white noise."""


def explanations(n: F64, squares: F64, shapes: F64) -> Explained | None:
    """What explains the mean squares (k,) of ``n`` (k,) differences best, with each correlation time and
    without a wobble; None where too few scales tell.
    """
    known = known_scales(n, squares, shapes)
    if known is None:
        return None
    trust, seen, shapes = known
    sizes, deviance = explained(trust, seen, np.concatenate([shapes, shapes[:1] * WITHOUT_WOBBLE]))
    return Explained(sizes[:-1], deviance[:-1], sizes[-1], float(deviance[-1]), float(squares[0]))


def colour_of(found: Explained) -> Colour:
    """The colour that explains most; of two times that do, the longer."""
    deviance = found.deviance
    at = int(np.flatnonzero(deviance <= deviance.min() + NEARLY_AS_GOOD)[-1])
    white, wobble, velocity, acceleration = found.sizes[at].tolist()
    evidence = found.deviance_white - float(deviance[at]) if wobble else 0.0
    return Colour(white, wobble, TIMES_S[at], velocity, acceleration, found.tracked, evidence)


def explained(trust: F64, seen: F64, shapes: F64) -> tuple[F64, F64]:
    """Sizes (τ, 4), not negative, with which the shapes (τ, k, 4) explain the mean squares best, and the
    deviance (τ,) that is left.
    """
    model = np.broadcast_to(seen, shapes.shape[:2])
    sizes = np.zeros((len(shapes), 4))
    for _ in range(REWEIGHTINGS):
        weight = np.sqrt(trust) / model
        columns = shapes * weight[:, :, None]
        scale = np.sqrt((columns**2).sum(axis=1)) + 1e-300
        columns = columns / scale[:, None]
        target = seen * weight
        square = np.einsum("tki,tkj->tij", columns, columns)
        pull = np.einsum("tki,tk->ti", columns, target)
        mask = SUBSETS[None, :, :, None] * SUBSETS[None, :, None, :]
        systems = square[:, None] * mask + np.eye(4) * (1 - SUBSETS[None, :, :, None] + 1e-9)
        found = np.linalg.solve(systems, (pull[:, None] * SUBSETS)[..., None])[..., 0]
        left = (target[:, None] - np.einsum("tki,tsi->tsk", columns, found)) ** 2
        cost = np.where((found >= 0).all(axis=2), left.sum(axis=2), np.inf)
        best = np.argmin(cost, axis=1)
        sizes = found[np.arange(len(best)), best] / scale
        model = np.maximum(np.einsum("tki,ti->tk", shapes, sizes), 1e-3 * seen)
    ratio = seen / model
    return sizes, np.asarray((trust * (ratio - 1 - np.log(ratio))).sum(axis=1))


@dataclass(frozen=True)
class KernelNoise:
    """Of one signal and kernel: factors on s² G_ab for (a, b) = (0, 0), (0, 1), (1, 1), (2, 2), with s² the
    tracked variance, and the mean squares of the kernel's bias for the orders 0, 1, 2.
    """

    factors: tuple[float, float, float, float]
    biases: tuple[float, float, float]


PAIRS = ((0, 0), (0, 1), (1, 1), (2, 2))


@dataclass(frozen=True, eq=False)
class KernelSums:
    """What a colour's factors and biases are made of: the taps' products by lag (4, n) for each pair of
    orders, and the squares (2, 3) of the errors by a jump of velocity and of acceleration, summed over when
    it was.
    """

    by_lag: F64
    squares: F64


@lru_cache(maxsize=64)
def kernel_sums(spec: KernelSpec, n_taps: int, step_s: float) -> KernelSums:
    """The sums of a kernel."""
    taps = uniform_taps(spec, n_taps, step_s)
    by_lag = np.stack([products_by_lag(taps[a], taps[b]) for a, b in PAIRS])
    return KernelSums(by_lag, errors_by_jumps(taps, spec.delay_s((n_taps - 1) * step_s), step_s))


def errors_by_jumps(taps: F64, delay_s: float, step_s: float) -> F64:
    """∫ e² dt (2, 3) of the errors of the orders 0, 1, 2 by a unit jump of velocity, and of acceleration."""
    k = np.arange(taps.shape[1], dtype=float)
    ages = k * step_s
    sums = [np.cumsum(taps * power, axis=1) - taps * power for power in (1.0, k, k * k)]
    ago = np.maximum(ages - delay_s, 0.0)
    behind = (ages > delay_s).astype(float)
    velocity = step_s * (k * sums[0] - sums[1]) - np.stack([ago, behind, 0 * ago])
    parabola = 0.5 * step_s**2 * (k * k * sums[0] - 2 * k * sums[1] + sums[2])
    acceleration = parabola - np.stack([0.5 * ago**2, ago, behind])
    return np.stack([(error**2).sum(axis=1) * step_s for error in (velocity, acceleration)])


def kernel_noise(colour: Colour, spec: KernelSpec, n_taps: int, step_s: float) -> KernelNoise:
    """What a colour makes of a kernel's estimates."""
    sums, time_s = kernel_sums(spec, n_taps, step_s), np.array([colour.time_s])
    plain = sums.by_lag[:, 0]
    whole = colour.white * plain + colour.wobble * np.array(
        [correlated(one, time_s, step_s)[0] for one in sums.by_lag]
    )
    known = plain > 0
    factors = np.maximum(whole / np.where(known, colour.tracked * plain, 1.0), 1.0)
    position, speed, acceleration = (
        np.array([colour.velocity_jumps, colour.acceleration_jumps]) @ sums.squares
    ).tolist()
    return KernelNoise(tuple(np.where(known, factors, 1.0).tolist()), (position, speed, acceleration))


def worst_factor(noise: KernelNoise) -> float:
    """The largest factor on the variance of a derivative."""
    return max(noise.factors[2:])

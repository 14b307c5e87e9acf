"""Causal derivatives of sampled signals, with their standard deviations."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from wmr_replay.differentiate import Differentiator, KernelSpec, NoiseTracker, robust_sigma
from wmr_replay.differentiate.tuning import tune
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S
from wmr_schemas.errors import InvalidSetting, InvalidSignal
from wmr_schemas.signals import check_stamps
from wmr_schemas.status import Status
from wmr_schemas.tables import STATUS_DTYPE

MAX_ORDER = 2
TUNING_ROWS = 5000
"""Rows from the start of a signal that a kernel is tuned on."""


@dataclass(frozen=True, eq=False, repr=False)
class Derivative:
    """A derivative of a signal, one estimate per sample.

    The estimate of row k depends on samples up to row k alone and describes the instant ``at_s[k]``, which
    is ``t_s[k]`` − ``delay_s``. It is NaN while the window fills and while a hole in the samples lies in it.

    Attributes:
        t_s: Sampling instants, (n,), as given, in s.
        at_s: Instants that the estimates describe, (n,), in s.
        value: Estimates, the shape of the signal, in units of the signal per sᵒʳᵈᵉʳ.
        sd: Their standard deviations from the signal's noise, the same shape.
        status: ``Status.OK``, ``WARMING_UP`` or ``GAP`` by row, (n,).
        noise_sd: Standard deviation of the signal's noise in its first rows, one per signal.
        spec: The kernel.
        window_s: Its window in s.
    """

    order: int
    t_s: F64
    at_s: F64
    value: F64
    sd: F64
    status: I8
    noise_sd: F64
    spec: KernelSpec
    window_s: float

    @property
    def delay_s(self) -> float:
        """How far behind the sample the described instant lies."""
        return self.spec.delay_s(self.window_s)

    def __repr__(self) -> str:
        size = "×".join(map(str, self.value.shape))
        times = f"window {self.window_s:g} s, delay {self.delay_s:g} s"
        return f"<Derivative of order {self.order}: {size}, {times}>"

    def frame(self) -> pl.DataFrame:
        """As a table: ``t_s, at_s, value, sd, status``; of several signals ``value_0, sd_0, value_1`` …"""
        columns: dict[str, Any] = {"t_s": self.t_s, "at_s": self.at_s}
        if self.value.ndim == 1:
            columns |= {"value": self.value, "sd": self.sd}
        else:
            for k, (value, sd) in enumerate(zip(self.value, self.sd, strict=True)):
                columns |= {f"value_{k}": value, f"sd_{k}": sd}
        status = pl.Series("status", [Status(code).label for code in self.status], dtype=STATUS_DTYPE)
        return pl.DataFrame(columns, nan_to_null=True).with_columns(status)


def differentiate(
    t: npt.ArrayLike,
    x: npt.ArrayLike,
    order: int = 1,
    *,
    window_s: float = 0.5,
    degree: int = 2,
    kappa: int = 0,
    mu: int = 0,
    theta: float = 0.0,
    shares: tuple[float, ...] = (),
    max_delay_s: float | None = None,
    noise_sd: float | None = None,
) -> Derivative:
    """Differentiate samples of a signal causally, by the algebraic differentiator.

    A polynomial of degree ``degree`` is fitted to the samples of the last ``window_s`` seconds, with a
    Jacobi weight of the exponents ``kappa`` and ``mu``; the page on the differentiator has the equations.
    Samples need not be uniform.

    Args:
        t: Sampling instants, (n,), strictly increasing: floats in s, integers or datetime64 in ns.
        x: Samples, (n,) for one signal or (s, n) for several.
        order: 0 (smoothing), 1 or 2.
        window_s: Length T of the window.
        degree: Degree N of the local polynomial, 2 to 8.
        kappa: Weight exponent at the window's newest end.
        mu: Weight exponent at the window's oldest end.
        theta: Instant described: 0 is the window's middle, 1 its newest end.
        shares: Shares of the degrees N + 1, N + 2 … that the kernel takes besides.
        max_delay_s: Instead of a given kernel, tune one on the first rows that has this delay at most.
        noise_sd: Standard deviation of the samples' noise; None: tracked from the samples themselves.

    Raises:
        InvalidSignal: Instants that do not increase, or shapes that do not fit.
        InvalidSetting: An order or kernel that is not possible, or a window with too few samples.

    Example:
        >>> import numpy as np, wmr_replay as wr
        >>> t = np.arange(0, 4, 0.01)
        >>> speed = wr.differentiate(t, np.sin(t), order=1, window_s=0.2)
        >>> bool(np.nanmax(np.abs(speed.value - np.cos(speed.at_s))) < 2e-3)
        True
    """
    if not 0 <= order <= MAX_ORDER:
        raise InvalidSetting(f"the order is 0, 1 or 2, not {order}")
    t_ns, samples = stamps_ns(np.asarray(t)), np.asarray(x, np.float64)
    rows = np.atleast_2d(samples)
    if rows.ndim != 2 or rows.shape[1] != len(t_ns):
        raise InvalidSignal("x", f"has shape {samples.shape}, which does not fit {len(t_ns)} instants")
    if len(t_ns) < 4:
        raise InvalidSignal("x", f"{len(t_ns)} samples are too few to differentiate")
    step_s = float(np.median(np.diff(t_ns))) / NS_PER_S
    sigma = np.array([robust_sigma(t_ns, signal) for signal in rows])
    spec = KernelSpec(degree, kappa, mu, theta, shares)
    if max_delay_s is not None:
        spec, window_s = tuned_kernel(t_ns, rows[0], float(sigma[0]), max_delay_s, step_s, max(order, 1))
    differentiator = Differentiator(spec, window_s=window_s, step_s=step_s)
    out = differentiator.push(t_ns, rows, np.empty((0, len(t_ns))))
    tracked = noise_sd if noise_sd is not None else NoiseTracker(sigma, step_s=step_s).push(t_ns, rows)
    value, sd = out.estimates[:, order], out.sd(tracked)[:, order]
    sd = np.where(np.isfinite(value), sd, np.nan)
    t_s = seconds(np.asarray(t), t_ns)
    return Derivative(
        order,
        t_s,
        t_s - differentiator.delay_s,
        value.reshape(samples.shape),
        sd.reshape(samples.shape),
        out.state,
        sigma if noise_sd is None else np.full(len(rows), noise_sd),
        spec,
        differentiator.window_s,
    )


def stamps_ns(t: np.ndarray[Any, Any]) -> I64:
    """Instants as int64 ns. Raises InvalidSignal unless they increase."""
    if np.issubdtype(t.dtype, np.datetime64):
        t_ns = t.astype("datetime64[ns]").astype(np.int64)
    elif np.issubdtype(t.dtype, np.integer):
        t_ns = t.astype(np.int64)
    else:
        t_ns = np.rint(np.asarray(t, np.float64) * NS_PER_S).astype(np.int64)
    check_stamps("t", t_ns)
    return t_ns


def seconds(t: np.ndarray[Any, Any], t_ns: I64) -> F64:
    """Instants in s: floats as given, others from the first one on."""
    return np.asarray(t, np.float64) if np.issubdtype(t.dtype, np.floating) else (t_ns - t_ns[0]) / NS_PER_S


def tuned_kernel(
    t_ns: I64, signal: F64, sigma: float, max_delay_s: float, step_s: float, order: int
) -> tuple[KernelSpec, float]:
    """Kernel and window of the least expected error, on the first rows brought to a uniform step."""
    t_s = (t_ns - t_ns[0]) / NS_PER_S
    uniform = np.interp(np.arange(0, t_s[-1], step_s)[:TUNING_ROWS], t_s, signal)
    result = tune(uniform, max(sigma, 1e-9), max_delay_s, step_s=step_s, order=order)
    return result.spec, result.window_s

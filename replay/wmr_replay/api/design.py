"""Figures of a differentiator by design: delay, noise, efficiency and bandwidth of each order."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from wmr_replay.differentiate import (
    KernelSpec,
    best_noise_coefficient,
    noise_coefficient,
    root_theta,
    uniform_taps,
)
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

MAX_ORDER = 2


@dataclass(frozen=True)
class OrderFigures:
    """Figures of one derivative order. ``sd`` is that of the estimate, in units of the signal per sⁿ."""

    order: int
    noise_coefficient: float
    sd: float
    efficiency: float
    efficiency_next: float
    bandwidth_hz: float
    root_theta: float


@dataclass(frozen=True, eq=False)
class Design:
    """A differentiator at a sampling rate, with taps (orders, L) newest first."""

    spec: KernelSpec
    window_s: float
    delay_s: float
    rate_hz: float
    sigma: float
    orders: tuple[OrderFigures, ...]
    taps: F64

    def as_dict(self) -> dict[str, Any]:
        """Without the taps."""
        return {
            **asdict(self.spec),
            "window_s": self.window_s,
            "delay_s": self.delay_s,
            "rate_hz": self.rate_hz,
            "noise_sd": self.sigma,
            "n_taps": self.taps.shape[1],
            "orders": [asdict(figures) for figures in self.orders],
        }


def design(
    window_s: float = 0.5,
    rate_hz: float = 100.0,
    *,
    degree: int = 2,
    kappa: int = 0,
    mu: int = 0,
    theta: float = 0.0,
    shares: tuple[float, ...] = (),
    noise_sd: float = 1.0,
) -> Design:
    """Figures of a differentiator at a sampling rate, its window rounded to whole steps.

    Args:
        window_s: Length T of the window.
        rate_hz: Sampling rate.
        degree: Degree N of the local polynomial.
        kappa: Weight exponent at the window's newest end.
        mu: Weight exponent at the window's oldest end.
        theta: Instant described: 0 is the window's middle, 1 its newest end.
        shares: Shares of the degrees N + 1, N + 2 … that the kernel takes besides.
        noise_sd: Standard deviation of the signal's noise.

    Raises:
        InvalidSetting: A window with too few samples, or a kernel that is not possible.

    Example:
        >>> import wmr_replay as wr
        >>> found = wr.design(window_s=0.5, rate_hz=1000, noise_sd=1e-3)
        >>> found.delay_s, round(found.orders[1].noise_coefficient)
        (0.25, 12)
    """
    return design_of(KernelSpec(degree, kappa, mu, theta, shares), window_s, rate_hz, noise_sd)


def design_of(spec: KernelSpec, window_s: float, rate_hz: float, sigma: float) -> Design:
    """The design of a kernel."""
    n_taps = round(window_s * rate_hz) + 1
    if n_taps < spec.top_degree + 2:
        raise InvalidSetting(
            f"a window of {window_s:g} s holds {n_taps} samples at {rate_hz:g} Hz; degree "
            f"{spec.top_degree} needs {spec.top_degree + 2} or more"
        )
    step_s = 1 / rate_hz
    window_s = (n_taps - 1) * step_s
    taps = uniform_taps(spec, n_taps, step_s)[: min(spec.degree, MAX_ORDER) + 1]
    orders = tuple(order_figures(spec, order, taps[order], step_s, sigma) for order in range(len(taps)))
    return Design(spec, window_s, spec.delay_s(window_s), rate_hz, sigma, orders, taps)


def order_figures(spec: KernelSpec, order: int, taps: F64, step_s: float, sigma: float) -> OrderFigures:
    """Figures of one order: the coefficients of the continuous kernel, the sd of the taps."""
    coefficient = noise_coefficient(order, spec)
    best = [best_noise_coefficient(order, degree, spec.theta) for degree in (spec.degree, spec.degree + 1)]
    return OrderFigures(
        order=order,
        noise_coefficient=coefficient,
        sd=sigma * float(np.sqrt(np.sum(taps**2))),
        efficiency=best[0] / coefficient,
        efficiency_next=best[1] / coefficient,
        bandwidth_hz=bandwidth_hz(taps, order, step_s),
        root_theta=root_theta(order, spec),
    )


def bandwidth_hz(taps: F64, order: int, step_s: float) -> float:
    """Lowest frequency at which |H| has left the ideal (2πf)ⁿ by 3 dB, up or down."""
    size = 1024 * len(taps)
    frequencies = np.fft.rfftfreq(size, step_s)[1:]
    ratio = np.abs(np.fft.rfft(taps, size)[1:]) / (2 * np.pi * frequencies) ** order
    off = np.abs(20 * np.log10(np.maximum(ratio, 1e-12))) > 20 * np.log10(np.sqrt(2))
    return float(frequencies[np.argmax(off)]) if off.any() else float(frequencies[-1])

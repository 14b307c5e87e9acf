"""The causal algebraic differentiator."""

from wmr_replay.differentiate.design import KernelSpec, noise_coefficient, root_theta, uniform_taps
from wmr_replay.differentiate.equation10 import kernel_polynomial
from wmr_replay.differentiate.stream import Derivatives, Differentiator
from wmr_replay.differentiate.windows import GAP, OK, WARMING_UP

__all__ = [
    "GAP",
    "OK",
    "WARMING_UP",
    "Derivatives",
    "Differentiator",
    "KernelSpec",
    "kernel_polynomial",
    "noise_coefficient",
    "root_theta",
    "uniform_taps",
]

"""The causal algebraic differentiator; ``differentiate.tuning`` chooses its parameters from data."""

from wmr_replay.differentiate.adaptive import AdaptiveDifferentiator
from wmr_replay.differentiate.design import KernelSpec, root_theta, uniform_taps
from wmr_replay.differentiate.equation10 import kernel_polynomial
from wmr_replay.differentiate.kernel import (
    best_noise_coefficient,
    continuous_kernel,
    efficiency,
    folded_kernel,
    frequency_response,
    noise_coefficient,
)
from wmr_replay.differentiate.noise import NoiseTracker, robust_sigma
from wmr_replay.differentiate.stream import Derivatives, Differentiator

__all__ = [
    "AdaptiveDifferentiator",
    "Derivatives",
    "Differentiator",
    "KernelSpec",
    "NoiseTracker",
    "best_noise_coefficient",
    "continuous_kernel",
    "efficiency",
    "folded_kernel",
    "frequency_response",
    "kernel_polynomial",
    "noise_coefficient",
    "robust_sigma",
    "root_theta",
    "uniform_taps",
]

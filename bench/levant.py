"""Levant's sliding-mode differentiator; no package offers it."""

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled


@compiled
def levant(samples: F64, bound: float, step_s: float, size: int) -> F64:
    """Levant's differentiator (2003) of order ``size`` − 1 by Euler steps: states (size, n).

    ż_i = −λ_i L^{1/(m−i)} |z_i − v|^{(m−i−1)/(m−i)} sign(z_i − v) + z_{i+1}, v the right-hand side above;
    with two states the super-twisting algorithm.
    """
    gains = (1.1, 1.5, 3.0, 5.0)
    state, out = np.zeros(size), np.empty((size, len(samples)))
    state[0] = samples[0]
    for k in range(len(samples)):
        rate = samples[k]
        old = state.copy()
        for i in range(size):
            left = size - i
            error = old[i] - rate
            pull = (
                gains[left - 1] * bound ** (1.0 / left) * abs(error) ** ((left - 1.0) / left) * np.sign(error)
            )
            rate = -pull + (old[i + 1] if i + 1 < size else 0.0)
            state[i] = old[i] + step_s * rate
        out[:, k] = state
    return out

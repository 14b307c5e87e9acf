"""An actuator's first-order lag: the torque that acts, from the torque that was commanded and held."""

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled


@compiled
def lagged_means(t_ns: I64, inputs: F64, before_ns: int, time_constant_s: float, state: F64) -> F64:
    """Means over the intervals (t_{i−1}, t_i] of y with T ẏ = u − y, u constant over each interval.

    y(t_i) = u + (y(t_{i−1}) − u) e^{−h/T}; its mean is u + (y(t_{i−1}) − u)(T/h)(1 − e^{−h/T}). ``inputs``
    (k, n), ``state`` (k,) is y at ``before_ns`` and is carried on in place; NaN starts at the first known
    input.
    """
    out = np.empty_like(inputs)
    for i in range(t_ns.shape[0]):
        step = (t_ns[i] - before_ns) * 1e-9
        left = np.exp(-step / time_constant_s)
        for k in range(inputs.shape[0]):
            u = inputs[k, i]
            away = 0.0 if np.isnan(state[k]) else state[k] - u
            share = (1.0 - left) * time_constant_s / step if step > 0.0 else 1.0
            out[k, i] = u + away * share
            state[k] = u + away * left
        before_ns = t_ns[i]
    return out


class Lag:
    """Stage: inputs (k, n) as commanded → as they act."""

    def __init__(self, time_constant_s: float, n_inputs: int) -> None:
        self._time_constant_s, self._state = time_constant_s, np.full(n_inputs, np.nan)
        self._before_ns: int | None = None

    def push(self, t_ns: I64, inputs: F64) -> F64:
        """Inputs (k, n) as they act, from rows of increasing stamps."""
        if not t_ns.size:
            return inputs
        before_ns = int(t_ns[0]) if self._before_ns is None else self._before_ns
        self._before_ns = int(t_ns[-1])
        return np.asarray(lagged_means(t_ns, inputs, before_ns, self._time_constant_s, self._state))

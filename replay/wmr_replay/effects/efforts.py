"""Torques as they act: imbalance, bias, dead zone, saturation, lag and delay."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from wmr_replay.effects.theta import Values
from wmr_schemas.arrays import F64


class InputEffects(NamedTuple):
    """Parameters of the effects on the torques; 0 (infinity for the limit) is none."""

    imbalance: float = 0.0
    bias_common_nm: float = 0.0
    bias_differential_nm: float = 0.0
    deadzone_nm: float = 0.0
    limit_nm: float = np.inf
    lag_s: float = 0.0
    delay_s: float = 0.0

    @property
    def static(self) -> bool:
        """Whether there is any that acts at once."""
        return self._replace(lag_s=0.0, delay_s=0.0) != InputEffects()


FIELDS = {
    ("torque_imbalance", "ratio"): "imbalance",
    ("torque_bias_common", "bias_nm"): "bias_common_nm",
    ("torque_bias_differential", "bias_nm"): "bias_differential_nm",
    ("torque_deadzone", "threshold_nm"): "deadzone_nm",
    ("torque_saturation", "limit_nm"): "limit_nm",
    ("actuator_lag", "time_constant_s"): "lag_s",
    ("input_delay", "delay_s"): "delay_s",
}
UNIT_CHANGES = {
    "torque_imbalance": lambda left, right: (-left, right),
    "torque_bias_common": lambda left, right: (np.ones_like(left), np.ones_like(right)),
    "torque_bias_differential": lambda left, right: (-np.ones_like(left), np.ones_like(right)),
}
"""Change of the efforts (left, right) per unit of a parameter, where it is linear."""


def input_effects(effects: Iterable[tuple[str, Values]]) -> InputEffects:
    """The effects on the torques, of effects by name and parameters."""
    found: dict[str, float] = {}
    for name, values in effects:
        for key, value in values.items():
            place = FIELDS.get((name, key))
            if place is not None:
                found[place] = combined(place, found.get(place), value)
    return InputEffects(**found)


def combined(place: str, before: float | None, value: float) -> float:
    """Two effects on one input: the lower limit, or the sum."""
    if before is None:
        return value
    return min(before, value) if place == "limit_nm" else before + value


def static_part(efforts_nm: F64, effects: InputEffects) -> F64:
    """Efforts (2, n), left and right, behind imbalance and bias, then dead zone, then saturation."""
    e = effects
    u = efforts_nm * np.array([[1 - e.imbalance], [1 + e.imbalance]])
    u = u + e.bias_common_nm + e.bias_differential_nm * np.array([[-1.0], [1.0]])
    if e.deadzone_nm > 0:
        u = np.sign(u) * np.maximum(np.abs(u) - e.deadzone_nm, 0.0)
    return np.asarray(np.clip(u, -e.limit_nm, e.limit_nm))

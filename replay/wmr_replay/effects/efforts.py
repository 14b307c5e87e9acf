"""Torques as they act: imbalance, bias, dead zone, saturation, lag and delay."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from wmr_replay.effects.theta import Values
from wmr_schemas.arrays import F64


class InputEffects(NamedTuple):
    """Parameters of the effects on the torques; 0 (infinity for the limit) is none.

    ``corner_share`` is the share of a threshold over which a dead zone and a limit set in; 0 is at once.
    """

    imbalance: float = 0.0
    bias_common_nm: float = 0.0
    bias_differential_nm: float = 0.0
    deadzone_nm: float = 0.0
    limit_nm: float = np.inf
    lag_s: float = 0.0
    delay_s: float = 0.0
    corner_share: float = 0.0

    @property
    def static(self) -> bool:
        """Whether there is any that acts at once."""
        return self._replace(lag_s=0.0, delay_s=0.0, corner_share=0.0) != InputEffects()


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
        u = u - limited(u, e.deadzone_nm, e.corner_share)
    return limited(u, e.limit_nm, e.corner_share) if np.isfinite(e.limit_nm) else u


def limited(u: F64, limit: float, corner_share: float) -> F64:
    """U between ±L, with round corners for a share ρ > 0:

        w − s(w − L) + s(−w − L),    s(x) = ρL ln(1 + e^(x/(ρL))),    w = u coth(1/(2ρ))

    the mean of a sharp limit over a logistic scatter of w, with slope 1 at u = 0.
    """
    if corner_share * limit == 0.0:
        return np.asarray(np.clip(u, -limit, limit))
    width, w = corner_share * limit, u / np.tanh(0.5 / corner_share)
    above, below = (width * softplus((sign * w - limit) / width) for sign in (1.0, -1.0))
    return np.asarray(w - above + below)


def softplus(x: F64) -> F64:
    """Ln(1 + eˣ), which does not overflow; in half the time of ``logaddexp``, and as close beside 1."""
    return np.asarray(np.maximum(x, 0.0) + np.log(1.0 + np.exp(-np.abs(x))))

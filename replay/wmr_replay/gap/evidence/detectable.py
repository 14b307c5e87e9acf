"""The smallest size of each effect that the log would have shown, and whether it excites them at all."""

from collections.abc import Mapping

import numpy as np
from scipy.stats import norm

from wmr_replay.gap.model.candidates import BY_NAME
from wmr_replay.gap.result.result import Detectable
from wmr_replay.gap.search.scan import Scanned
from wmr_schemas.effects import EFFECTS

LEVEL, POWER = 0.01, 0.9
NO_DISTANCE = ("torque_saturation", "undeclared_skid")
"""Effects whose parameter is not 0 where the effect is not."""

RELEVANT: Mapping[str, float] = {
    "payload": 0.3,
    "yaw_inertia": 0.4,
    "drive_gain": 0.25,
    "rolling_resistance": 0.15,
    "viscous_drag": 0.2,
    "aerodynamic_drag": 0.2,
    "scrub_torque": 0.15,
    "yaw_damping": 0.6,
    "torque_imbalance": 0.15,
    "actuator_lag": 0.15,
    "input_delay": 0.15,
    "com_offset": 0.05,
    "heading_misalignment": 0.05,
    "yaw_drift": 0.002,
}
"""Sizes that matter to the people who drive robots; a log that would not show them says nothing."""


def minimum_detectable(scanned: Scanned) -> Mapping[str, Detectable]:
    """Size at which a test at 1 %, corrected for everything scanned, finds an effect nine times in ten:
    (z₁ + z₂)/√(ψᵀψ), with the other effects of the model projected out; for a grid's effect, by its smallest
    point.
    """
    tried = sum(lead.tried for lead in scanned.leads)
    z = float(norm.isf(LEVEL / tried / 2) + norm.isf(1 - POWER))
    found = {}
    for name, (value, information) in scanned.unit_information.items():
        if name in NO_DISTANCE:
            continue
        keys = EFFECTS[name].parameters
        if information > 0:
            key = next(iter(BY_NAME[name].free))
            found[name] = Detectable(abs(value) * z / float(np.sqrt(information)), keys[key])
    return found


def unseen(detectable: Mapping[str, Detectable]) -> tuple[str, ...]:
    """Effects of a size that matters which the log would not have shown."""
    return tuple(
        name for name, size in RELEVANT.items() if name not in detectable or detectable[name].value > size
    )

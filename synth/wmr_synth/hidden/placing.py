"""Where an effect lies whose place is not given."""

from dataclasses import replace

import numpy as np

from wmr_schemas.model_file import Effect

PATCH_SHARE = (0.2, 0.5)
"""A drawn patch lies where the robot drives hard, at a moment within these shares of the log."""


def is_open(effect: Effect) -> bool:
    """Whether the effect's place is still to be decided."""
    return any(np.isnan(value) for value in effect.parameters.values())


def placed_at(effect: Effect, x_m: float, y_m: float) -> Effect:
    """The effect with a place that is still open at (x, y)."""
    there = {"x_m": x_m, "y_m": y_m}
    kept = {key: value for key, value in effect.parameters.items() if not np.isnan(value)}
    return replace(effect, parameters={key: (there | kept)[key] for key in effect.parameters})

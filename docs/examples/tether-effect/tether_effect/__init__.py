"""A cable that the robot drags: its length on the ground is the distance from the map's origin.

With r = √(x² + y²), dv_long/dt = … − c·r·tanh(v/.02).
"""

import numpy as np

from wmr_schemas.effects import EffectDeclaration, OwnEffect, Parameter, Range, Separable


class Tether(OwnEffect):
    """The declaration, and the form of the effect in the analysis."""

    declaration = EffectDeclaration(
        name="tether",
        channel="longitudinal",
        formula="−c·r·sgn(v), r the distance from the map's origin",
        parameters={
            "c_per_s2": Parameter("1/s²", step=1e-4, least=0.0, why="a dragged cable never pushes"),
        },
        acts_on="acceleration",
        ranges={"c_per_s2": Range(0.02, 0.06)},
        separable=(Separable(("rolling_resistance",), "drive near the anchor and far from it"),),
        relevant=0.02,
    )

    def acceleration(self, at, values):
        """dv_long/dt (n,) in m/s² of the cable's friction."""
        distance_m = np.hypot(at["x_m"], at["y_m"])
        return -values["c_per_s2"] * distance_m * np.tanh(at["v_mps"] / 0.02)

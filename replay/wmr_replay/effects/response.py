"""How the robot responds to torques, and its tyres to a skid."""

from typing import NamedTuple

from wmr_replay.effects.theta import Theta
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

LEAST_STIFFNESS = 0.02
"""Share of its stiffness that a tyre keeps: with none, v_lat never decays and the step divides by 0."""


class Weights(NamedTuple):
    """How much of each effect in time or space acts, 0 to 1."""

    load: float = 0.0
    patch: float = 0.0
    slip: float = 0.0


NO_WEIGHTS = Weights()


@lean
def response(
    gains: tuple[float, float], slipping: tuple[float, float], acts: Weights, theta: F64
) -> tuple[float, float]:
    """dv_long/dt per N·m of the sum of the efforts, and dw/dt per N·m of their difference.

    ``gains`` are α and α_yaw, ``slipping`` the shares of them that contact leaves (1 without slip):

        α (1 + gain) (1 − patch) (1 − slip) / (1 + mass_ratio) · share / (1 + load)
        α_yaw (1 + gain) (1 − patch) (1 − slip) · share / (1 + inertia_ratio)
    """
    kept = (1.0 - theta[Theta.PATCH] * acts.patch) * (1.0 - theta[Theta.SLIP] * acts.slip)
    gain = (1.0 + theta[Theta.DRIVE_GAIN]) * kept
    ahead = gains[0] * gain / (1.0 + theta[Theta.MASS_RATIO])
    ahead *= slipping[0] / (1.0 + theta[Theta.LOAD_STEP] * acts.load)
    turning = gains[1] * gain * slipping[1]
    turning /= 1.0 + theta[Theta.YAW_INERTIA]
    return ahead, turning


@lean
def with_stiffness(nominal: float, patch: float, theta: F64) -> float:
    """``nominal`` cornering stiffness, or a rate proportional to it, where ``patch`` of a patch acts:
    G (1 + ratio) (1 − patch loss).
    """
    lost = 1.0 - theta[Theta.PATCH] * patch
    return float(nominal * max(1.0 + theta[Theta.CORNERING], LEAST_STIFFNESS) * max(lost, LEAST_STIFFNESS))

"""The candidate library: how each effect is looked for, within what bounds, from which starts."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.model.dynamics import Theta
from wmr_schemas.terms import COEFFICIENT

INF = float("inf")


@dataclass(frozen=True)
class Candidate:
    """One effect: its free parameters with their bounds and the size of a step that changes little."""

    name: str
    bounds: dict[str, tuple[float, float]]
    steps: dict[str, float]
    places: tuple[Theta, ...] = ()
    grid: tuple[float, ...] = ()

    @property
    def free(self) -> tuple[str, ...]:
        """Names of its parameters."""
        return tuple(self.bounds)


def linear(
    name: str, places: tuple[Theta, ...], *, least: float = -INF, most: float = INF, **keys: float
) -> Candidate:
    """An effect that θ holds: each key with the size of its step."""
    return Candidate(name, dict.fromkeys(keys, (least, most)), dict(keys), places)


def gridded(name: str, key: str, bounds: tuple[float, float], step: float, *grid: float) -> Candidate:
    """An effect on the inputs, looked for on a grid of its one parameter."""
    return Candidate(name, {key: bounds}, {key: step}, (), grid)


T = Theta
LIBRARY: tuple[Candidate, ...] = (
    linear("payload", (T.MASS_RATIO,), least=-0.8, most=10.0, mass_ratio=1e-3),
    linear("yaw_inertia", (T.YAW_INERTIA,), least=-0.8, most=10.0, ratio=1e-3),
    linear("drive_gain", (T.DRIVE_GAIN,), least=-0.9, most=10.0, ratio=1e-3),
    linear("rolling_resistance", (T.ROLLING,), least=0.0, c0_mps2=1e-4),
    linear("viscous_drag", (T.VISCOUS,), least=0.0, c1_per_s=1e-4),
    linear("aerodynamic_drag", (T.DRAG,), least=0.0, c2_per_m=1e-4),
    linear("scrub_torque", (T.SCRUB,), least=0.0, d0_mps2=1e-4),
    linear("yaw_damping", (T.YAW_DAMPING,), least=0.0, d1_per_s=1e-4),
    linear("wheel_coulomb", (T.WHEEL_COULOMB,), least=0.0, torque_nm=1e-4),
    linear("wheel_viscous", (T.WHEEL_VISCOUS,), least=0.0, nm_per_radps=1e-5),
    linear("slope", (T.GRADE_X, T.GRADE_Y), grade_x_mps2=1e-4, grade_y_mps2=1e-4),
    linear("com_offset", (T.COM_OFFSET,), offset_m=1e-4),
    linear("heading_misalignment", (T.HEADING,), least=-1.0, most=1.0, angle_rad=1e-4),
    linear("yaw_drift", (T.YAW_DRIFT,), least=-1.0, most=1.0, rate_radps=1e-5),
    linear("pose_lever_arm", (T.ARM_X, T.ARM_Y), x_m=1e-4, y_m=1e-4),
    linear("cornering_stiffness", (T.CORNERING,), least=-0.95, most=20.0, ratio=1e-3),
    linear("torque_imbalance", (), least=-0.9, most=0.9, ratio=1e-4),
    linear("torque_bias_common", (), bias_nm=1e-4),
    linear("torque_bias_differential", (), bias_nm=1e-4),
    gridded("actuator_lag", "time_constant_s", (1e-3, 2.0), 2e-3, 0.03, 0.06, 0.1, 0.16, 0.25, 0.4),
    gridded("input_delay", "delay_s", (-0.5, 1.0), 2e-3, -0.1, -0.05, 0.03, 0.06, 0.1, 0.15, 0.22, 0.3),
    gridded("torque_deadzone", "threshold_nm", (0.0, INF), 1e-3, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8),
    gridded(
        "torque_saturation",
        "limit_nm",
        (0.0, INF),
        1e-3,
        *(0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.6, 0.75, 0.9, 0.96),
    ),
    Candidate(
        "undeclared_skid", {"stiffness_ratio": (0.02, 100.0)}, {"stiffness_ratio": 1e-2}, (T.UNDECLARED,)
    ),
    Candidate(
        "load_step", {"mass_ratio": (-0.8, 10.0), "t0_s": (0.0, INF)}, {"mass_ratio": 1e-3, "t0_s": 0.05}
    ),
    Candidate(
        "slip_interval",
        {"start_s": (0.0, INF), "end_s": (0.0, INF), "loss": (0.0, 0.999)},
        {"start_s": 0.05, "end_s": 0.05, "loss": 1e-3},
    ),
    Candidate(
        "low_friction_patch",
        {"x_m": (-INF, INF), "y_m": (-INF, INF), "radius_m": (0.1, 50.0), "loss": (0.0, 0.999)},
        {"x_m": 0.05, "y_m": 0.05, "radius_m": 0.05, "loss": 1e-3},
    ),
)
BY_NAME = {candidate.name: candidate for candidate in LIBRARY}


def candidate_of(name: str) -> Candidate:
    """A candidate of the library, or a term of the dictionary with its coefficient."""
    found = BY_NAME.get(name)
    return found or Candidate(name, {COEFFICIENT: (-INF, INF)}, {COEFFICIENT: 1e-4})


UNIT_EFFORTS = {
    "torque_imbalance": lambda left, right: (-left, right),
    "torque_bias_common": lambda left, right: (np.ones_like(left), np.ones_like(right)),
    "torque_bias_differential": lambda left, right: (-np.ones_like(left), np.ones_like(right)),
}
"""Change of the efforts per unit of a parameter."""
LOCAL = ("slip_interval", "low_friction_patch")
PLACES = {"t0_s", "start_s", "end_s", "x_m", "y_m", "radius_m"}
"""Parameters that say when or where an effect acts, and not how large it is."""


def is_place(name: str, key: str) -> bool:
    """Whether a parameter says when or where its effect acts."""
    return name in (*LOCAL, "load_step") and key in PLACES

"""Effects by name and parameters → what the filter and the simulation take: θ, input rows, weights."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.dynamics import N_ROW, N_THETA, Base, Row, Theta
from wmr_replay.gap.model.inputs import InputEffects
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import COEFFICIENT, parse_term

Parameters = Mapping[str, float]
LOOSE_MPS = 0.2
EDGE_S, EDGE_M, LOADING_S = 0.15, 0.15, 1.0
"""Edges of the effects in time and space, softened so that their places have a slope."""

IN_THETA: dict[tuple[str, str], Theta] = {
    ("payload", "mass_ratio"): Theta.MASS_RATIO,
    ("yaw_inertia", "ratio"): Theta.YAW_INERTIA,
    ("drive_gain", "ratio"): Theta.DRIVE_GAIN,
    ("rolling_resistance", "c0_mps2"): Theta.ROLLING,
    ("viscous_drag", "c1_per_s"): Theta.VISCOUS,
    ("aerodynamic_drag", "c2_per_m"): Theta.DRAG,
    ("scrub_torque", "d0_mps2"): Theta.SCRUB,
    ("yaw_damping", "d1_per_s"): Theta.YAW_DAMPING,
    ("wheel_coulomb", "torque_nm"): Theta.WHEEL_COULOMB,
    ("wheel_viscous", "nm_per_radps"): Theta.WHEEL_VISCOUS,
    ("slope", "grade_x_mps2"): Theta.GRADE_X,
    ("slope", "grade_y_mps2"): Theta.GRADE_Y,
    ("com_offset", "offset_m"): Theta.COM_OFFSET,
    ("heading_misalignment", "angle_rad"): Theta.HEADING,
    ("yaw_drift", "rate_radps"): Theta.YAW_DRIFT,
    ("pose_lever_arm", "x_m"): Theta.ARM_X,
    ("pose_lever_arm", "y_m"): Theta.ARM_Y,
    ("cornering_stiffness", "ratio"): Theta.CORNERING,
    ("load_step", "mass_ratio"): Theta.LOAD_STEP,
    ("low_friction_patch", "loss"): Theta.PATCH,
    ("slip_interval", "loss"): Theta.SLIP,
}
INPUT_FIELDS = {
    ("torque_imbalance", "ratio"): "imbalance",
    ("torque_bias_common", "bias_nm"): "bias_common_nm",
    ("torque_bias_differential", "bias_nm"): "bias_differential_nm",
    ("torque_deadzone", "threshold_nm"): "deadzone_nm",
    ("torque_saturation", "limit_nm"): "limit_nm",
    ("actuator_lag", "time_constant_s"): "lag_s",
    ("input_delay", "delay_s"): "delay_s",
}


@dataclass(frozen=True)
class Extension:
    """A base model and the effects on top of it, by catalogue name."""

    base: Base
    effects: Mapping[str, Parameters] = field(default_factory=dict)
    wheel_radius_m: float = 1.0
    known: Mapping[str, Parameters] = field(default_factory=dict)
    """Effects that the base model has already; they act, and are not fitted."""

    def with_effect(self, name: str, parameters: Parameters) -> "Extension":
        """One effect more, or other parameters for one that is there."""
        return Extension(self.base, {**self.effects, name: dict(parameters)}, self.wheel_radius_m, self.known)

    def without(self, name: str) -> "Extension":
        """One effect fewer."""
        rest = {key: value for key, value in self.effects.items() if key != name}
        return Extension(self.base, rest, self.wheel_radius_m, self.known)

    @property
    def acting(self) -> list[tuple[str, Parameters]]:
        """Known and new effects."""
        return [*self.known.items(), *self.effects.items()]

    def theta(self) -> F64:
        """θ of :mod:`~wmr_replay.gap.model.dynamics`."""
        theta = np.zeros(N_THETA)
        for name, parameters in self.acting:
            for key, value in parameters.items():
                place = IN_THETA.get((name, key))
                if place is not None:
                    theta[place] += value
            if name.startswith(UNNAMED_PREFIX):
                theta[[Theta.EXTRA_LONG, Theta.EXTRA_YAW]] = 1.0
            if name == "undeclared_skid":
                theta[Theta.UNDECLARED] = 1.0 / parameters["stiffness_ratio"]
            if name == "wheel_viscous":
                theta[Theta.WHEEL_VISCOUS] /= self.wheel_radius_m
        return theta

    def input_effects(self) -> InputEffects:
        """What the effects do to the torques."""
        found: dict[str, float] = {}
        for name, parameters in self.acting:
            for key, value in parameters.items():
                place = INPUT_FIELDS.get((name, key))
                if place is not None:
                    found[place] = combined(place, found.get(place), value)
        return InputEffects(**found)

    def rows(self, drive: BinnedLog) -> F64:
        """Input rows (n, 11) of :class:`~wmr_replay.gap.model.dynamics.Row`."""
        rows = np.zeros((len(drive), N_ROW))
        rows[:, Row.DT] = drive.step_s
        rows[:, Row.MODE], rows[:, Row.AGE] = drive.mode, drive.t_s
        undeclared = any(name == "undeclared_skid" for name, _ in self.acting)
        rows[:, Row.LOOSE] = LOOSE_MPS * drive.unsure(
            (drive.mode % 2 == 1) | (undeclared & (drive.mode == 0))
        )
        rows[:, [Row.LEFT, Row.RIGHT]] = drive.torque.means(drive.t_s, self.input_effects()).T
        for name, parameters in self.acting:
            if name in WEIGHTS:
                rows[:, WEIGHTS[name]] = weight(name, parameters, drive)
            elif name.startswith(UNNAMED_PREFIX):
                term = parse_term(name)
                rows[:, TERM_COLUMNS[term.channel]] += parameters[COEFFICIENT] * term.evaluate(
                    columns_of(drive)
                )
        return rows


def combined(place: str, before: float | None, value: float) -> float:
    """Two effects on one input: the lower limit, or the sum."""
    if before is None:
        return value
    return min(before, value) if place == "limit_nm" else before + value


TERM_COLUMNS = {"longitudinal": Row.EXTRA_LONG, "yaw": Row.EXTRA_YAW}
WEIGHTS = {"load_step": Row.LOAD, "low_friction_patch": Row.PATCH, "slip_interval": Row.SLIP}


def weight(name: str, p: Parameters, drive: BinnedLog) -> F64:
    """How much of an effect in time or space acts at each row (n,), 0 to 1."""
    if name == "load_step":
        return soft_step((drive.t_s - p["t0_s"]) / LOADING_S)
    if name == "slip_interval":
        return soft_step((drive.t_s - p["start_s"]) / EDGE_S) * soft_step((p["end_s"] - drive.t_s) / EDGE_S)
    distance = np.hypot(drive.pose[:, 0] - p["x_m"], drive.pose[:, 1] - p["y_m"])
    return soft_step((p["radius_m"] - distance) / EDGE_M)


def soft_step(x: F64) -> F64:
    """From 0 to 1 about x = 0."""
    return np.asarray(0.5 * (1 + np.tanh(2 * x)))

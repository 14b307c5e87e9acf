"""A model's effects, by where a replay applies them: parameters, inputs, measured pose, accelerations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from wmr_replay.identify.terms import Terms
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.terms import CHANNELS, COEFFICIENT, parse_term

Parameters = Mapping[str, float]

FOLLOWED = ("load_step", "low_friction_patch", "slip_interval", "undeclared_skid")
"""Effects in time or space: an identifier finds them itself, as a change of α, slipping or skidding."""


@dataclass(frozen=True)
class ReplayModel:
    """A model as a replay uses it; ``notes`` say what was left to the identifier."""

    robot: RobotParameters
    terms: Terms = field(default_factory=Terms)
    effects: tuple[Effect, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def lag_s(self) -> float:
        """Time constant of the actuators, 0 without a lag."""
        return sum(e.parameters["time_constant_s"] for e in self.effects if e.name == "actuator_lag")

    def corrected(self, batch: RawBatch, start_ns: int) -> RawBatch:
        """Torques as the model says that they act, poses as the model says that they are; ``start_ns`` is the
        stamp of the log's first pose.
        """
        if not self.effects:
            return batch
        return RawBatch(
            change_pose(batch.pose, self.effects, start_ns),
            change_torque(batch.torque, self.effects),
            batch.mode,
        )


def replay_model(model: Model, robot: RobotParameters) -> ReplayModel:
    """What a replay makes of a model file; its ``[robot]`` stands over the log's own parameters, key by key.

    Raises InvalidSetting or InvalidTerm for an effect that a replay cannot apply.
    """
    merged = RobotParameters.from_values(robot.known() | model.robot.known(), "model")
    terms = Terms(half_track_m=merged.half_track_m or 0.0)
    for effect in model.effects:
        if effect.name.startswith(UNNAMED_PREFIX):
            terms = with_product(terms, effect)
        merged = SCALES.get(effect.name, keep_robot)(merged, effect.parameters)
        if effect.name in TERMS:
            terms = TERMS[effect.name](terms, effect.parameters, merged)
    notes = tuple(
        f"{e.name} of the model is left to the identifier" for e in model.effects if e.name in FOLLOWED
    )
    return ReplayModel(merged, terms, model.effects, notes)


def keep_robot(robot: RobotParameters, _: Parameters) -> RobotParameters:
    """No change."""
    return robot


def scaled(robot: RobotParameters, ahead: float, turning: float) -> RobotParameters:
    """α and α_yaw times a factor each."""
    alpha, alpha_yaw = robot.alpha, robot.alpha_yaw_or_alpha
    return replace(
        robot,
        alpha=None if alpha is None else alpha * ahead,
        alpha_yaw=None if alpha_yaw is None else alpha_yaw * turning,
    )


def stiffer(robot: RobotParameters, p: Parameters) -> RobotParameters:
    """G_x (1 + ratio)."""
    stiffness = robot.cornering_stiffness_over_epsilon
    changed = None if stiffness is None else stiffness * (1 + p["ratio"])
    return replace(robot, cornering_stiffness_over_epsilon=changed)


SCALES: dict[str, Callable[[RobotParameters, Parameters], RobotParameters]] = {
    "payload": lambda robot, p: scaled(robot, 1 / (1 + p["mass_ratio"]), 1.0),
    "yaw_inertia": lambda robot, p: scaled(robot, 1.0, 1 / (1 + p["ratio"])),
    "drive_gain": lambda robot, p: scaled(robot, 1 + p["ratio"], 1 + p["ratio"]),
    "cornering_stiffness": stiffer,
}


def wheel_viscous(terms: Terms, p: Parameters, robot: RobotParameters) -> Terms:
    """Friction by wheel speed needs the wheel's radius."""
    if robot.wheel_radius_m is None:
        raise InvalidSetting("wheel_viscous needs the robot's wheel_radius_m")
    return terms._replace(wheel_viscous_nm_per_mps=p["nm_per_radps"] / robot.wheel_radius_m)


def com_offset(terms: Terms, p: Parameters, robot: RobotParameters) -> Terms:
    """D ω² ahead; −(l m d/I) v ω in yaw where mass and inertia are known."""
    known = (
        robot.mass_kg is not None and robot.yaw_inertia_kgm2 is not None and robot.half_track_m is not None
    )
    d = p["offset_m"]
    k = robot.half_track_m * robot.mass_kg * d / robot.yaw_inertia_kgm2 if known else 0.0  # type: ignore[operator]
    return terms._replace(com_offset_m=d, com_yaw_per_m2=k)


def with_product(terms: Terms, effect: Effect) -> Terms:
    """An effect that only a term of the dictionary describes."""
    term = parse_term(effect.name)
    if term.channel == "yaw" and terms.half_track_m == 0.0:
        raise InvalidSetting(f"{effect.name} needs the robot's half_track_m")
    row = [CHANNELS.index(term.channel), effect.parameters[COEFFICIENT], *term.powers]
    return terms._replace(products=np.vstack([terms.products, np.array(row, float)]))


TERMS: dict[str, Callable[[Terms, Parameters, RobotParameters], Terms]] = {
    "rolling_resistance": lambda t, p, _: t._replace(rolling_c0_mps2=p["c0_mps2"]),
    "viscous_drag": lambda t, p, _: t._replace(viscous_c1_per_s=p["c1_per_s"]),
    "aerodynamic_drag": lambda t, p, _: t._replace(drag_c2_per_m=p["c2_per_m"]),
    "slope": lambda t, p, _: t._replace(grade_x_mps2=p["grade_x_mps2"], grade_y_mps2=p["grade_y_mps2"]),
    "scrub_torque": lambda t, p, _: t._replace(scrub_d0_mps2=p["d0_mps2"]),
    "yaw_damping": lambda t, p, _: t._replace(damping_d1_per_s=p["d1_per_s"]),
    "wheel_coulomb": lambda t, p, _: t._replace(wheel_coulomb_nm=p["torque_nm"]),
    "wheel_viscous": wheel_viscous,
    "com_offset": com_offset,
}

INPUTS: dict[str, Callable[[F64, Parameters], F64]] = {
    "torque_imbalance": lambda u, p: u * np.array([[1 - p["ratio"]], [1 + p["ratio"]]]),
    "torque_bias_common": lambda u, p: u + p["bias_nm"],
    "torque_bias_differential": lambda u, p: u + p["bias_nm"] * np.array([[-1.0], [1.0]]),
    "torque_deadzone": lambda u, p: np.sign(u) * np.maximum(np.abs(u) - p["threshold_nm"], 0.0),
    "torque_saturation": lambda u, p: np.clip(u, -p["limit_nm"], p["limit_nm"]),
}
"""Commanded efforts (2, n), left and right, as they act."""


def change_torque(rows: Rows, effects: tuple[Effect, ...]) -> Rows:
    """The rows' efforts through every input effect, in the model's order; a delay moves their stamps."""
    values, t_ns = rows.values.copy(), rows.t_ns
    for effect in effects:
        if effect.name in INPUTS:
            values[:2] = INPUTS[effect.name](values[:2], effect.parameters)
        if effect.name == "input_delay":
            t_ns = t_ns + round(effect.parameters["delay_s"] * NS_PER_S)
    return Rows(t_ns, rows.order, values)


def change_pose(rows: Rows, effects: tuple[Effect, ...], start_ns: int) -> Rows:
    """The pose of N behind a misaligned heading (yaw + angle), a drifting one (yaw + rate (t − start)) and a
    lever arm (position + R(yaw) a).
    """
    values = rows.values.copy()
    for effect in effects:
        p = effect.parameters
        if effect.name == "heading_misalignment":
            values[2] -= p["angle_rad"]
        if effect.name == "yaw_drift":
            values[2] -= p["rate_radps"] * (rows.t_ns - start_ns) / NS_PER_S
        if effect.name == "pose_lever_arm":
            cos, sin = np.cos(values[2]), np.sin(values[2])
            values[0] -= cos * p["x_m"] - sin * p["y_m"]
            values[1] -= sin * p["x_m"] + cos * p["y_m"]
    return Rows(rows.t_ns, rows.order, values)

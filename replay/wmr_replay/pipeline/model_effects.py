"""A model's effects, by where a replay applies them: parameters, inputs, measured pose, accelerations.

The formulas are those of :mod:`wmr_replay.effects`, which the gap analysis fits.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from wmr_replay.align.reorder import join
from wmr_replay.effects.efforts import input_effects, static_part
from wmr_replay.effects.measurement import to_axle
from wmr_replay.effects.motion import com_yaw_per_m
from wmr_replay.effects.own import acting, own_accelerations, own_efforts, without_own_errors
from wmr_replay.effects.response import NO_WEIGHTS, response, with_stiffness
from wmr_replay.effects.theta import Theta, Values, theta_of
from wmr_replay.identify.terms import Terms, extra_along
from wmr_replay.identify.wheel_bank.states import PARAMETER_OF
from wmr_replay.pipeline.known_slip import is_known_slip
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.effects import UNNAMED_PREFIX, effects_of
from wmr_schemas.effects.own import Columns
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect, Model, corner_share, friction_speed_mps
from wmr_schemas.robot import RobotParameters
from wmr_schemas.slip_terms import is_slip_term
from wmr_schemas.terms import CHANNELS, COEFFICIENT, Term, parse_term

EFFECTS = effects_of("torque")
"""The effects that a replay by torques applies."""
FOLLOWED = tuple(name for name, effect in EFFECTS.items() if effect.followed)
"""Effects that an identifier finds itself, as a change of α, slipping or skidding."""
OF_WHEELS = effects_of("wheel_speed")
Named = list[tuple[str, Values]]


@dataclass(frozen=True)
class ReplayModel:
    """A model as a replay uses it; ``notes`` name the effects that are left to the identifier."""

    robot: RobotParameters
    terms: Terms = field(default_factory=Terms)
    effects: tuple[Effect, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def named(self) -> Named:
        """Names and parameters of the effects."""
        return [(effect.name, effect.parameters) for effect in self.effects]

    @property
    def lag_s(self) -> float:
        """Time constant of the actuators, 0 without a lag."""
        return input_effects(self.named).lag_s

    @property
    def delay_s(self) -> float:
        """By how much the torques act later than they are stamped."""
        return input_effects(self.named).delay_s

    def corrected(self, batch: RawBatch, start_ns: int) -> RawBatch:
        """Torques as they act and poses of the axle's middle, by the model; ``start_ns`` is the stamp of the
        log's first pose.
        """
        if not self.effects:
            return batch
        torque, wheels = batch.torque, batch.wheels
        if self.delay_s:
            torque, wheels = speeds_apart(torque, wheels)
        return RawBatch(
            change_pose(batch.pose, self.effects, start_ns),
            change_torque(torque, self.effects),
            batch.mode,
            wheels=wheels,
        )

    @property
    def accelerates(self) -> bool:
        """Whether a user's effect adds an acceleration, or a term of factors with numbers, time or place."""
        return bool(acting(self.named, "acceleration") or numbered_terms(self.effects))

    def own_accelerations(self, at: Columns) -> F64:
        """dv_long/dt and l·d(yaw_rate)/dt (2, n) in m/s² that users' effects add, and terms of factors with
        numbers, time or place; 0 where the motion is unknown.
        """
        total = own_accelerations(self.named, at)
        for term, coefficient in numbered_terms(self.effects):
            total[int(term.channel == "yaw")] += coefficient * term.evaluate(as_term_columns(at))
        return np.nan_to_num(total, nan=0.0)

    def as_efforts(self, accelerations: F64) -> F64:
        """Efforts (2, n), left and right in N·m, that give the same accelerations by α and α_yaw."""
        alpha, alpha_yaw = self.robot.alpha, self.robot.alpha_yaw_or_alpha
        assert alpha is not None
        assert alpha_yaw is not None
        mean, half = accelerations[0] / (2 * alpha), accelerations[1] / (2 * alpha_yaw)
        return np.stack([mean - half, mean + half])

    @property
    def gains(self) -> tuple[float, float]:
        """α and α_yaw, 0 where unknown."""
        return self.robot.alpha or 0.0, self.robot.alpha_yaw_or_alpha or 0.0

    def less_resistance(self, efforts: F64, wheels_radps: F64, yaw_rad: F64) -> F64:
        """Efforts (2, n) less what the model's effects on acceleration take, for a bank that has no such
        effects. The speeds are those of the wheels (2, n), which are known at the row's own instant.
        """
        if not self.terms.any:
            return efforts
        left, right = wheels_radps * (self.robot.wheel_radius_m or 0.0)
        v_mps, yaw_rate = (right + left) / 2, (right - left) / (2 * (self.robot.half_track_m or np.inf))
        moving = np.stack([v_mps, np.zeros_like(v_mps), yaw_rad, yaw_rate])
        extra = extra_along(moving, efforts, self.gains, self.terms)
        return efforts + self.as_efforts(np.nan_to_num(extra, nan=0.0))


def replay_model(model: Model, robot: RobotParameters) -> ReplayModel:
    """The replay's form of a model file; its ``[robot]`` replaces the log's own parameters, key by key.

    Raises InvalidSetting or InvalidTerm for an effect that a replay cannot apply.
    """
    merged = RobotParameters.from_values(robot.known() | model.robot.known(), "model")
    model, on_commands = without_commands(model)
    check_needs(model.effects, merged)
    robot = merged
    for effect in model.effects:
        robot = scaled(robot, effect)
    notes = tuple(
        f"{e.name} of the model is left to the identifier" for e in model.effects if e.name in FOLLOWED
    )
    notes += tuple(
        f"{e.name} of the model is not applied by a replay" for e in model.effects if is_left_out(e)
    )
    notes += tuple(
        f"{e.name} of the model acts on commands, which a replay does not use" for e in on_commands
    )
    return ReplayModel(robot, terms_of(model.effects, merged), model.effects, notes)


def without_commands(model: Model) -> tuple[Model, tuple[Effect, ...]]:
    """A model of the wheel-speed base without its effects on commands, and those."""
    if model.provenance.base_model != "wheel_speed":
        return model, ()
    found = tuple(e for e in model.effects if e.name in OF_WHEELS and OF_WHEELS[e.name].needs_commands)
    return replace(model, effects=tuple(e for e in model.effects if e not in found)), found


def is_torque_term(effect: Effect) -> bool:
    """Whether it is a term of the torque base's dictionary."""
    return effect.name.startswith(UNNAMED_PREFIX) and not is_slip_term(effect.name)


def numbered_terms(effects: Iterable[Effect]) -> list[tuple[Term, float]]:
    """The terms of factors with numbers, time or place, with their coefficients, which no bank tabulates; a
    replay knows no distance driven.
    """
    terms = [(parse_term(e.name), e.parameters[COEFFICIENT]) for e in effects if is_torque_term(e)]
    return [(t, c) for t, c in terms if not t.is_listed and "s" not in t.columns and t.channel != "lateral"]


def as_term_columns(at: Columns) -> dict[str, F64]:
    """The columns of users' effects by the names of terms."""
    names = {"t": "t_s", "x": "x_m", "y": "y_m", "yaw": "yaw_rad", "v": "v_mps", "v_lat": "v_lat_mps"}
    columns = {name: at[column] for name, column in names.items()} | {"yaw_rate": at["yaw_rate_radps"]}
    left, right = at["left_nm"], at["right_nm"]
    return columns | {"effort_sum": right + left, "effort_diff": right - left}


def is_left_out(effect: Effect) -> bool:
    """Whether it is an effect of the wheel-speed base that no part of a replay applies, or a term over the
    distance driven, or one with numbers, time or place that acts sideways.
    """
    if is_known_slip(effect.name):
        return False
    if is_slip_term(effect.name):
        return True
    if is_torque_term(effect):
        term = parse_term(effect.name)
        return "s" in term.columns or (not term.is_listed and term.channel == "lateral")
    return effect.name in OF_WHEELS and effect.name not in EFFECTS and effect.name not in PARAMETER_OF


def check_needs(effects: Iterable[Effect], robot: RobotParameters) -> None:
    """The robot has the parameters that the effects need. Raises InvalidSetting naming one that it lacks."""
    for effect in effects:
        term = parse_term(effect.name) if is_torque_term(effect) else None
        if term is not None and term.channel == "yaw" and not robot.half_track_m:
            raise InvalidSetting(f"{effect.name} needs the robot's half_track_m")
        if effect.name == "wheel_viscous" and robot.wheel_radius_m is None:
            raise InvalidSetting("wheel_viscous needs the robot's wheel_radius_m")
        accelerates = acting([(effect.name, effect.parameters)], "acceleration") or numbered_terms([effect])
        if accelerates and robot.alpha is None:
            raise InvalidSetting(f"{effect.name} needs the robot's alpha")


def scaled(robot: RobotParameters, effect: Effect) -> RobotParameters:
    """The robot with α, α_yaw and G_x times the factors of an effect on its parameters."""
    if effect.name not in EFFECTS or EFFECTS[effect.name].followed:
        return robot
    theta = theta_of([(effect.name, effect.parameters)], 1.0)
    if EFFECTS[effect.name].acts_on == "tyre":
        grip = robot.cornering_stiffness_over_epsilon
        stiffer = None if grip is None else with_stiffness(grip, 0.0, theta)
        return replace(robot, cornering_stiffness_over_epsilon=stiffer)
    if EFFECTS[effect.name].acts_on == "robot":
        ahead, turning = response((1.0, 1.0), (1.0, 1.0), NO_WEIGHTS, theta)
        alpha, alpha_yaw = robot.alpha, robot.alpha_yaw_or_alpha
        return replace(
            robot,
            alpha=None if alpha is None else alpha * ahead,
            alpha_yaw=None if alpha_yaw is None else alpha_yaw * turning,
        )
    return robot


def terms_of(effects: Iterable[Effect], robot: RobotParameters) -> Terms:
    """The effects on acceleration as the identifiers take them."""
    named = [(e.name, e.parameters) for e in effects if acts_as_term(e.name)]
    products = [
        [CHANNELS.index(term.channel), effect.parameters[COEFFICIENT], *term.powers]
        for effect in effects
        if is_torque_term(effect)
        for term in [parse_term(effect.name)]
        if term.is_listed
    ]
    theta = theta_of(named, robot.wheel_radius_m or 1.0)
    theta[Theta.FRICTION_SPEED] = friction_speed_mps(e for e in effects if acts_as_term(e.name))
    theta[Theta.SCRUB] *= carried_ratio(effects)
    terms = Terms(theta, robot.half_track_m or 0.0, com_yaw_per_m(robot) * carried_ratio(effects))
    return terms._replace(products=np.array(products, float)) if products else terms


def carried_ratio(effects: Iterable[Effect]) -> float:
    """By how much l m/I of a model is larger than the robot's, and what its weight makes tyres scrub: its
    payloads over its yaw inertias.
    """
    mass = [1.0 + e.parameters["mass_ratio"] for e in effects if e.name == "payload"]
    inertia = [1.0 + e.parameters["ratio"] for e in effects if e.name == "yaw_inertia"]
    return float(np.prod(mass) / np.prod(inertia))


def acts_as_term(name: str) -> bool:
    """Whether a built-in effect acts on acceleration or takes torque from a wheel."""
    return name in EFFECTS and EFFECTS[name].acts_on in ("acceleration", "wheel")


def change_torque(rows: Rows, effects: tuple[Effect, ...]) -> Rows:
    """The rows' efforts as they act: users' effects, imbalance and bias, dead zone, saturation; a delay moves
    their stamps.
    """
    named = [(effect.name, effect.parameters) for effect in effects]
    on_inputs = input_effects(named)._replace(corner_share=corner_share(effects))
    values = rows.values.copy()
    values[:2] = own_efforts(named, values[:2])
    if on_inputs.static:
        values[:2] = static_part(values[:2], on_inputs)
    return Rows(rows.t_ns + round(on_inputs.delay_s * NS_PER_S), rows.order, values)


def speeds_apart(torque: Rows, wheels: Rows) -> tuple[Rows, Rows]:
    """Torques without wheel speeds, and the wheel speeds with stamps of their own: a delay of the torques
    does not move what the encoders measured.
    """
    known = np.isfinite(torque.values[2:]).any(axis=0)
    efforts = np.concatenate([torque.values[:2], np.full_like(torque.values[2:], np.nan)])
    speeds = Rows(torque.t_ns[known], torque.order[known], torque.values[2:, known])
    return Rows(torque.t_ns, torque.order, efforts), join(wheels, speeds)


def change_pose(rows: Rows, effects: tuple[Effect, ...], start_ns: int) -> Rows:
    """The poses of N, without the errors of the measurement that the model has."""
    named = [(effect.name, effect.parameters) for effect in effects]
    on_pose = [(n, p) for n, p in named if n in EFFECTS and EFFECTS[n].acts_on == "pose"]
    age_s = (rows.t_ns - start_ns) / NS_PER_S
    values = without_own_errors(named, age_s, rows.values)
    if on_pose:
        age_ns = (rows.t_ns - start_ns).astype(np.float64)
        values = to_axle(np.ascontiguousarray(values), age_ns, NS_PER_S, theta_of(on_pose, 1.0))
    return Rows(rows.t_ns, rows.order, values)

"""A model's effects in the parameters of MJCF, MuJoCo's format.

Torques are those at a wheel's joint; m is the mass that the wheels drive, 1/(r α) = m_robot + 2 I_φ/r².

    payload               weight in kg            p m
    drive_gain            both gears              × (1 + p)
    torque_imbalance      gears                   right × (1 + g), left × (1 − g)
    torque_bias_…         actuator bias           b, right and left; −b on the left of a differential one
    actuator_lag          activation dynamics     filterexact, T
    input_delay           actuator delay          d
    torque_saturation     forcerange              ± limit
    wheel_coulomb         joint frictionloss      torque
    wheel_viscous         joint damping           N·m/(rad/s)
    rolling_resistance    joint frictionloss      c₀/(2α)
    viscous_drag          joint damping           c₁ r/(2α)
    aerodynamic_drag      joint damping, 2nd      c₂ r²/(2α)
    slope                 gravity                 (g_x, g_y)
    heading_misalignment  site                    turned by β
    pose_lever_arm        site                    at (x, y)
    wheel_scale           wheel radius            × (1 + s)
    wheel_scale_difference                        right × (1 + s), left × (1 − s)
    effective_track       wheel separation        × (1 + t)
"""

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Model
from wmr_schemas.robot import RobotParameters

Parameters = dict[str, float]
Sides = tuple[float, float]


@dataclass(frozen=True)
class MjcfParameters:
    """What to add to a robot's MJCF, or what to multiply by; sides are (left, right).

    ``notes`` say where a parameter does more than the effect; ``beyond`` names effects without a counterpart,
    and why.
    """

    payload_kg: float = 0.0
    frictionloss_nm: float = 0.0
    damping_nm_s: float = 0.0
    damping2_nm_s2: float = 0.0
    gear: Sides = (1.0, 1.0)
    bias_nm: Sides = (0.0, 0.0)
    time_constant_s: float = 0.0
    delay_s: float = 0.0
    limit_nm: float = math.inf
    gravity_mps2: Sides = (0.0, 0.0)
    site_m: Sides = (0.0, 0.0)
    site_rad: float = 0.0
    radius: Sides = (1.0, 1.0)
    track: float = 1.0
    notes: tuple[str, ...] = ()
    beyond: tuple[tuple[str, str], ...] = ()

    @property
    def changed(self) -> tuple[str, ...]:
        """Names of the parameters that differ from those of an unchanged robot."""
        plain = MjcfParameters()
        names = (f.name for f in fields(self) if f.name not in ("notes", "beyond"))
        return tuple(name for name in names if getattr(self, name) != getattr(plain, name))


@dataclass(frozen=True)
class Wheels:
    """α, and the wheels' radius in m. Raises InvalidSetting where a parameter needs what is unknown."""

    robot: RobotParameters

    def half_torque(self, name: str) -> float:
        """1/(2α): torque of each wheel by acceleration ahead."""
        if self.robot.alpha is None:
            raise InvalidSetting(f"{name} in MJCF needs alpha in [robot]")
        return 1 / (2 * self.robot.alpha)

    def radius_m(self, name: str) -> float:
        """Radius of the wheels."""
        if self.robot.wheel_radius_m is None:
            raise InvalidSetting(f"{name} in MJCF needs wheel_radius_m in [robot]")
        return self.robot.wheel_radius_m


def mass_kg(wheels: Wheels, name: str) -> float:
    """1/(r α): what the wheels drive."""
    return 2 * wheels.half_torque(name) / wheels.radius_m(name)


def times(sides: Sides, left: float, right: float) -> Sides:
    """Both sides by their own factors."""
    return sides[0] * left, sides[1] * right


def plus(sides: Sides, left: float, right: float) -> Sides:
    """Both sides with what is added."""
    return sides[0] + left, sides[1] + right


Change = Callable[[MjcfParameters, Parameters, Wheels], MjcfParameters]
CHANGES: dict[str, Change] = {
    "payload": lambda m, p, w: replace(m, payload_kg=m.payload_kg + p["mass_ratio"] * mass_kg(w, "payload")),
    "drive_gain": lambda m, p, w: replace(m, gear=times(m.gear, 1 + p["ratio"], 1 + p["ratio"])),
    "torque_imbalance": lambda m, p, w: replace(m, gear=times(m.gear, 1 - p["ratio"], 1 + p["ratio"])),
    "torque_bias_common": lambda m, p, w: replace(m, bias_nm=plus(m.bias_nm, p["bias_nm"], p["bias_nm"])),
    "torque_bias_differential": lambda m, p, w: replace(
        m, bias_nm=plus(m.bias_nm, -p["bias_nm"], p["bias_nm"])
    ),
    "actuator_lag": lambda m, p, w: replace(m, time_constant_s=p["time_constant_s"]),
    "input_delay": lambda m, p, w: replace(m, delay_s=p["delay_s"]),
    "torque_saturation": lambda m, p, w: replace(m, limit_nm=p["limit_nm"]),
    "wheel_coulomb": lambda m, p, w: replace(m, frictionloss_nm=m.frictionloss_nm + p["torque_nm"]),
    "wheel_viscous": lambda m, p, w: replace(m, damping_nm_s=m.damping_nm_s + p["nm_per_radps"]),
    "rolling_resistance": lambda m, p, w: replace(
        m, frictionloss_nm=m.frictionloss_nm + p["c0_mps2"] * w.half_torque("rolling_resistance")
    ),
    "viscous_drag": lambda m, p, w: replace(
        m,
        damping_nm_s=m.damping_nm_s
        + p["c1_per_s"] * w.radius_m("viscous_drag") * w.half_torque("viscous_drag"),
    ),
    "aerodynamic_drag": lambda m, p, w: replace(
        m,
        damping2_nm_s2=m.damping2_nm_s2
        + p["c2_per_m"] * w.radius_m("aerodynamic_drag") ** 2 * w.half_torque("aerodynamic_drag"),
    ),
    "slope": lambda m, p, w: replace(m, gravity_mps2=(p["grade_x_mps2"], p["grade_y_mps2"])),
    "pose_lever_arm": lambda m, p, w: replace(m, site_m=(p["x_m"], p["y_m"])),
    "heading_misalignment": lambda m, p, w: replace(m, site_rad=p["angle_rad"]),
    "wheel_scale": lambda m, p, w: replace(m, radius=times(m.radius, 1 + p["ratio"], 1 + p["ratio"])),
    "wheel_scale_difference": lambda m, p, w: replace(
        m, radius=times(m.radius, 1 - p["ratio"], 1 + p["ratio"])
    ),
    "effective_track": lambda m, p, w: replace(m, track=m.track * (1 + p["ratio"])),
}
ON_WHEELS = ("rolling_resistance", "viscous_drag", "aerodynamic_drag")
"""Effects ahead alone, whose parameter is that of the wheels' joints."""
REASONS = {
    "yaw_inertia": "an inertia about one axis without mass; change diaginertia of the base body",
    "torque_deadzone": "actuators have none; leave small torques out in front of ctrl",
    "com_offset": "move the base body's inertial by the offset",
    "yaw_damping": "joints brake both motions; the medium's viscosity comes near",
    "scrub_torque": "torsional friction of the tyres' contacts (condim 4) comes near",
    "swivel_friction": "set frictionloss of the joints in which the casters swivel",
    "support_friction": "set friction of the balls or pads, or frictionloss of the casters' axles",
    "low_friction_patch": "a place: put a geom with less friction there",
    "load_step": "a time: change body_mass while the simulation runs",
    "slip_interval": "a time: change friction while the simulation runs",
    "cornering_stiffness": "contacts have no cornering stiffness",
    "yaw_drift": "an error of the sensor",
    "pose_delay": "an error of the sensor",
}


def mjcf_parameters(model: Model) -> MjcfParameters:
    """The model's effects, less those that the simulator of its base shows by itself.

    Raises InvalidSetting where an effect needs α or the wheel radius and the model does not have it.
    """
    found, wheels = MjcfParameters(), Wheels(model.robot)
    for name, parameters in missing_effects(model):
        change = CHANGES.get(name)
        if change is None:
            found = replace(
                found, beyond=(*found.beyond, (name, REASONS.get(name, "no parameter is like it")))
            )
            continue
        found = change(found, parameters, wheels)
        if name in ON_WHEELS:
            note = f"{name} as friction of the wheels, which brakes turning, too"
            found = replace(found, notes=(*found.notes, note))
        if parameters.get("e2_per_m", 0.0) > 0:
            note = f"{name}: what of it brakes turns by e2_per_m is left to the wheels"
            found = replace(found, notes=(*found.notes, note))
    return found


def missing_effects(model: Model) -> Iterator[tuple[str, Parameters]]:
    """Each effect's parameters; of one that the simulator shows by itself, the difference if there is any."""
    own = {table["name"]: table for table in json.loads(model.provenance.base_effects or "[]")}
    for effect in model.effects:
        base = own.get(effect.name)
        if base is None:
            yield effect.name, effect.parameters
            continue
        more = {key: value - base.get(key, 0.0) for key, value in effect.parameters.items()}
        if any(abs(value) > 1e-9 * abs(base.get(key, 0.0)) for key, value in more.items()):
            yield effect.name, more

"""The simulator's form of every effect, in words; and forms that are registered for users' effects.

A form is independent of the analysis's: nothing here imports it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from wmr_schemas.arrays import F64
from wmr_schemas.effects import BaseModel, declared
from wmr_schemas.errors import InvalidSetting
from wmr_synth.plants.motion import Motion

AS_CANDIDATE = "as its candidate"
_FRICTION = "sgn(v) as v/√(v² + .005²)"
WORDS = {
    "rolling_resistance": f"Stribeck: −c0·sgn(v)·(1 + .25·exp(−(v/.15)²)), {_FRICTION}",
    "aerodynamic_drag": "−c2·sgn(v)·|v|^1.9 on dv_long/dt, −e2·w·V^0.9 on dw/dt",
    "scrub_torque": _FRICTION.replace("v", "l·yaw_rate"),
    "wheel_coulomb": _FRICTION,
    "swivel_friction": "the corner of u = q·V²/(s0·v²) as u/√(1 + u²)",
    "support_friction": "v0 of .005 m/s, not .02",
    "slope": "bumpy: on each world axis + .25·|grade|·sin(2π·x/3 m + phase)",
    "actuator_lag": "two poles of half the time constant each",
    "torque_deadzone": "soft: u − δ·tanh(u/δ)",
    "torque_saturation": "soft: u/(1 + (|u|/limit)⁶)^(1/6)",
    "load_step": "linear from t0 − 1 s to t0 + 1 s",
    "low_friction_patch": "soft edge: ½·(1 − tanh((distance − radius)/.1 m))",
    "slip_interval": "edges of .2 s",
    "wheel_eccentricity": "½·A·sin(wheel angle) of each wheel",
}
"""Forms other than the candidate's."""
ROLLING_WORDS = {
    "wide_turn_scrub": "g = 1 − (2/π)·arctan(3·|w|/|v|)",
    "lateral_slip": "builds up over .1 m of way, as a tyre's does",
    "turning_slip": "|yaw_rate| as yaw_rate·tanh(yaw_rate/.05)",
    "slip_ratio": "the acceleration through a lag of .05 s",
    "slope_slip": "in proportion to tanh(rim speed/.05)",
    "low_grip_patch": WORDS["low_friction_patch"],
    "speed_deadzone": WORDS["torque_deadzone"],
    "speed_saturation": WORDS["torque_saturation"],
    "speed_desaturation": WORDS["torque_saturation"],
    "turn_saturation": WORDS["torque_saturation"],
    "actuator_lag": "two poles of half the time constant each, one of them with the drive's own lag",
}
"""Forms other than the candidate's, of robots that wheel speeds drive."""
Values = Mapping[str, float]


@dataclass(frozen=True)
class OwnForm:
    """A user's effect in the simulator: ``words`` for the truth file, and one of two functions.

    ``acceleration`` gives (dv_long/dt, dv_lat/dt while skidding, l·d(yaw_rate)/dt) (n, 3) in m/s² at the rows
    of a motion; ``seen`` gives the motion whose pose a sensor reports.
    """

    words: str
    acceleration: Callable[[Motion, Values], F64] | None = None
    seen: Callable[[Motion, Values], Motion] | None = None


OWN_FORMS: dict[str, OwnForm] = {}


def register_form(name: str, form: OwnForm) -> None:
    """Let ``--hide`` and ``hidden_log`` hide a user's effect in a form of its own.

    Raises InvalidSetting for an effect that is not installed, or is built in.
    """
    try:
        built_in = declared(name).number >= 0
    except KeyError:
        raise InvalidSetting(f"no effect {name!r} is installed that a form could be for") from None
    if built_in:
        raise InvalidSetting(f"{name} is built in and has a form")
    OWN_FORMS[name] = form


def words_of(name: str, base: BaseModel = "torque") -> str:
    """The form of an effect in the simulator. Raises InvalidSetting where it has none."""
    if base == "wheel_speed" and name in ROLLING_WORDS:
        return ROLLING_WORDS[name]
    if name in OWN_FORMS:
        return OWN_FORMS[name].words
    if declared(name).number < 0:
        raise InvalidSetting(f"the simulator has no form of {name}: register one with register_form")
    return WORDS.get(name, AS_CANDIDATE)

"""Whether a log can tell its hidden effect from a rival that an answer says beside it.

The rival is another of the engine's own mechanisms, on the same robot: from the states of the hidden drive,
once a second, it gets the same torques (``oracle.by_torques``). What the hidden drive has beyond it is seen
as the oracle sees a trace, g(s), with s the rival's size. The size that leaves least is sought from g(s)
being nearly linear in s: with u = (g(0) − g(s))/s, the next s is ⟨g(0), u⟩/⟨u, u⟩. Where g leaves less than
``worlds.oracle.SEPARATED``, the rival may be said beside the truth (``score.excused``).
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from worlds.oracle_filter import whitened

from engine.case import Case
from engine.effects import EDITS, Edit, World
from engine.logs import Logged
from engine.oracle import by_torques, power
from engine.oracle_base import axle, base_of, columns_of, steps_of
from engine.robot import spec_of
from wmr_schemas.arrays import F64

RIVALS = {
    "payload": "payload",
    "yaw_inertia": "yaw_inertia",
    "drive_gain": "gear",
    "wheel_coulomb": "friction_loss",
    "rolling_resistance": "friction_loss",
    "wheel_viscous": "joint_damping",
    "viscous_drag": "fluid_viscosity",
    "aerodynamic_drag": "fluid_density",
    "scrub_torque": "scrub",
    "torque_imbalance": "gear_imbalance",
    "torque_bias_common": "bias_common",
    "torque_bias_differential": "bias_differential",
    "actuator_lag": "activation",
    "input_delay": "delay",
    "torque_deadzone": "dead_zone",
    "com_offset": "centre_of_mass",
}
"""The engine's mechanism of an effect of one size that acts on the motion."""
START, ROUNDS = 0.1, 4
"""Most sizes are drawn about ``START``."""


class NotPossible(ValueError):
    """A mechanism of the engine has no such size."""


@dataclass(frozen=True, eq=False)
class Sized(World):
    """A world whose size is given, not drawn."""

    value: float = 0.0

    def size(self, low: float, high: float) -> float:
        """The size, where it is one. Raises NotPossible."""
        if self.value <= 0:
            raise NotPossible
        return self.value

    def signed(self, low: float, high: float) -> float:
        """The size."""
        return self.value


def left_by_rivals(case: Case, found: Logged, names: Collection[str]) -> dict[str, float | None]:
    """What each rival leaves of the hidden effect; None of one that has no mechanism here."""
    torque = not found.robot.by_wheels
    return {
        name: left_by(case, found, EDITS[RIVALS[name]]) if torque and name in RIVALS else None
        for name in sorted(names)
    }


def left_by(case: Case, found: Logged, edit: Edit) -> float:
    """What one rival leaves at its best size; where none is possible, what no rival leaves."""
    base, motion = base_of(case), axle(found)
    steps = steps_of(motion, found.robot, base, case.noise_sd)
    rest = whitened(steps, columns_of(motion, found.robot))

    def beyond(size: float) -> F64:
        world = Sized(spec_of(case.robot), found.robot, np.random.default_rng(), case.duration_s, value=size)
        return np.asarray(whitened(steps, [by_torques(found, edit(world))])[:, 0])

    hidden, size = whitened(steps, [by_torques(found)])[:, 0], START
    least = float(power(hidden[:, None], rest, base.information)[0])
    for _ in range(ROUNDS):
        try:
            apart = beyond(size)
        except NotPossible:
            break
        alone = (hidden - apart) / size
        columns = np.stack([hidden, alone, hidden - alone, apart], axis=1)
        both, unit, difference, left = power(columns, rest, base.information)
        least = min(least, float(left))
        if not unit > 0:  # it changes nothing here
            break
        size = float((both + unit - difference) / 2 / unit)
    return least

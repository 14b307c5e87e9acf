"""What may be missing: the catalogue's effects of this base, as far as a record can show them."""

import numpy as np

from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.predict import DECLARED, Parameter
from wmr_replay.gap.wheel_speed.record import Record
from wmr_schemas.effects import EffectDeclaration

SLIP, PATCH = PLACES = ("slip_interval", "low_grip_patch")
"""Effects in a time or a place, which have a scan of their own."""
NEED_WORLD = ("slope_slip", "low_grip_patch", "yaw_drift", "slip_interval")
"""Effects that mean something only where all stretches are one drive in one world."""
BY_WHEELS = ("pose_delay", "wheel_scale", "effective_track")
"""Effects that need short stretches from measured wheel speeds where commands drive the model."""
RESTARTED_S = 10.0
"""Length of stretches below which their starting speeds tell the drive's gains from the wheels' scales, s."""
STAMPED = ("pose_delay", "slip_ratio", "input_delay")
"""Effects that a stamp within a step of the wheels' speeds looks like."""
CALIBRATED = ("wheel_scale", "wheel_scale_difference", "effective_track", "icr_offset", "pose_delay")
"""The effects of which a calibrated base model consists."""


def candidates_of(record: Record) -> tuple[EffectDeclaration, ...]:
    """The effects that the record could show, in the catalogue's order.

    Where commands drive the model from measured starting speeds every few seconds, the drive's gains differ
    from the wheels' scales; elsewhere the two are one class, and the drive's are named.
    """
    commanded = record.driven_by == "command"
    return tuple(
        effect
        for effect in DECLARED.values()
        if not effect.held_only
        and (commanded or not effect.needs_commands)
        and (record.anchored or effect.name not in NEED_WORLD)
        and not (commanded and effect.name in hidden_by_commands(record))
    )


def hidden_by_commands(record: Record) -> tuple[str, ...]:
    """Effects that commands cannot tell from the drive's own."""
    return ("pose_delay",) if restarts_often(record) else BY_WHEELS


def restarts_often(record: Record) -> bool:
    """Whether a record is one of short stretches, each from wheel speeds that were measured."""
    lasting_s = record.pose_s[record.first_pose[1:] - 1] - record.pose_s[record.first_pose[:-1]]
    return float(np.mean(lasting_s)) < RESTARTED_S and bool(np.isfinite(record.started_radps).all())


def parameters_of(name: str) -> tuple[Parameter, ...]:
    """The parameters of an effect, but for those that need not be."""
    return tuple(
        Parameter(name, key) for key in DECLARED[name].parameters if key not in DECLARED[name].absent
    )


def absent(name: str) -> dict[str, float]:
    """The values of an effect that is not there."""
    return {one.key: 0.0 for one in parameters_of(name)}


def hardly_lower(base: Values, values: Values, name: str, share: float) -> bool:
    """Whether an effect is a limit that the base model has, lowered by less than a share."""
    if DECLARED[name].zero_is_absent or name not in base:
        return False
    (key,) = DECLARED[name].parameters
    return values[name][key] > (1 - share) * base[name][key]


def at_its_bound(values: Values, name: str) -> bool:
    """Whether a size stands at an end of its range: the record says only that it is larger still."""
    own = values[name]
    return any(own[one.key] in one.bounds and own[one.key] != 0.0 for one in parameters_of(name))


def within_a_step(record: Record, values: Values, name: str) -> bool:
    """Whether an effect is a delay that is shorter than the commands' own step, in which a drive may take
    them at any time.
    """
    if record.driven_by != "command" or name not in STAMPED:
        return False
    return all(abs(value) < record.wheel_step_s for value in values[name].values())

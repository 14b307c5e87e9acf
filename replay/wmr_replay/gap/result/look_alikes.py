"""What acts as a named effect does, and is not in the catalogue."""

from collections.abc import Sequence

from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.result import FoundEffect

IMBALANCE = "torque_imbalance"


def sideways_mass_note(effects: Sequence[FoundEffect], extension: Extension) -> tuple[str, ...]:
    """Which centre of mass to one side turns the robot as a named imbalance of the torques does.

    One d to the left turns it by (l m d/I)·dv/dt where it gathers speed, an imbalance ratio by α_yaw times
    ratio times the torques' sum: d = ratio·α_yaw/(α k), k = l m/I. Ahead the two differ by their share of
    what turns the robot.
    """
    base, named = extension.base, [one for one in effects if one.name == IMBALANCE]
    if not named or base.com_yaw_per_m <= 0.0:
        return ()
    offset_m = named[0].parameters["ratio"].value * base.alpha_yaw / (base.alpha * base.com_yaw_per_m)
    if abs(offset_m) > base.half_track_m:
        return ()
    side = "left" if offset_m > 0 else "right"
    return (
        f"a centre of mass {abs(offset_m):.2g} m to the {side} of the middle turns the robot much as this "
        f"{IMBALANCE} does when it gathers speed, and is not in the catalogue: weigh both sides",
    )

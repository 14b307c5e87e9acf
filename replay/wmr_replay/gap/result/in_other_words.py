"""What effects that were named mean together, or what else acts as one does, in words."""

import math
from collections.abc import Iterator, Sequence

from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.result import FoundEffect
from wmr_replay.gap.settings.result import ReportSettings

IMBALANCE = "torque_imbalance"


def in_other_words(
    effects: Sequence[FoundEffect], extension: Extension, own: ReportSettings
) -> tuple[str, ...]:
    """One side's torques alone, a weight that turns with the robot, and a centre of mass to one side, where
    the effects may be these.
    """
    return (*one_side(effects, own), *wide_weight(effects), *sideways_mass(effects, extension))


def one_side(effects: Sequence[FoundEffect], own: ReportSettings) -> Iterator[str]:
    """Says which side's torques alone are larger or smaller, or have a bias, where the other's may be as
    stated: a gain of both and an imbalance, or a bias of both and one between them.
    """
    found = {effect.name: effect.parameters for effect in effects}
    for both, apart, key, text in (
        ("drive_gain", IMBALANCE, "ratio", "{0:+.1%} of its torque"),
        ("torque_bias_common", "torque_bias_differential", "bias_nm", "{0:+.3g} N·m"),
    ):
        if not {both, apart} <= found.keys():
            continue
        sizes = found[both][key], found[apart][key]
        sd = math.hypot(*(one.ci95[1] - one.ci95[0] for one in sizes)) / 2
        whole = sizes[1].value * (1 + sizes[0].value if key == "ratio" else 1)
        change = {"left": sizes[0].value - whole, "right": sizes[0].value + whole}
        for side, other in (("left", "right"), ("right", "left")):
            if abs(change[other]) <= max(sd, own.one_sided * abs(change[side])) and sd < abs(change[side]):
                yield f"{both} and {apart} together are the {side} side alone: {text.format(change[side])}"


def wide_weight(effects: Sequence[FoundEffect]) -> Iterator[str]:
    """Says which payload moves the robot as a weaker drive does.

    A gain g divides mass and yaw inertia by 1 + g. A weight as far out as the robot's own mass adds the same
    share to both, 1/(1 + g) − 1.
    """
    found = {effect.name: effect.parameters for effect in effects}
    if "drive_gain" not in found or {"payload", "yaw_inertia"} & found.keys():
        return
    ratio = found["drive_gain"]["ratio"].value
    if -1 < ratio < 0:
        yield (
            f"a payload and a yaw_inertia of {1 / (1 + ratio) - 1:.0%} each move the robot as this "
            "drive_gain does: a weight as far out as the robot's own mass, in place of weaker drives"
        )


def sideways_mass(effects: Sequence[FoundEffect], extension: Extension) -> Iterator[str]:
    """Says which centre of mass to one side turns the robot as a named imbalance of the torques does.

    One d to the left turns it by (l m d/I)·dv/dt where it gathers speed, an imbalance ratio by α_yaw times
    ratio times the torques' sum: d = ratio·α_yaw/(α k), k = l m/I. Ahead the two differ by their share of
    what turns the robot.
    """
    base, named = extension.base, [one for one in effects if one.name == IMBALANCE]
    if not named or base.com_yaw_per_m <= 0.0:
        return
    offset_m = named[0].parameters["ratio"].value * base.alpha_yaw / (base.alpha * base.com_yaw_per_m)
    side = "left" if offset_m > 0 else "right"
    if abs(offset_m) <= base.half_track_m:
        yield (
            f"a centre of mass {abs(offset_m):.2g} m to the {side} of the middle turns the robot much as "
            f"this {IMBALANCE} does when it gathers speed, and is not in the catalogue: weigh both sides"
        )

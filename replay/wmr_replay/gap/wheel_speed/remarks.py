"""What effects that were found mean together, or by their sign, in words."""

import math
from collections.abc import Iterator, Sequence

from wmr_replay.gap.result.result import Estimate, FoundEffect

ONE_SIDED = 0.2
"""A wheel that differs by less than this share of what the other one does is as stated. Presentation."""
SIDES = (("left", -1.0), ("right", 1.0))


def remarks_on(effects: Sequence[FoundEffect], *, measured: bool) -> Iterator[str]:
    """Remarks on the effects found: one wheel of another size, ``measured`` wheel speeds that are late."""
    found = {effect.name: effect.parameters for effect in effects}
    if {"wheel_scale", "wheel_scale_difference"} <= found.keys():
        yield from of_one_wheel(found["wheel_scale"]["ratio"], found["wheel_scale_difference"]["ratio"])
    late_s = -found["pose_delay"]["delay_s"].value if "pose_delay" in found else 0.0
    if measured and late_s > 0:
        yield f"a pose_delay below 0: wheel speeds are stamped {late_s:.3g} s later than the base model says"


def of_one_wheel(both: Estimate, apart: Estimate) -> Iterator[str]:
    """Says which wheel alone has another size, where the other one's may be as stated."""
    sd = math.hypot(*(one.ci95[1] - one.ci95[0] for one in (both, apart))) / 2
    change = {side: (1 + both.value) * (1 + sign * apart.value) - 1 for side, sign in SIDES}
    for side, other in (("left", "right"), ("right", "left")):
        if abs(change[other]) <= max(sd, ONE_SIDED * abs(change[side])) and sd < abs(change[side]):
            yield (
                f"wheel_scale and wheel_scale_difference together are the {side} wheel alone: "
                f"{change[side]:+.2%} of its radius, or of what its encoder counts"
            )

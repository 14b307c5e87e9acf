"""What waves, gusts and other factors over time, place and heading stand times: products by channel.

A blank separates carriers that stand together: a direction has a cosine and a sine.
"""

from itertools import product

from wmr_replay.gap.formula.families import Factors
from wmr_replay.gap.model.dictionary import SOFT_SIGNS
from wmr_schemas.terms import TermChannel

Table = dict[TermChannel, tuple[str, ...]]
HEADING = "cos(yaw) sin(yaw)"
EITHER_WAY = "cos(2yaw) sin(2yaw)"
"""What turns a robot to a direction, whichever way round: a rut, a rail."""
(SOFT_V, SOFTER_V), (SOFT_W, SOFTER_W) = SOFT_SIGNS["v"], SOFT_SIGNS["yaw_rate"]
OVER_TIME: Table = {
    "longitudinal": (
        *("1", HEADING, "v", "sgn(v)", SOFT_V, SOFTER_V, "v*abs(v)", "abs(v)", "v*yaw_rate", "abs(yaw_rate)"),
        *("effort_sum", "effort_sum*abs(v)", "abs(effort_sum)", "effort_diff"),
    ),
    "yaw": (
        *("1", HEADING, "yaw_rate", "sgn(yaw_rate)", SOFT_W, SOFTER_W, "v", "abs(v)", "sgn(v)", SOFT_V),
        *(
            "v*v",
            "abs(v)*yaw_rate",
            "v*yaw_rate",
            "effort_diff",
            "effort_diff*abs(v)",
            "effort_diff*abs(yaw_rate)",
            "effort_sum",
        ),
    ),
}
"""Wind, drags, gains and pulls to a side."""
SAWN: Table = {
    "longitudinal": ("1", "sgn(v)", SOFT_V, SOFTER_V, "v", "effort_sum"),
    "yaw": ("1", "sgn(yaw_rate)", SOFT_W, SOFTER_W, "yaw_rate", "effort_diff"),
}
"""What builds up and is let go at even intervals: a heap that is dropped, an emptied tank, a valve that
bleeds.
"""
SHORT = ("gust", "pulse", "after")
"""What efforts do not do, nor a constant: a loss of traction and a load are effects of the library, and what
pushes for a moment is a disturbance.
"""
UNSWITCHED = (("longitudinal", "effort_sum"), *product(("longitudinal", "yaw"), ("1", HEADING)))
"""What is not switched over at a time: what a load step does, an effect of the library; constants, which are
slow disturbances; and slopes, which are places.
"""
OVER_PLACE: Table = {
    "longitudinal": (
        *("1", "cos(yaw)", "sin(yaw)", HEADING, "v", "sgn(v)", "abs(v)", "v*abs(v)", "effort_sum"),
    ),
    "yaw": (
        *("1", "cos(yaw)", "sin(yaw)", HEADING, "yaw_rate", "sgn(yaw_rate)", "abs(v)*yaw_rate", "v"),
        *("sgn(v)", "sgn(v)*cos(yaw)", "sgn(v)*sin(yaw)", "effort_diff"),
    ),
}
"""Height and tilt by the heading, drags, pulls to a side, and traction. A wall holds back the side that is
next to it: which one that is, the heading says, and which way, the way of rolling.
"""
OVER_STRIP: Table = {
    "longitudinal": ("1", "v", "sgn(v)", SOFT_V, HEADING, "effort_sum"),
    "yaw": ("1", "yaw_rate", "sgn(yaw_rate)", SOFT_W, HEADING, EITHER_WAY, "effort_diff"),
}
"""What lies across the way: a ramp, a mat, a rut, a gust between two houses, a lane that was mopped."""
OVER_HEADING: Table = {
    "longitudinal": ("1", "v", "sgn(v)", SOFT_V, "abs(v)", "v*abs(v)", "effort_sum", "effort_diff"),
    "yaw": ("1", "v", "yaw_rate", "sgn(yaw_rate)", SOFT_W, "abs(v)", "effort_diff", "effort_sum"),
}
"""A floor with a grain, a cable, wind. One turn ahead is a slope."""
OVER_DIRECTION: Table = {
    "longitudinal": (HEADING, "1", "v", "effort_sum"),
    "yaw": (HEADING, "1", "yaw_rate", "effort_diff"),
}
TURNED = ("1", "v")
"""What winds up with all turns so far."""
ALONG: Table = {"longitudinal": ("1", "v", "effort_sum"), "yaw": ("1", "v", "effort_diff")}
"""What turns with a wheel."""


def carriers_of(text: str) -> tuple[Factors, ...]:
    """The carriers of a text; 1 is none."""
    return tuple(() if one == "1" else tuple(one.split("*")) for one in text.split())

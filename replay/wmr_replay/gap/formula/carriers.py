"""What waves, gusts and other factors over time, place and heading stand times: products by channel.

A blank separates carriers that stand together: a direction has a cosine and a sine.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from wmr_replay.gap.formula.families import Factors
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.terms import Term, TermChannel

Table = dict[TermChannel, tuple[str, ...]]
HEADING = "cos(yaw) sin(yaw)"
OVER_TIME: Table = {
    "longitudinal": (
        *(HEADING, "v", "sgn(v)", "v*abs(v)", "abs(v)", "v*yaw_rate", "yaw_rate", "abs(yaw_rate)"),
        *("effort_sum", "effort_sum*abs(v)", "abs(effort_sum)", "effort_diff"),
    ),
    "yaw": (
        *(HEADING, "yaw_rate", "sgn(yaw_rate)", "v", "abs(v)", "abs(v)*yaw_rate", "v*yaw_rate"),
        *("effort_diff", "effort_diff*abs(v)", "effort_diff*abs(yaw_rate)", "effort_sum"),
    ),
}
"""Wind, drags, gains and pulls to a side."""
OVER_PLACE: Table = {
    "longitudinal": (
        *("1", "cos(yaw)", "sin(yaw)", HEADING, "v", "sgn(v)", "abs(v)", "v*abs(v)"),
        *("yaw_rate", "abs(yaw_rate)", "v*yaw_rate", "effort_sum", "effort_diff"),
    ),
    "yaw": (
        *("1", "cos(yaw)", "sin(yaw)", HEADING, "yaw_rate", "sgn(yaw_rate)", "abs(v)*yaw_rate", "v"),
        *("abs(v)", "v*yaw_rate", "effort_diff", "effort_sum"),
    ),
}
"""Height and tilt by the heading, drags, gains, and pulls to a side."""
IN_PLACE: Table = {
    "longitudinal": ("1", "v", "sgn(v)", "v*abs(v)", "abs(v)", "abs(yaw_rate)", HEADING),
    "yaw": ("1", "yaw_rate", "sgn(yaw_rate)", "abs(v)*yaw_rate", "v", "abs(v)", HEADING),
}
"""What pushes, brakes or blows in one place."""
OVER_HEADING: Table = {
    "longitudinal": (
        *("1", "v", "sgn(v)", "abs(v)", "v*abs(v)", "yaw_rate", "abs(yaw_rate)", "v*yaw_rate"),
        *("effort_sum", "effort_diff"),
    ),
    "yaw": (
        *("1", "v", "abs(v)", "yaw_rate", "sgn(yaw_rate)", "abs(v)*yaw_rate", "v*yaw_rate"),
        *("effort_diff", "effort_sum"),
    ),
}
"""A floor with a grain, a cable, wind. One turn ahead is a slope."""
OVER_DIRECTION: Table = {
    "longitudinal": (HEADING, "1", "v", "sgn(v)", "effort_sum"),
    "yaw": (HEADING, "1", "v", "yaw_rate", "effort_diff"),
}
ALONG: Table = {"longitudinal": ("1", "v", "effort_sum"), "yaw": ("1", "v", "effort_diff")}
"""What turns with a wheel."""
SHORT = ("gust", "after", "edge")
"""What efforts do not do in time: a loss of traction and a load are effects of the library."""
AGAINST = {"abs(v)": "v"}
AGAINST_PUSH = {"longitudinal": "sgn(v)", "yaw": "sgn(yaw_rate)"}
"""Carriers that are the same as another one while the robot drives, or turns, one way: the other one changes
its direction with the motion. What acts one way in a place is a resistance, and no pull along the robot.
"""


def carriers_of(text: str) -> tuple[Factors, ...]:
    """The carriers of a text; 1 is none."""
    return tuple(() if product == "1" else tuple(product.split("*")) for product in text.split())


def told_apart(
    table: Table, channel: TermChannel, columns: Mapping[str, F64], own: FormulaSettings
) -> Iterator[str]:
    """The carriers of a channel without those that a log cannot tell from a likelier one."""
    texts, likelier = table[channel], dict(AGAINST)
    if table is IN_PLACE or (table is OVER_PLACE and channel == "longitudinal"):
        likelier["1"] = AGAINST_PUSH[channel]
    for text in texts:
        other = likelier.get(text, "")
        if other not in texts or rarer_share(columns[speed_of(other)], own) >= own.least_rarer:
            yield text


def speed_of(text: str) -> str:
    """The speed that a resistance reads."""
    return Term("yaw", (text,)).columns[0]


def rarer_share(z: F64, own: FormulaSettings) -> float:
    """The share of the rows with the rarer sign of a quantity; what is hardly above 0 counts for none."""
    beyond = np.abs(z) > own.hardly * np.sqrt(np.mean(z**2))
    return float(min(np.mean(beyond & (z > 0)), np.mean(beyond & (z < 0))))

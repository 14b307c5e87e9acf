"""What is drawn of two results: their lines and the lines of their differences."""

from dataclasses import dataclass

import polars as pl

from wmr_replay.timeline import colours
from wmr_replay.timeline.series import Series

Pen = tuple[colours.Colour, float]
PENS: dict[str, Pen] = {"a": (colours.ESTIMATE, 2.5), "b": (colours.SECOND, 1.0)}
"""b is drawn over a: where both agree, a still shows on either side."""


@dataclass(frozen=True)
class Quantity:
    """What is drawn of both: column, name with unit, and whether it describes t − ``delay_s``."""

    column: str
    name: str
    at_described: bool = True


QUANTITIES = (
    Quantity("v_long_mps", "v_long [m/s]"),
    Quantity("c_k_mps", "C_k [m/s]"),
    Quantity("c_d_mps2", "C_d [m/s²]"),
    Quantity("alpha", "α [1/(kg·m)]", at_described=False),
    Quantity("yaw_rate_radps", "yaw [rad/s]"),
)
POSITION = Series(
    "/difference/position_m", (pl.col("position_m"),), ("Δ position [m]",), (colours.DIFFERENCE,)
)


def line_of(quantity: Quantity, key: str) -> Series:
    """The line of one side."""
    colour, width = PENS[key]
    name = f"a: {quantity.name}" if key == "a" else "b"
    entity, line = f"/both/{quantity.column}/{key}", pl.col(quantity.column)
    return Series(entity, (line,), (name,), (colour,), width, quantity.at_described)


def difference_of(quantity: Quantity) -> Series:
    """The line b − a."""
    entity, name = f"/difference/{quantity.column}", f"Δ {quantity.name}"
    at = quantity.at_described
    return Series(entity, (pl.col(quantity.column),), (name,), (colours.DIFFERENCE,), at_described=at)

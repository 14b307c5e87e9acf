"""Units and clocks that mapping files name."""

import math
from typing import Literal

Clock = Literal["header", "publish", "log"]
CLOCKS: tuple[Clock, ...] = ("header", "publish", "log")
ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180}
"""Radians per unit."""
SPEED_UNITS = {"rad/s": 1.0, "rpm": 2 * math.pi / 60, "deg/s": math.pi / 180, "rev/s": 2 * math.pi}
"""Radians per second per unit."""
TURN_UNITS = {**ANGLE_UNITS, "rev": 2 * math.pi}
"""Radians per unit of a wheel's position."""
RIM_SPEED, TICKS = "m/s", "ticks"
"""Speed of a wheel's rim, and an encoder's counts: their size in rad/s and rad depends on the robot."""

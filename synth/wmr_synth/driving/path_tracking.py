"""Following a path: references of a robot off its path, corrected towards it."""

import math

from wmr_schemas.compiled import compiled


@compiled
def towards_path(
    v: float,
    yaw_rate: float,
    off: tuple[float, float, float],
    heading: tuple[float, float],
    gains: tuple[float, float, float],
) -> tuple[float, float]:
    """Speed in m/s and yaw rate in rad/s that lead back to the path.

    v' = v·cos e_yaw + k_ahead·e_ahead,  ω' = ω + v·k_across·e_across + k_heading·sin e_yaw

    ``off``: path minus robot, x and y in m and yaw in rad; ``heading``: cosine and sine of the direction that
    counts as ahead; ``gains``: 1/s, 1/m², 1/s. Y. Kanayama et al., "A stable tracking control method for an
    autonomous mobile robot", ICRA 1990.
    """
    off_x, off_y, off_rad = off
    cosine, sine = heading
    ahead_per_s, across_per_m2, heading_per_s = gains
    ahead, across = off_x * cosine + off_y * sine, off_y * cosine - off_x * sine
    yaw_rate += v * across_per_m2 * across + heading_per_s * math.sin(off_rad)
    return v * math.cos(off_rad) + ahead_per_s * ahead, yaw_rate

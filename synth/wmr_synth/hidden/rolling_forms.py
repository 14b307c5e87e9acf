"""The forms in which effects act on robots that wheel speeds drive; plain is the candidates' form.

Robot conventions; rim speeds r·φ̇ and slip velocities in m/s.
"""

import math

from wmr_schemas.compiled import compiled

SOFT_TURN_RADPS = 0.05
"""The hidden turning slip starts with yaw_rate·tanh(yaw_rate/.05) in place of |yaw_rate|."""
WIDE_BY = 3.0
"""Half the rims' difference counts so many times as much as their mean for how wide a turn is."""
MOVING_MPS = 0.05
"""The hidden drift on a slope acts in proportion to tanh(rim speed/.05 m/s)."""
STILL_MPS = 0.01
"""A plain drift acts where the rims move faster than this."""
DEFLECTION_S, PLAIN_DEFLECTION_S = 0.05, 0.002
"""Time over which a rim's acceleration is taken for the slip in proportion to it."""
RELAXATION_M, CREEP_MPS = 0.1, 0.05
"""Length over which the hidden lateral slip builds up, as a tyre's does, and the least speed of doing so."""


@compiled
def turning_share(k: float, yaw_rate: float, half_track_m: float, plain: bool) -> float:
    """Share of v_long that is lost by turning: k l ω tanh(ω/.05); plain k l |ω|."""
    if k == 0.0:
        return 0.0
    turning = abs(yaw_rate) if plain else yaw_rate * math.tanh(yaw_rate / SOFT_TURN_RADPS)
    return k * half_track_m * turning


@compiled
def widened_by_turns(ratio: float, v: float, w: float, plain: bool) -> float:
    """The track by that of a turn half-way between one on the spot and the widest, of the rims' mean v and
    half their difference w: 1 + ratio·(g − ½), g = 1 − (2/π)·arctan(3 |w|/|v|); plain |v|/(|v| + 3 |w|).
    """
    if ratio == 0.0 or (v == 0.0 and w == 0.0):
        return 1.0
    ahead, around = abs(v), WIDE_BY * abs(w)
    wide = ahead / (ahead + around) if plain else 1.0 - math.atan2(around, ahead) / (0.5 * math.pi)
    return 1.0 + ratio * (wide - 0.5)


@compiled
def drift_share(speed_mps: float, plain: bool) -> float:
    """Share of the drift at a rim speed."""
    if plain:
        return 1.0 if speed_mps > STILL_MPS else 0.0
    return math.tanh(speed_mps / MOVING_MPS)


@compiled
def deflection_time(plain: bool) -> float:
    """Time constant of the slip in proportion to acceleration, s."""
    return PLAIN_DEFLECTION_S if plain else DEFLECTION_S


@compiled
def lateral_rate(v: float, plain: bool) -> float:
    """Rate at which the lateral slip reaches its size, 1/s; plain at once."""
    return math.inf if plain else (abs(v) + CREEP_MPS) / RELAXATION_M

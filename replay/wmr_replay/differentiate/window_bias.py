"""Jumps of velocity and acceleration as a window of a given length meets them, for the bias of its kernel.

Motion is smoother at short scales than at long ones. One fit to all scales is too large for a short window and
too small for a long one; here the scales up to the window's length count alone.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.differentiate.colour import ACCELERATION, VELOCITY, WHITE, WOBBLE, Colour
from wmr_schemas.arrays import F64

USUAL = (0.25, 0.5)
"""Jumps of the acceleration of position and yaw, in (m/s²)²/s and (rad/s²)²/s, that hold for the first second
and count as much as 1 s of the log later: .5 m/s² and .7 rad/s², once a second."""


def at_first(usual: float) -> Colour:
    """White noise, and the usual motion."""
    return Colour(1.0, 0.0, 1.0, 0.0, usual, 1.0, 0.0)


def within(
    colour: Colour, levels: tuple[F64, F64], scales: tuple[F64, F64], window_s: float, usual: float
) -> Colour:
    """The colour with jumps that explain mean squares beyond its noise, on blocks up to ``window_s``.

    ``levels``: numbers and mean squares (k,) of the differences. ``scales``: lengths (k,) of the blocks in s,
    and the shapes (k, 4) at the colour's time. The jumps are one standard deviation above their estimate,
    ``usual`` ones come on top.
    """
    (n, seen), (blocks_s, shapes) = levels, scales
    used = (n >= 1) & (seen > 0) & (blocks_s <= window_s)
    weight = np.sqrt(0.5 * n[used]) / seen[used]
    noise = shapes[:, [WHITE, WOBBLE]] @ np.array([colour.white, colour.wobble])
    motion = shapes[used][:, [VELOCITY, ACCELERATION]] * weight[:, None]
    jumps = not_negative(motion, (seen - noise)[used] * weight)
    size = float(np.sqrt(((motion @ jumps) ** 2).sum()))
    jumps *= 1 + 1 / max(size, 1.0)
    return replace(colour, velocity_jumps=float(jumps[0]), acceleration_jumps=float(jumps[1]) + usual)


def not_negative(columns: F64, target: F64) -> F64:
    """Least squares of two columns (k, 2) with sizes (2,) that are not negative."""
    square, pull = columns.T @ columns, columns.T @ target
    alone = np.maximum(pull, 0.0) / np.maximum(np.diag(square), 1e-300)
    gains = alone * pull
    both = square[0, 0] * square[1, 1] - square[0, 1] ** 2
    if both > 1e-12 * square[0, 0] * square[1, 1]:
        found = np.array(
            [square[1, 1] * pull[0] - square[0, 1] * pull[1], square[0, 0] * pull[1] - square[0, 1] * pull[0]]
        )
        if (found >= 0).all():
            return found / both
    return np.where(np.arange(2) == np.argmax(gains), alone, 0.0)

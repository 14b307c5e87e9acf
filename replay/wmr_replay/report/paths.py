"""A path in pieces, each in the colour of one state: mode, level of error, same or another mode."""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64


class Pieces(NamedTuple):
    """Rows to draw (m,), the piece of each, and the state of each piece's rows. A piece ends where the next
    one begins, so that the path has no hole.
    """

    rows: I64
    piece: I64
    state: I64


def pieces_of(state: I64, rows: I64) -> Pieces:
    """The pieces of a path: ``state`` (n,) of every row, ``rows`` those that are drawn, ascending."""
    drawn = state[rows]
    piece = np.cumsum(np.diff(drawn, prepend=drawn[:1]) != 0)
    again = np.flatnonzero(np.diff(piece)) + 1
    order = np.sort(np.concatenate([np.arange(len(rows)), again]))
    of_piece = piece[order]
    of_piece[np.append(np.diff(order) == 0, False)] -= 1
    return Pieces(rows[order], of_piece, drawn[np.searchsorted(piece, of_piece)])


def box_of(x_m: F64, y_m: F64) -> tuple[float, float, float, float]:
    """The rectangle around a path: x from, x to, y from, y to."""
    return float(np.nanmin(x_m)), float(np.nanmax(x_m)), float(np.nanmin(y_m)), float(np.nanmax(y_m))

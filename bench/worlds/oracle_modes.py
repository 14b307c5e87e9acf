"""What the model's own contact modes can do in the place of a hidden effect, where modes are not given.

A tool that identifies the modes has a rival that the catalogue does not list: the same effect-free model with
another mode history. Two such rivals are weighed, each at its best:

    slipping   instead of traction lost in a time or place: the model's own slipping, set or taken back in
               any pieces of .1 s about the hidden loss. Each change of mode costs 9.4, −2 ln of its
               probability at .15 changes a second and the .06 s to which it is known: many changes follow
               any loss, and are not believed.
    skidding   instead of another cornering stiffness: the same skids, each beginning and ending at another
               time. A shift δ of a beginning changes the lateral speed by v q δ, one of an end the lateral
               way by w δ; δ has the standard deviation .3 s.

Both are expected differences of twice the log-likelihood, as for the other rivals. The hidden effect's own
price, three or four fitted numbers, is not held against it.

Between two names, the modes are unknown as well (``shifts_of_modes``): each beginning and end of a skid or a
slip by .3 s, and the traction that slipping leaves by .1. Where the robot never reverses, a friction of the
wheels differs from one of the body only in what slipping takes from it. A log of a coarse pose shows neither
when a slip began nor what it left to the accuracy that telling these two asks for.
"""

import numpy as np

from wmr_schemas.arrays import F64, I64, Bool
from worlds.oracle_forms import STEP_S, Signals, Trace, accelerating, own_slipping, seen

PIECE_S, ABOUT_S = 0.1, 1.0
CHANGE_COST = 9.4
SHIFT_SD_S = 0.3
SHARE_SD = 0.1
"""Of the traction of rolling that slipping leaves: it depends on loads and tyres."""
KICK_S = 0.05


def pieces_about(s: Signals, acts: Bool) -> list[Bool]:
    """Pieces of .1 s within 1 s of where an effect ``acts`` (n,), as rows (n,) each, in their order."""
    width = 2 * round(ABOUT_S / STEP_S) + 1
    near = np.convolve(acts.astype(float), np.ones(width), "same") > 0
    number = np.floor(s.t_s / PIECE_S + 1e-6).astype(np.int64)
    return [near & (number == k) for k in np.unique(number[near])]


def toggled(s: Signals, where: Bool) -> Trace:
    """The model's own slipping set where it does not slip, and taken back where it does."""
    share_long, share_turn = s.left_by_slip
    back = (where & s.slips).astype(float)
    given = accelerating(
        s,
        back * s.long * (1 / share_long - 1) * (s.right + s.left),
        turn=back * s.turn * (1 / share_turn - 1) * (s.right - s.left),
    )
    set_there = own_slipping(s, where)
    return Trace(set_there.acceleration + given.acceleration, set_there.pose + given.pose)


class Histories:
    """Where the robot may slip: pieces of time, the truth in them, and the changes of mode about them."""

    def __init__(self, pieces: list[Bool], slips: Bool) -> None:
        width = round(PIECE_S / STEP_S)
        first = np.array([int(np.argmax(piece)) for piece in pieces])
        self.true = np.array([bool(slips[piece].mean() > 0.5) for piece in pieces])
        self.joined = np.concatenate([[False], np.diff(first) <= width, [False]])
        self.before = np.append(slips[np.maximum(first - 1, 0)], False)
        self.after = np.concatenate([[False], slips[np.minimum(first + width, len(slips) - 1)]])

    def changes_at(self, left: Bool, right: Bool) -> I64:
        """Changes at each of the m + 1 boundaries, whose neighbours slip as ``left`` and ``right`` say."""
        inner = (left != right).astype(np.int64)
        opens, closes = right != self.before, left != self.after
        opens[-1] = closes[0] = False
        return np.where(self.joined, inner, opens.astype(np.int64) + closes)

    def changes(self, state: Bool) -> I64:
        """The same of a history (m,)."""
        return self.changes_at(*beside(state))

    def changes_by_run(self, state: Bool, value: bool) -> I64:
        """How many more there are (m + 1, m + 1) with the run [first, last) set to ``value``."""
        left, right = beside(state)
        same = np.full(len(left), value)
        now = self.changes_at(left, right)
        upto = np.concatenate([[0], np.cumsum(self.changes_at(same, same) - now)])
        inside = upto[:-1][None, :] - upto[1:][:, None]
        return (self.changes_at(left, same) - now)[:, None] + (self.changes_at(same, right) - now) + inside


def beside(state: Bool) -> tuple[Bool, Bool]:
    """A history's (m,) values to the left and to the right of each boundary (m + 1,)."""
    return np.concatenate([[False], state]), np.append(state, False)


def nearest_slipping(g: F64, columns: F64, histories: Histories) -> float:
    """The least of |g − C b|² and the price of further changes, b saying which pieces are toggled.

    Runs of pieces are set to one value, the best first, from the truth and from slipping throughout.
    """
    gram, along, true = columns.T @ columns, columns.T @ g, histories.true
    none = int(histories.changes(true).sum())

    def cost(state: Bool) -> float:
        x = (state != true).astype(float)
        further = int(histories.changes(state).sum()) - none
        return float(g @ g - 2 * along @ x + x @ gram @ x) + CHANGE_COST * further

    def lowered(state: Bool) -> Bool:
        options = [best_run(state, value) for value in (False, True)]
        _, (i, j), value = min(
            (change, run, v) for (change, run), v in zip(options, (False, True), strict=True)
        )
        changed = state.copy()
        changed[i:j] = value
        return changed

    def best_run(state: Bool, value: bool) -> tuple[float, tuple[int, int]]:
        x = (state != true).astype(float)
        step = (true != value).astype(float) - x
        total = np.concatenate([[0.0], np.cumsum(step * (along - gram @ x))])
        square = np.zeros((len(x) + 1, len(x) + 1))
        square[1:, 1:] = np.cumsum(np.cumsum(step[:, None] * gram * step, axis=0), axis=1)
        own = np.diag(square)[:, None] + np.diag(square) - square - square.T
        change = own - 2 * (total - total[:, None]) + CHANGE_COST * histories.changes_by_run(state, value)
        i, j = np.triu_indices(len(x) + 1, 1)
        k = int(np.argmin(change[i, j]))
        return float(change[i[k], j[k]]), (int(i[k]), int(j[k]))

    least = np.inf
    for state in (true, np.ones_like(true)):
        best = cost(state)
        while (lower := cost(changed := lowered(state))) < best - 1e-9:
            best, state = lower, changed  # noqa: PLW2901
        least = min(least, best)
    return max(least, 0.0)


def shifts_of_skids(s: Signals) -> list[Trace]:
    """Per second of a later beginning or end of each skid, what the model's motion changes by."""
    edges = np.flatnonzero(np.diff(s.skids, prepend=False, append=False)).reshape(-1, 2)
    found = []
    for first, last in edges:
        if first > 0:
            kicked = (s.t_s >= s.t_s[first]) & (s.t_s < s.t_s[first] + KICK_S)
            found.append(accelerating(s, lat=s.v[first] * s.q[first] / KICK_S * kicked))
        if last < len(s.t_s):
            w, yaw, after = s.w[last - 1], s.yaw[last - 1], np.arange(len(s.t_s)) >= last
            found.append(seen(s, -w * np.sin(yaw) * after, w * np.cos(yaw) * after))
    return found


def shifts_of_modes(s: Signals) -> list[Trace]:
    """What the modes' unknowns change the motion by, each by one standard deviation."""
    shifted = [times(SHIFT_SD_S, one) for one in (*shifts_of_skids(s), *shifts_of_slips(s))]
    return shifted + [times(SHARE_SD, one) for one in other_slipping(s)]


def shifts_of_slips(s: Signals) -> list[Trace]:
    """Per second of a later beginning or an earlier end of each slip, what the model's motion changes by."""
    inner = np.flatnonzero(np.diff(s.slips)) + 1
    kicks = ((s.t_s >= s.t_s[k]) & (s.t_s < s.t_s[k] + KICK_S) for k in inner)
    return [times(1 / KICK_S, toggled(s, kick)) for kick in kicks]


def other_slipping(s: Signals) -> list[Trace]:
    """Per unit of traction that slipping leaves more, ahead and in turning, what the motion changes by."""
    if not np.any(s.slips):
        return []
    share_long, share_turn = s.left_by_slip
    ahead = accelerating(s, s.slips * s.long / share_long * (s.right + s.left))
    turning = accelerating(s, turn=s.slips * s.turn / share_turn * (s.right - s.left))
    return [ahead, turning]


def times(size: float, one: Trace) -> Trace:
    """A trace of another size."""
    return Trace(size * one.acceleration, size * one.pose)


def nearest_skidding(g: F64, columns: F64) -> float:
    """The least of |g − C δ|² + |δ|²/sd²."""
    inverse = np.eye(columns.shape[1]) / SHIFT_SD_S**2
    return float(g @ g - columns.T @ g @ np.linalg.solve(columns.T @ columns + inverse, columns.T @ g))

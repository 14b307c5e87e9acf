"""Terms that are tried where no effect of the catalogue explains the prediction errors."""

from collections.abc import Iterable, Iterator
from itertools import combinations, permutations, product
from weakref import WeakKeyDictionary

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from wmr_replay.effects.efforts import InputEffects
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dynamics import Base
from wmr_schemas.arrays import F64
from wmr_schemas.shape_factors import SHAPED
from wmr_schemas.terms import Term, TermChannel
from wmr_schemas.terms import columns_of as columns_in

FIRST = ("effort_sum", "effort_diff", "v", "yaw_rate")
WINDOWS_BINS, DEGREE = (19, 25, 31, 37, 43), 3
"""Windows and degree of the local polynomials that give speeds: .7 s follow a driver's changes of speed."""
ENOUGH_MPS = 0.03
"""Noise of a speed from which on a window need be no longer: friction changes its sign within as much."""
HOLE_STEPS = 5
"""Usual steps from which on one is a hole in the poses."""
PRODUCTS: dict[TermChannel, tuple[str, ...]] = {
    "longitudinal": (
        *("yaw_rate", "abs(yaw_rate)", "yaw_rate*yaw_rate", "v*yaw_rate", "v*abs(yaw_rate)"),
        *("v*yaw_rate*yaw_rate", "v*v*v", "sgn(v)*abs(yaw_rate)", "effort_sum*abs(v)", "effort_sum*v*v"),
        *("effort_sum*abs(yaw_rate)", "effort_diff", "effort_sum*abs(effort_sum)", "abs(effort_sum)"),
        *("v*cos(yaw)", "v*sin(yaw)"),
    ),
    "yaw": (
        *("v", "abs(v)", "v*v", "v*yaw_rate", "abs(v)*yaw_rate", "v*v*yaw_rate", "yaw_rate*abs(yaw_rate)"),
        *("effort_sum", "effort_diff*abs(v)", "effort_diff*abs(yaw_rate)", "effort_diff*abs(effort_diff)"),
        *("abs(effort_diff)", "cos(yaw)", "sin(yaw)", "v*cos(yaw)", "v*sin(yaw)"),
    ),
}
OF_FORMULAS: dict[TermChannel, tuple[str, ...]] = {
    "longitudinal": (
        *("1", "v", "abs(v)", "v*v", "v*abs(v)", "v*v*v", "abs(v)*v*v", "v*v*v*v*v", "sgn(v)", "effort_sum"),
        *(
            "abs(v)*yaw_rate",
            "yaw_rate*abs(yaw_rate)",
            "v*yaw_rate*yaw_rate*yaw_rate",
            "cos(yaw)",
            "sin(yaw)",
        ),
        *("t", "v*t", "v*t*t", "effort_sum*t", "effort_sum*t*t", "effort_diff*t"),
    ),
    "yaw": (
        *("1", "yaw_rate", "abs(yaw_rate)", "yaw_rate*yaw_rate", "yaw_rate*yaw_rate*yaw_rate"),
        *("sgn(yaw_rate)", "abs(v)*sgn(yaw_rate)", "abs(v)*yaw_rate*abs(yaw_rate)", "effort_diff"),
        *("effort_diff*v*v", "t", "yaw_rate*t", "yaw_rate*t*t", "effort_diff*t", "effort_diff*t*t"),
        "effort_sum*t",
    ),
}
"""What a formula of several terms is made of besides: the forms of the library's effects, their next powers,
and products with the time.
"""

CURVES: dict[TermChannel, tuple[tuple[str, ...], ...]] = {
    "longitudinal": (
        ("sgn(v)", "v", "v*abs(v)"),
        ("v", "v*abs(v)", "v*v*v"),
        ("abs(v)", "v*v", "abs(v)*v*v"),
        ("v*yaw_rate", "v*yaw_rate*yaw_rate*yaw_rate"),
        ("v", "v*abs(yaw_rate)", "v*yaw_rate*yaw_rate"),
        ("effort_sum", "abs(effort_sum)", "effort_sum*abs(effort_sum)"),
        ("effort_sum", "effort_sum*abs(v)", "effort_sum*v*v"),
        ("effort_sum", "effort_sum*t", "effort_sum*t*t"),
        ("v", "v*t", "v*t*t"),
    ),
    "yaw": (
        ("sgn(yaw_rate)", "yaw_rate", "yaw_rate*abs(yaw_rate)"),
        ("yaw_rate", "yaw_rate*abs(yaw_rate)", "yaw_rate*yaw_rate*yaw_rate"),
        ("abs(yaw_rate)", "yaw_rate*yaw_rate"),
        ("1", "abs(v)", "v*v"),
        ("yaw_rate", "abs(v)*yaw_rate", "v*v*yaw_rate"),
        ("effort_diff", "abs(effort_diff)", "effort_diff*abs(effort_diff)"),
        ("effort_diff", "effort_diff*abs(v)", "effort_diff*v*v"),
        ("effort_diff", "effort_diff*t", "effort_diff*t*t"),
        ("yaw_rate", "yaw_rate*t", "yaw_rate*t*t"),
    ),
}
"""Terms that are tried together: a curve of one variable that bends, where no term alone explains much."""


def terms_of(products: dict[TermChannel, tuple[str, ...]]) -> tuple[Term, ...]:
    """The terms of a table of products."""
    return tuple(Term(c, tuple(product.split("*"))) for c, some in products.items() for product in some)


def ordered(factors: Iterable[str]) -> str:
    """The product with efforts first, then speeds: one name for each."""
    return "*".join(sorted(factors, key=lambda factor: FIRST.index(columns_in(factor)[0])))


def pair_products() -> Iterator[str]:
    """The products of two signed quantities, odd or even in each of them."""
    for one, other in combinations(SHAPED, 2):
        for factors in product((one, f"abs({one})"), (other, f"abs({other})")):
            yield ordered(factors)


def pair_curves() -> Iterator[tuple[str, ...]]:
    """A quantity whose share changes with the size of another one, or with its sign, by a parabola."""
    for one, other in permutations(SHAPED, 2):
        for own in (one, f"abs({one})"):
            powers = (f"abs({other})",), (other, other), (other,), (other, f"abs({other})")
            by_size, by_square, by_sign, by_both = (ordered((own, *some)) for some in powers)
            yield own, by_size, by_square
            yield by_sign, by_both


def own_curves() -> Iterator[tuple[str, ...]]:
    """Curves of one quantity, odd and even."""
    for z in SHAPED:
        yield z, f"{z}*abs({z})", f"{z}*{z}*{z}"
        yield f"abs({z})", f"{z}*{z}", f"abs({z})*{z}*{z}"


SOFT_SIGNS = {"v": ("soft(v,0.08)", "soft(v,0.3)"), "yaw_rate": ("soft(yaw_rate,0.08)", "soft(yaw_rate,0.3)")}
"""Frictions of a contact that gives way before it slides, and of grease. Physics: a tyre's set in over some
cm/s, a fluid's over walking pace.
"""


def frictions() -> Iterator[str]:
    """Frictions, abrupt and soft, in proportion to the size of another quantity: a load, a torque, a bend."""
    for moving, soft in SOFT_SIGNS.items():
        for other in (z for z in SHAPED if z != moving):
            for sign in (f"sgn({moving})", *soft):
                yield ordered((f"abs({other})", sign))


OVER_PLANE: dict[TermChannel, tuple[str, ...]] = {
    "longitudinal": ("sgn(v)", *SOFT_SIGNS["v"], "v", "effort_sum"),
    "yaw": ("sgn(yaw_rate)", *SOFT_SIGNS["yaw_rate"], "yaw_rate", "v", "effort_diff"),
}
"""What grows evenly from one side of the area to the other: a hose that is drawn out, a rising wind."""


def plane_curves(channel: TermChannel) -> Iterator[tuple[str, ...]]:
    """Frictions, drags and gains with a plane over x and y."""
    for own in OVER_PLANE[channel]:
        yield own, f"{own}*x", f"{own}*y"


BY_SIGN = (
    "effort_sum*sgn(v)",
    "effort_diff*sgn(yaw_rate)",
    "sgn(v)",
    "sgn(yaw_rate)",
)
"""What a change of direction changes."""
POWERS_OF_ONE = tuple(power for curve in own_curves() for power in curve)
FOR_BOTH = dict.fromkeys(PRODUCTS, (*POWERS_OF_ONE, *pair_products(), *BY_SIGN, *frictions()))
"""Products that are tried on both channels."""


def curves_of() -> dict[tuple[Term, ...], None]:
    """Every curve once."""
    curves = {c: (*some, *own_curves(), *pair_curves(), *plane_curves(c)) for c, some in CURVES.items()}
    return dict.fromkeys(terms_of({c: curve}) for c, some in curves.items() for curve in some)


TERMS = terms_of(PRODUCTS)
FORMULA_TERMS = tuple(dict.fromkeys((*TERMS, *terms_of(OF_FORMULAS), *terms_of(FOR_BOTH))))
CURVE_TERMS = tuple(curves_of())


def window_of(binned: BinnedLog) -> int:
    """The shortest window at which the places give speeds to ``ENOUGH_MPS``, or the longest that fits."""
    sd_m = float(np.sqrt(np.median(binned.variances[:, 0])))
    step_s = float(np.median(binned.step_s[1:]))
    long = [window for window in WINDOWS_BINS if window <= len(binned)] or [WINDOWS_BINS[0]]
    return next((window for window in long if sd_m * slope_sd(step_s, window) <= ENOUGH_MPS), long[-1])


def slopes_of(binned: BinnedLog) -> F64:
    """Slopes (n, 3) of the poses per second; of no polynomial over a hole, which would say nothing."""
    step_s, window = float(np.median(binned.step_s[1:])), window_of(binned)
    holes = np.flatnonzero(binned.step_s > HOLE_STEPS * step_s)
    runs = zip(np.split(binned.t_s, holes), np.split(binned.pose, holes), strict=True)
    return np.concatenate([run_slopes(t_s, pose, step_s, window) for t_s, pose in runs])


def run_slopes(t_s: F64, x: F64, step_s: float, window: int) -> F64:
    """Slopes (n, k) of a run of bins without a hole; those of a straight line where no window fits."""
    if len(x) < WINDOWS_BINS[0]:
        from_mean_s = t_s - t_s.mean()
        return np.tile(from_mean_s @ x / max(float(from_mean_s @ from_mean_s), step_s**2), (len(x), 1))
    return smoothed_slopes(x, step_s, next(w for w in (window, *WINDOWS_BINS[::-1]) if w <= len(x)))


def smoothed_slopes(x: F64, step_s: float, window: int) -> F64:
    """Slopes (n, k) of signals (n, k) every ``step_s``: of a polynomial through the bins about each one, at
    the ends through the first or last ones (Savitzky and Golay, 1964; scipy.signal takes a second to import).
    """
    half, fit = window // 2, smoothing(window)
    slopes = np.empty_like(x)
    slopes[half:-half] = np.einsum("nkw,w->nk", sliding_window_view(x, window, axis=0), fit[1])
    orders = np.arange(1, DEGREE + 1)
    for rows, at in ((slice(0, half), np.arange(-half, 0)), (slice(-half, None), np.arange(1, half + 1))):
        ends = x[:window] if at[0] < 0 else x[-window:]
        slopes[rows] = (orders * at[:, None] ** (orders - 1.0)) @ (fit[1:] @ ends)
    return slopes / step_s


def smoothing(window: int) -> F64:
    """The polynomial's coefficients (4, ``window``) by the bins about one; the second row gives its slope per
    bin.
    """
    half = window // 2
    powers = np.arange(-half, half + 1)[:, None] ** np.arange(DEGREE + 1.0)
    return np.asarray(np.linalg.pinv(powers))


def slope_sd(step_s: float, window: int) -> float:
    """Standard deviation of :func:`smoothed_slopes` of white noise of 1."""
    return float(np.linalg.norm(smoothing(window)[1])) / step_s


KNOWN_COLUMNS: WeakKeyDictionary[BinnedLog, dict[str, F64]] = WeakKeyDictionary()
"""The columns of the logs that are analysed, since every pass of a filter reads them."""


def columns_of(binned: BinnedLog) -> dict[str, F64]:
    """The terms' quantities at each row, (n,): speeds from the poses, smoothed over .7 s or more where they
    are noisy, efforts, time and place.
    """
    if binned not in KNOWN_COLUMNS:
        KNOWN_COLUMNS[binned] = computed_columns(binned)
    return KNOWN_COLUMNS[binned]


def computed_columns(binned: BinnedLog) -> dict[str, F64]:
    """The columns of :func:`columns_of`."""
    moved = slopes_of(binned)
    cos, sin = np.cos(binned.pose[:, 2]), np.sin(binned.pose[:, 2])
    left, right = binned.torque.means(binned.t_s, InputEffects())
    v = moved[:, 0] * cos + moved[:, 1] * sin
    return {
        "v": v,
        "v_lat": moved[:, 1] * cos - moved[:, 0] * sin,
        "yaw": binned.pose[:, 2],
        "yaw_rate": moved[:, 2],
        "effort_sum": right + left,
        "effort_diff": right - left,
        "t": binned.t_s,
        "x": binned.pose[:, 0],
        "y": binned.pose[:, 1],
        "s": np.cumsum(v * binned.step_s),
    }


def is_one_way(speed: F64, share: float) -> bool:
    """Whether a speed (n,) hardly ever has its rarer sign: below a share of the other one's squares."""
    back, ahead = (float(np.sum(np.maximum(sign * speed, 0.0) ** 2)) for sign in (-1, 1))
    return min(back, ahead) < share * max(back, ahead)


def own_columns_of(binned: BinnedLog) -> dict[str, F64]:
    """The columns that a user's effect reads, :data:`wmr_schemas.effects.own.Columns`, at each row (n,)."""
    terms = columns_of(binned)
    return {
        "t_s": binned.t_s,
        "x_m": binned.pose[:, 0],
        "y_m": binned.pose[:, 1],
        "yaw_rad": terms["yaw"],
        "v_mps": terms["v"],
        "v_lat_mps": terms["v_lat"],
        "yaw_rate_radps": terms["yaw_rate"],
        "left_nm": (terms["effort_sum"] - terms["effort_diff"]) / 2,
        "right_nm": (terms["effort_sum"] + terms["effort_diff"]) / 2,
    }


def as_efforts(binned: BinnedLog, base: Base, terms: Iterable[Term] = TERMS) -> Iterator[tuple[Term, F64]]:
    """Each of the terms with the change (n, 2) of left and right effort that equals a coefficient of 1."""
    columns = columns_of(binned)
    for term in terms:
        yield term, effort_change(term.channel, term.evaluate(columns), base)


def effort_change(channel: TermChannel, value: F64, base: Base) -> F64:
    """The change (n, 2) of left and right effort that gives an acceleration ``value`` (n,) on a channel."""
    if channel == "longitudinal":
        share = value / (2 * base.alpha)
        return np.column_stack([share, share])
    share = value / (2 * base.alpha_yaw)
    return np.column_stack([-share, share])

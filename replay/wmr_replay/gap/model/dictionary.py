"""Terms that are tried where no effect of the library explains what is missing."""

from collections.abc import Iterator

import numpy as np
from scipy.signal import savgol_filter

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.inputs import InputEffects
from wmr_schemas.arrays import F64
from wmr_schemas.effects import EFFECTS, UNNAMED_PREFIX, EffectForm
from wmr_schemas.terms import COEFFICIENT, Term, TermChannel, parse_term

SMOOTHED_BINS, DEGREE = 19, 3
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
TERMS = tuple(
    Term(channel, tuple(product.split("*"))) for channel, products in PRODUCTS.items() for product in products
)


def form_of(name: str) -> EffectForm:
    """An effect's entry in the catalogue, or what stands for it where it is a term of the dictionary."""
    if not name.startswith(UNNAMED_PREFIX):
        return EFFECTS[name]
    term = parse_term(name)
    return EffectForm(name, term.channel, term.formula, {COEFFICIENT: "SI"})


def columns_of(drive: BinnedLog) -> dict[str, F64]:
    """The terms' quantities at each row, (n,): speeds from the poses, smoothed over .7 s, and efforts."""
    step_s = float(np.median(drive.step_s[1:]))
    moved = savgol_filter(drive.pose, SMOOTHED_BINS, DEGREE, deriv=1, delta=step_s, axis=0)
    cos, sin = np.cos(drive.pose[:, 2]), np.sin(drive.pose[:, 2])
    left, right = drive.torque.means(drive.t_s, InputEffects())
    return {
        "v": moved[:, 0] * cos + moved[:, 1] * sin,
        "v_lat": moved[:, 1] * cos - moved[:, 0] * sin,
        "yaw": drive.pose[:, 2],
        "yaw_rate": moved[:, 2],
        "effort_sum": right + left,
        "effort_diff": right - left,
    }


def as_efforts(drive: BinnedLog, base: Base) -> Iterator[tuple[Term, F64]]:
    """Each term with the change (n, 2) of left and right effort that has the effect of a coefficient of 1."""
    columns = columns_of(drive)
    for term in TERMS:
        value = term.evaluate(columns)
        if term.channel == "longitudinal":
            share = value / (2 * base.alpha)
            yield term, np.column_stack([share, share])
        else:
            share = value / (2 * base.alpha_yaw)
            yield term, np.column_stack([-share, share])

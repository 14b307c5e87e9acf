"""Thresholds of the algebraic identifier, each with its reason. Compiled code takes them as constants.

Where a line gives no reason, the value was chosen on development logs of the benchmark, and no measurement of
it alone is recorded.
"""

from typing import NamedTuple


class AlgebraicRules(NamedTuple):
    """Bins, branching, pruning and merging of hypotheses."""

    bin_ns: int = 40_000_000
    """40 ms: short against a window of .1 s and more, and 40 rows at 1 kHz become one equation."""
    outlier_sd: float = 6.0
    """A row further than 6 sd of a difference from the last accepted one is an outlier: noise alone 2e-9."""
    max_outliers: int = 5
    """So many outliers in a row; the next one says that the pose has jumped."""
    margin_mps: float = 1.0
    """Speed that motion may have beyond twice the present estimate before a row counts as an outlier."""
    margin_radps: float = 1.0
    """The same for the yaw rate."""
    min_sd: float = 1e-4
    """No pose is trusted beyond .1 mm and .1 mrad."""

    branch_s: float = 0.12
    """Three bins between branchings: the instant of a switch is uncertain by as much."""
    surprise: float = 25.0
    """χ² of three degrees of freedom with a chance of 1.5e-5: then hypotheses branch at once."""
    max_gap_s: float = 1.0
    """After a longer gap everything but the gains starts again: any motion fits into it."""
    warm_up_s: float = 1.0
    """No verdict for so long after a start: the speed's prior is wide."""
    jump_shows_s: float = 0.5
    """Rows have the status pose_jump for so long after a jump, as those of the filter bank."""

    n_kept: int = 12
    """Hypotheses that are kept."""
    min_parent_log: float = -10.0
    """A hypothesis below e⁻¹⁰ has no children: they would fall below ``min_kept_log``."""
    min_kept_log: float = -12.0
    """A hypothesis that is e¹² times less probable than the best is pruned."""
    same_mean: float = 0.04
    """Hypotheses are merged when means differ by no more than .2 sd (.04 in variances) …"""
    same_variance: float = 1.5
    """… and variances by no more than a factor of 1.5."""
    min_gain_log: float = -4.605170185988091
    """ln .01: hypotheses below 1 % do not count in the interval of α."""

    min_log_decay: float = -2.0
    """Bounds of ln λ in the linearisation, λ from .14/s …"""
    max_log_decay: float = 4.0
    """… to 55/s: a faster decay is over within a bin."""


RULES = AlgebraicRules()

"""Torques as they act, averaged over each step of the filter: the closed form of lag and delay."""

import math
from dataclasses import dataclass

import numpy as np

from wmr_replay.effects.efforts import InputEffects, static_part
from wmr_schemas.arrays import F64, NS_PER_S, Bool
from wmr_schemas.compiled.lean import lean
from wmr_schemas.signals import TorqueTrack


@dataclass(frozen=True, eq=False)
class TorqueHistory:
    """Efforts (2, m), left and right, in N·m, each held from its stamp ``t_s`` (m,) on."""

    t_s: F64
    efforts_nm: F64

    @classmethod
    def of(cls, track: TorqueTrack, start_ns: int) -> "TorqueHistory":
        """Rows with a known effort on both wheels."""
        known = are_known(track)
        t_s = (track.t_ns[known] - start_ns) / NS_PER_S
        return cls(t_s, np.stack([track.left_nm[known], track.right_nm[known]]))

    def means(self, edges_s: F64, effects: InputEffects) -> F64:
        """Mean effort (2, n) over each step from ``edges_s[k-1]`` to ``edges_s[k]``; the first is the value
        there. Exact for held torques, with the lag and the delay.
        """
        acting = static_part(self.efforts_nm, effects)
        at_s = edges_s - effects.delay_s
        integral = np.empty((2, len(at_s)))
        for u, filled in zip(acting, integral, strict=True):
            integrate(self.t_s, u, effects.lag_s, at_s, filled)
        steps = np.diff(edges_s)
        first = acting[:, [max(int(np.searchsorted(self.t_s, at_s[0], side="right")) - 1, 0)]]
        return np.concatenate([first, np.diff(integral, axis=1) / steps], axis=1)


def are_known(track: TorqueTrack) -> Bool:
    """Which rows (n,) hold the efforts of both wheels."""
    return np.asarray(np.isfinite(track.left_nm) & np.isfinite(track.right_nm))


@lean
def integrate(t_s: F64, u: F64, lag_s: float, at_s: F64, out: F64) -> None:
    """``out`` ← ∫ y dt up to each of ``at_s`` (increasing): lag·ẏ = u − y, u is held from stamp to stamp.

    ∫ y = ∫ u − lag·(y − y₀), and y follows each held piece by its exponential.
    """
    i, area, y, here = 0, 0.0, u[0], t_s[0]
    for k in range(len(at_s)):
        while i + 1 < len(t_s) and t_s[i + 1] <= at_s[k]:
            area += u[i] * (t_s[i + 1] - here)
            y = u[i] + (y - u[i]) * math.exp(-(t_s[i + 1] - here) / lag_s) if lag_s > 0.0 else u[i]
            i += 1
            here = t_s[i]
        dt = at_s[k] - here
        total = area + u[i] * dt
        if lag_s > 0.0:
            now = u[i] + (y - u[i]) * math.exp(-max(dt, 0.0) / lag_s)
            total -= lag_s * (now - u[0])
        out[k] = total

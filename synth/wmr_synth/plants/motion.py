"""A simulated motion, and the instants at which it is recorded."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, Bool


@dataclass(frozen=True, eq=False)
class Motion:
    """The true motion at ``t_ns`` (n,), in robot conventions; efforts and mode as in force from then on."""

    t_ns: I64
    x_m: F64
    y_m: F64
    yaw_rad: F64
    v_long_mps: F64
    v_lat_mps: F64
    yaw_rate_radps: F64
    a_long_mps2: F64
    yaw_acc_radps2: F64
    sigma_sum_mps: F64
    sigma_diff_mps: F64
    effort_left_nm: F64
    effort_right_nm: F64
    left_rad: F64
    right_rad: F64
    left_radps: F64
    right_radps: F64
    mode: I8

    def at(self, t_ns: I64) -> "Motion":
        """The rows at ``t_ns``, each of which is an instant of the motion."""
        if len(t_ns) == len(self.t_ns):
            return self
        return self.take(np.searchsorted(self.t_ns, t_ns))

    def take(self, rows: I64 | Bool | slice) -> "Motion":
        """Some of the rows."""
        return Motion(**{name: column[rows] for name, column in vars(self).items()})


def union_of_sorted(*tracks: I64) -> I64:
    """Every instant of the sorted tracks once, in order."""
    t_ns = np.sort(np.concatenate(tracks), kind="stable")
    union: I64 = t_ns[np.concatenate([[True], np.diff(t_ns) > 0])]
    return union

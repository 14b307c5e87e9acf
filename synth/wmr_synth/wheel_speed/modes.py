"""The true contact mode, out of the true slip."""

import numpy as np

from wmr_schemas.arrays import F64, I8
from wmr_schemas.modes import ContactMode

SKIDDING_MPS = 0.03
SLIPPING_MPS, SLIPPING_SHARE = 0.05, 0.03


def modes_of(sideways_mps: F64, lost_mps: F64, v_long_mps: F64) -> I8:
    """Modes (n,) out of slip beyond the robot's own: sideways (n,), and at the wheels (2, n).

    Skidding where |v_lat + x_icr·yaw_rate + k·v_long·yaw_rate| > .03 m/s; slipping where a wheel's |s| is
    above .05 m/s and above .03·|v_long|; both, or else ideal.
    """
    skids = np.abs(sideways_mps) > SKIDDING_MPS
    slips = np.abs(lost_mps).max(axis=0) > np.maximum(SLIPPING_MPS, SLIPPING_SHARE * np.abs(v_long_mps))
    mode: I8 = (skids * ContactMode.SKIDDING + slips * ContactMode.SLIPPING).astype(np.int8)
    return mode
